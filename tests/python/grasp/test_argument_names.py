"""Arguments of a wrong type or range are refused by name, with the value and what would do."""

import pickle
import re

import numpy as np
import pytest

import graspforce as gf
from graspforce._core import CandidateSearch

DISC = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, max_normal_force=4)
BALL = {"positions": np.eye(3), "normals": -np.eye(3)}
DISTRIBUTOR = gf.ForceDistributor(DISC)
DOWN = [0, -1, 0]

REFUSED = {
    "criterion: None is neither 'max' nor 'sum'": lambda: DISC.quality(None),
    "criterion: 3 is neither 'max' nor 'sum'": lambda: DISC.resistance(DOWN, 3),
    "criterion: 'mean' is neither 'max' nor 'sum'": lambda: gf.quality_many(
        [DISC.positions], [DISC.normals], criterion="mean"
    ),
    "rtol: 'x' is not a real number": lambda: DISC.quality(rtol="x"),
    "rtol: True is not a real number": lambda: DISC.quality(rtol=True),
    "max_facets: -1 is not a whole number from 100 to 100000000": lambda: DISC.quality(max_facets=-1),
    "max_facets: 200.5 is not a whole number from": lambda: DISC.quality(max_facets=200.5),
    "max_points: -1 is not a whole number from 0": lambda: DISC.minkowski_sum(-1),
    "max_points: None is not a whole number from 0": lambda: DISC.minkowski_sum(None),
    "external_wrench: [1e200, 0.0, 0.0] is longer than 1e140": lambda: DISC.quality(
        external_wrench=[1e200, 0, 0]
    ),
    "directions, row 0: [NaN, 0.0, 0.0] is not finite": lambda: DISC.resistance([np.nan, 0, 0]),
    "directions, row 1: [0.0, 0.0, 0.0] has no direction": lambda: DISC.resistance([DOWN, [0, 0, 0]]),
    "grasp: None is not a Grasp": lambda: gf.ForceDistributor(None),
    "grasp: 5 is not a Grasp": lambda: DISTRIBUTOR.update(5),
    "objective: None is none of 'max', 'sum' and 'squares'": lambda: gf.ForceDistributor(DISC, None),
    "method: 'fast' is none of 'implicit', 'enumerated' and 'reduced'": lambda: gf.ForceDistributor(
        DISC, method="fast"
    ),
    "weight: None is not a real number": lambda: gf.ForceDistributor(DISC, weight=None),
    "rtol: [1] is not a real number": lambda: gf.ForceDistributor(DISC, rtol=[1]),
    "rtol: 0.5 must lie above 0 and be at most 0.001": lambda: gf.ForceDistributor(DISC, rtol=0.5),
    "rtol: 0 must lie above 0 and be at most 0.001": lambda: gf.ForceDistributor(DISC, rtol=0),
    "parallel: 'yes' is neither True nor False": lambda: DISTRIBUTOR.solve_many([DOWN], "yes"),
    "external_wrenches: 5 is not iterable": lambda: DISTRIBUTOR.solve_iter(5),
    "external_wrenches, row 1: shape (2,), expected (3,)": lambda: list(
        DISTRIBUTOR.solve_iter([DOWN, [0, 1]])
    ),
    "forces: dtype float32 and shape (2, 2), expected a float64 array of shape (2, 2)": lambda: (
        DISTRIBUTOR.solve_into(DOWN, np.empty((2, 2), dtype=np.float32))
    ),
    "forces: dtype float64 and shape (4,), expected a float64 array": lambda: DISTRIBUTOR.solve_into(
        DOWN, np.empty(4)
    ),
    "forces: None, expected a float64 array of shape (2, 2)": lambda: DISTRIBUTOR.solve_into(DOWN, None),
    "edges: None is not a whole number from 3 to 256": lambda: gf.torque_limited_forces(
        [[0.1], [0], [0]], [0.5], edges=None
    ),
    "friction: 'rough' is not a real number": lambda: gf.torque_limited_forces(
        [[0.1], [0], [0]], [0.5], friction="rough"
    ),
    "prune: 'a' is neither True nor False": lambda: CandidateSearch(2, prune="a"),
    "dim: 5 is not a whole number from 2 to 3": lambda: CandidateSearch(5),
    "progress: 5 is not callable": lambda: gf.quality_many([DISC.positions], [DISC.normals], progress=5),
    "min_normal, contact 1: 1.5 is a share": lambda: gf.ForceDistributor(DISC, min_normal=[0, 1.5]),
    f"edges, contact 0: {10**30} is not a whole number from 3 to 65536": lambda: gf.Grasp(
        **BALL, edges=10**30
    ),
    "edges, contact 2: 2.5 is not a whole number from 3 to 65536": lambda: gf.Grasp(
        **BALL, edges=[3, 4, 2.5]
    ),
    "edges: '8' is no whole number": lambda: gf.Grasp(**BALL, edges="8"),
    "edges: 8.0 is no whole number": lambda: gf.Grasp(**BALL, edges=8.0),
    "friction_margin: None is not a real number": lambda: gf.Grasp(**BALL, friction_margin=None),
    f"friction_margin: {'1' + 59 * '0'}... is beyond": lambda: gf.Grasp(**BALL, friction_margin=10**400),
    "positions, contact 1: shape (3,), but contact 0 has (2,)": lambda: gf.Grasp(
        [(0, 1), (1, 0, 0)], [(1, 0), (-1, 0)]
    ),
    "normals, contact 1: shape (), but contact 0 has (2,)": lambda: gf.Grasp([(0, 1), (1, 0)], [(1, 0), 5]),
    "positions, row 1, contact 1: shape (1,), but contact 0 has (2,)": lambda: gf.quality_many(
        [[(0, 1), (1, 0)], [(0, 1), (1,)]], [[(1, 0), (-1, 0)]] * 2
    ),
    "external_wrenches, row 1: shape (2,), but row 0 has (3,)": lambda: DISTRIBUTOR.solve_many(
        [DOWN, [1, 2]]
    ),
}


@pytest.mark.parametrize(("message", "call"), REFUSED.items(), ids=range(len(REFUSED)))
def test_a_wrong_argument_is_refused_by_name_value_and_remedy(message, call):
    with pytest.raises((gf.InvalidGraspError, gf.InvalidInputError), match=f"^{re.escape(message)}"):
        call()


def test_numbers_of_other_kinds_are_numbers():
    for rtol in (np.float32(1e-3), np.array(1e-3), np.float64(1e-3)):
        assert DISC.quality(rtol=rtol).rtol == float(rtol)
    assert DISC.quality(max_facets=np.int64(500)).max_facets == 500
    assert DISC.minkowski_sum(10**30).wrenches.shape == (8, 3)
    assert DISTRIBUTOR.solve_many([DOWN], parallel=np.True_).status.tolist() == [0]


def test_an_iterator_says_which_wrench_also_after_a_copy():
    slippery = gf.ForceDistributor(DISC.replace(friction=0))
    steps = slippery.solve_iter([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [1, 0, 0]])
    next(steps)
    steps = pickle.loads(pickle.dumps(steps))
    next(steps)
    with pytest.raises(gf.InfeasibleWrenchError, match=r"^external_wrenches, row 2: no contact") as raised:
        next(steps)
    assert raised.value.direction.shape == (3,)
    assert next(steps).balanced


class Interrupting:
    """A number that Ctrl-C interrupts."""

    def __float__(self):
        raise KeyboardInterrupt


def test_ctrl_c_in_a_conversion_stays_ctrl_c():
    with pytest.raises(KeyboardInterrupt):
        DISC.quality(rtol=Interrupting())
