"""Which number answers which question: the calls, units and times of docs/guides/which_number.rst.

Times are medians on one grasp of four contacts with eight edges, from Python, on this machine.
"""

import time

import numpy as np

import graspforce as gf

CUP = {
    "positions": [(0.04, 0, 0), (-0.02, 0.035, 0.01), (-0.02, -0.035, -0.01), (0, 0.04, 0.02)],
    "normals": [(-1, 0, 0.1), (0.5, -0.866, 0), (0.5, 0.866, 0.2), (0, -1, -0.3)],
    "friction": 0.6,
    "max_normal_force": 20.0,
    "length_scale": 0.04,
}
WEIGHT = [0, 0, -5, 0, 0, 0]
grasp = gf.Grasp(**CUP)
distributor = gf.ForceDistributor(grasp)
forces = np.empty((4, 3))
steps = np.random.default_rng(0).normal(size=(1000, 6)) * [1, 1, 1, 0, 0, 0]
wrenches = np.array(WEIGHT) + 0.02 * steps.cumsum(axis=0)
many = {key: np.tile(CUP[key], (1000, 1, 1)) for key in ("positions", "normals")}
many["positions"] = many["positions"] + np.random.default_rng(1).normal(scale=1e-3, size=(1000, 4, 3))
others = {key: CUP[key] for key in ("friction", "max_normal_force", "length_scale")}
feet = gf.Grasp(CUP["positions"], [(0, 0, 1)] * 4, friction=0.5, max_normal_force=20.0)


def along_a_trajectory():
    for wrench in wrenches:
        distributor.solve_into(wrench, forces)


# Question; call; what it is for; unit; a function to time; how many answers one call of it gives.
ROWS = [
    (
        "Can the contacts resist any wrench at all?",
        "Grasp.is_force_closure",
        "yes or no",
        lambda: gf.Grasp(**CUP).is_force_closure,
        1,
    ),
    (
        "How strong is the grasp in its worst direction, each finger limited?",
        'Grasp.quality("max")',
        "N",
        lambda: grasp.quality("max"),
        1,
    ),
    (
        "The same, the sum of the fingers limited, as in most papers?",
        'Grasp.quality("sum")',
        "N",
        lambda: grasp.quality("sum"),
        1,
    ),
    (
        "How large a push does it resist on top of the weight?",
        'Grasp.quality("max", external_wrench=)',
        "N",
        lambda: grasp.quality("max", external_wrench=WEIGHT),
        1,
    ),
    (
        "How heavy may the object be? How strong a push along this line?",
        "Grasp.resistance",
        "times the given wrench",
        lambda: grasp.resistance([WEIGHT]),
        1,
    ),
    (
        "Which of these thousands of grasps is best?",
        "quality_many",
        "N, for each grasp",
        lambda: gf.quality_many(**many, **others, criterion="sum"),
        1000,
    ),
    (
        "Where should the contacts move?",
        "quality_many(gradient=True)",
        "N/m, for each grasp",
        lambda: gf.quality_many(**many, **others, criterion="sum", gradient=True),
        1000,
    ),
    (
        "How hard must each finger press now?",
        "ForceDistributor.solve",
        "N; shares of the limits",
        lambda: gf.ForceDistributor(grasp).solve(WEIGHT),
        1,
    ),
    (
        "The same in a control loop?",
        "ForceDistributor.solve_into",
        "N; shares of the limits",
        along_a_trajectory,
        1000,
    ),
    (
        "How far are the limits from balancing this wrench?",
        "ForceDistributor.nearest",
        "N",
        lambda: distributor.nearest([0, 0, -500, 0, 0, 0]),
        1,
    ),
    (
        "How much friction does the grasp need?",
        "least_friction",
        "coefficient",
        lambda: gf.least_friction(grasp),
        1,
    ),
    (
        "How likely does it close if contacts miss their places?",
        "probability_of_closure",
        "probability",
        lambda: gf.probability_of_closure(grasp, gf.PlacementNoise(position_std=1e-3, samples=1000)),
        1,
    ),
    ("Where may the centre of mass be?", "support_region", "m", lambda: gf.support_region(feet, 10.0), 1),
    ("What do the classical measures say?", "Grasp.measures", "see there", grasp.measures, 1),
]


def median_seconds(call, answers):
    """Return the median time of one answer."""
    call()
    times = []
    began = time.perf_counter()
    while len(times) < 3 or (time.perf_counter() - began < 0.1 and len(times) < 100):
        start = time.perf_counter()
        call()
        times.append((time.perf_counter() - start) / answers)
    return float(np.median(times))


def readable(seconds):
    """Return a time with two digits and its unit."""
    unit, size = next((each for each in (("s", 1.0), ("ms", 1e-3)) if seconds >= each[1]), ("us", 1e-6))
    return f"{float(f'{seconds / size:.2g}'):g} {unit}"


def main():
    """Print the table in reStructuredText."""
    print(".. list-table::\n   :header-rows: 1\n   :widths: 5 4 3 2\n")
    print("   * - Question\n     - Call\n     - Unit\n     - Time")
    for question, call, unit, timed, answers in ROWS:
        name, arguments = call.partition("(")[::2]
        shown = f"`{name} <graspforce.{name}>`" + (f" ``({arguments}``" if arguments else "")
        took = readable(median_seconds(timed, answers))
        print(f"   * - {question}\n     - {shown}\n     - {unit}\n     - {took}")


if __name__ == "__main__":
    main()
