"""Does a planned grasp hold? Random objects, both hands, six pushes each, in simulation.

Run by ``python benches/hands.py``; one row by ``python benches/hands.py --only shadow``. The objects are
fifty of the thousand random ones of pybullet. A seed drew them before any run; they are scaled to 5, 8 and
12 cm.
An object that cannot be read or planned for counts as a failure. The search itself tries its best plans in
simulation, for a shorter time, unless ``--untried`` is given. ``--ablations`` leaves out one part of the
search at a time, and also pushes three times as hard. ``--servo 1`` changes the stiffness of the servos.
"""

import argparse
import dataclasses
import functools
import sys
import time
import warnings

import numpy as np
from holding.objects import numbers, random_mesh

import graspforce as gf
from graspforce.hands import preset, search, seeds, shake

ROWS = {
    "allegro, four fingers": ("allegro-right", None),
    "allegro, thumb and two": ("allegro-right", [0, 1, 2]),
    "shadow, five fingers": ("shadow", None),
}
PUSH = 10.0  # m/s^2
# Name of a trial: its control, whether it begins at the pregrasp, and its pushes.
TRIALS = {
    "squeeze": ("squeeze", False, PUSH),
    "closing": ("squeeze", True, PUSH),
    "servo": ("servo", False, PUSH),
    "torque": ("torque", False, PUSH),
    "three times the push": ("squeeze", False, 3 * PUSH),
}


def pressed_alike(plan):
    """Return the plan with a preload that does not balance: each finger presses as hard as the others."""
    forces = np.zeros_like(plan.resting_forces)
    forces[:, 0] = plan.preload
    return dataclasses.replace(plan, resting_forces=forces)


def run(
    hand, fingers, size, objects, *, trials=("squeeze", "closing"), change=None, verbose=False, ablated=False,
    **options,
):  # fmt: skip
    """Plan and shake each object, and print what was held and what it took."""
    held, seconds, cpu, plans = dict.fromkeys(trials, 0), [], [], []
    for number in objects:
        began, used = time.perf_counter(), time.process_time()
        try:
            mesh = random_mesh(number, size)
            began, used = time.perf_counter(), time.process_time()
            found = gf.plan_hand(hand, mesh, fingers, **options)
        except gf.GraspForceError as error:
            print(f"  object {number:03d}: no plan: {error}")
            seconds.append(time.perf_counter() - began)
            cpu.append(time.process_time() - used)
            continue
        seconds.append(time.perf_counter() - began)
        cpu.append(time.process_time() - used)
        plan = found.best if change is None else change(found.best)
        plans.append(plan)
        result = []
        for name in trials:
            control, closing, push = TRIALS[name]
            trial = shake(plan, mesh, control=control, closing=closing, acceleration=push)
            held[name] += trial.success
            result.append(f"{name} {int(trial.held.sum())} of 6")
        if verbose or (not ablated and any("6 of 6" not in text for text in result)):
            print(f"  object {number:03d}: {plan}: {', '.join(result)}")
    count = len(objects)
    on_pads = np.mean([p.pad_angle <= np.deg2rad(45.01) for p in plans]) if plans else 0
    shown = ", ".join(f"{name} {n}" for name, n in held.items())
    error = max((p.contact_error for p in plans), default=0) * 1e3
    depth = max((p.penetration for p in plans), default=0) * 1e3
    print(f"  {len(plans)} of {count} planned; all six pushes held: {shown}")
    print(
        f"  contact error at most {error:.2f} mm, penetration {depth:.2f} mm, on pads within 45 degrees "
        f"{100 * on_pads:.0f}%"
    )
    print(f"  median time to a plan {np.median(seconds):.2f} s, {np.median(cpu):.2f} s of processor")


def ablations(hand, fingers, size, objects):
    whole = {"seeds": "contacts"}
    cases = {
        "whole pipeline": {},
        "no trial within the search": {"simulate": False},
        "no refinement": {"refine": False},
        "chosen by quality, not by slip onset": {"rank": "quality"},
        "no balanced preload: all fingers press alike": {"change": pressed_alike},
        "contacts first, with reach in the choice": whole,
        "contacts first, no reach in the choice": whole,
    }
    for name, options in cases.items():
        print(name)
        search.contact_seeds = functools.partial(seeds.contact_seeds, reach="no reach" not in name)
        run(hand, fingers, size, objects, trials=("squeeze", "three times the push"), ablated=True, **options)
    search.contact_seeds = seeds.contact_seeds


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--objects", type=int, default=50)
    parser.add_argument("--sizes", default="5,8,12", help="largest extents in cm")
    parser.add_argument("--only", default="", help="rows whose names hold this word")
    parser.add_argument("--trials", default="squeeze,closing", help=", ".join(TRIALS))
    parser.add_argument(
        "--servo", type=float, help="stiffness of all servos in N m/rad, in place of the preset's"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the choice of objects")
    parser.add_argument("--ablations", action="store_true")
    parser.add_argument("--untried", action="store_true", help="no trial within the search")
    parser.add_argument("--verbose", action="store_true", help="a line for each object")
    given = parser.parse_args()
    warnings.simplefilter("ignore", gf.GraspWarning)
    # A long run that is cut short keeps what it printed into a file.
    sys.stdout.reconfigure(line_buffering=True)
    objects = numbers(given.objects, given.seed)
    for size in given.sizes.split(","):
        for name, (which, fingers) in ROWS.items():
            if given.only not in name:
                continue
            hand = preset(which) if given.servo is None else preset(which, stiffness=given.servo)
            print(f"{name}, objects of {size} cm")
            if given.ablations:
                ablations(hand, fingers, float(size) / 100, objects)
            else:
                run(
                    hand, fingers, float(size) / 100, objects, trials=given.trials.split(","),
                    verbose=given.verbose, simulate=not given.untried,
                )  # fmt: skip


if __name__ == "__main__":
    main()
