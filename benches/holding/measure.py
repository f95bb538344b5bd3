"""What is said of a grasp beforehand, and what it holds in simulation."""

import numpy as np

from graspforce import surrogates
from graspforce.hands import largest_pushes
from graspforce.hands.grasp_problem import PUSHES

CONTROLS = {
    "squeeze": {"control": "squeeze"},
    "distributed": {"control": "servo"},
    "distributed, push known": {"control": "servo", "known_pushes": True},
}
MOST, HALVINGS = 32.0, 6  # N, so that a push is known to 0.5 N
SECONDS = 0.5  # a push of 1 N moves a free object by 1.25 m in this time


def torque_limited(plan):
    """Return the grasp of soft fingers whose forces the torque limits bound.

    The extreme forces are those of hard fingers and those with torsion, each as long as the torques allow.
    The load of torsion itself on the joints is left out.
    """
    hard, hand, limits = plan.torque_limited(), plan.hand, plan.hand.torque_limits[plan.hand.driven]
    fingers = zip(
        plan.grasp.frames,
        plan.jacobians @ hand.coupling,
        by_contact(plan.grasp),
        by_contact(hard),
        strict=True,
    )
    forces = []
    for axes, J, soft, without in fingers:
        share = (np.abs(soft[:, :3] @ axes @ J) / limits).max(axis=1, keepdims=True)
        forces.append(np.vstack([soft / share, np.pad(without, ((0, 0), (0, 1)))]))
    return plan.grasp.replace(extreme_forces=forces, max_normal_force=1000.0)


def by_contact(grasp):
    """Return the extreme forces of each contact."""
    return np.split(grasp.extreme_forces, np.cumsum(grasp.num_edges)[:-1])


def numbers(plan):
    """Return every number that could predict what is held; larger is better."""
    grasp, limited = plan.grasp, torque_limited(plan)
    # Hard fingers keep the hull small enough for Qhull.
    hard = grasp.replace(torsion=None)
    found = {}
    for criterion in ("sum", "max"):
        found[f"rho_{criterion}"] = grasp.quality(criterion).epsilon
        found[f"rho_{criterion}, torque limits"] = limited.quality(criterion).epsilon
    pushes = resistances(plan)
    found |= {name: float(np.min(values)) for name, values in pushes.items()}
    contacts = {
        "friction": 0.6, "torsion": 0.02, "edges": 8, "origin": grasp.origin,
        "length_scale": grasp.length_scale, "max_normal_force": 1.0,
    }  # fmt: skip
    one = grasp.positions[None], grasp.normals[None]
    found["min-weight"] = float(surrogates.min_weight(*one, **contacts).values[0])
    residual = surrogates.differentiable_force_closure(*one, **contacts).values[0]
    found["differentiable force closure"] = -float(residual)
    measures = hard.measures()
    found["hull volume"] = measures.hull_volume
    found["isotropy"] = measures.isotropy
    return found


def resistances(plan):
    """Return what is said of each of the six pushes, in N."""
    limited = torque_limited(plan)
    found = {"slip onset": plan.slip_onset(PUSHES)}
    for criterion in ("sum", "max"):
        found[f"least resistance, {criterion}"] = plan.grasp.resistance(PUSHES, criterion)
        found[f"least resistance, {criterion}, torque limits"] = limited.resistance(PUSHES, criterion)
    return {name: np.asarray(values).tolist() for name, values in found.items()}


def held(plan, mesh):
    """Return for each control the largest pushes in N that are held."""
    pushes = {
        name: largest_pushes(plan, mesh, most=MOST, halvings=HALVINGS, seconds=SECONDS, **options)
        for name, options in CONTROLS.items()
    }
    return {name: values.tolist() for name, values in pushes.items()}
