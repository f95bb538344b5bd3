"""What is resisted on top of an external wrench, beside linear programs of HiGHS."""

import numpy as np
import pytest
from scipy.optimize import linprog

import graspforce as gf


def by_highs(grasp, directions, criterion, constant):
    """Largest s for which shares of the extreme forces within the limits balance constant + s direction."""
    wrenches = grasp.primitive_wrenches
    owner = np.repeat(np.arange(grasp.num_contacts), grasp.num_edges)
    if criterion == "sum":
        limits = np.ones((1, len(wrenches)))
    else:
        limits = (owner == np.arange(grasp.num_contacts)[:, None]).astype(float)
    found = []
    for direction in directions:
        most = linprog(
            np.append(np.zeros(len(wrenches)), -1.0),
            A_ub=np.column_stack([limits, np.zeros(len(limits))]),
            b_ub=np.ones(len(limits)),
            A_eq=np.column_stack([wrenches.T, direction]),
            b_eq=-constant,
            bounds=[(0, None)] * (len(wrenches) + 1),
        )
        found.append(most.x[-1] if most.status == 0 else None)
    return found


@pytest.mark.parametrize("criterion", ["max", "sum"])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_multiple_is_that_of_a_linear_program(criterion, dim):
    compared = 0
    for seed in range(25):
        random = np.random.default_rng(seed)
        normals = random.normal(size=(dim + 1 + seed % 3, dim))
        grasp = gf.Grasp(-normals / np.linalg.norm(normals, axis=1)[:, None], normals, friction=0.6, edges=6)
        wrench_dim = grasp.wrench_dim
        directions = random.normal(size=(4, wrench_dim))
        constant = random.normal(size=wrench_dim)
        alone = grasp.resistance(constant, criterion)
        constant *= 0.5 * float(alone)
        if not constant.any():
            continue
        found = grasp.resistance(directions, criterion, external_wrench=constant)
        for one, other in zip(found, by_highs(grasp, directions, criterion, constant), strict=True):
            assert one == pytest.approx(other, rel=1e-6, abs=1e-7)
            compared += 1
        # The same wrench again is the rest of what it could be.
        assert grasp.resistance(constant, criterion, constant) == pytest.approx(1.0, rel=1e-9)
    assert compared > 40


def pinch(**options):
    return gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)], friction=0.5, **options)


def test_a_wrench_of_zero_is_none_and_true_cones_agree_with_the_geometry():
    directions = [[0, -1, 0], [1, 0, 0]]
    assert (
        pinch().resistance(directions, "max", [0, 0, 0]).tolist() == pinch().resistance(directions).tolist()
    )
    ring = [(0.05 * np.cos(a), 0.05 * np.sin(a), 0) for a in (0, 2.1, 4.2)]
    ball = gf.Grasp(ring, -np.array(ring), friction=0.5, edges=None, length_scale=0.05)
    down = np.array([0, 0, -1.0, 0, 0, 0])
    most = float(ball.resistance(down))
    for share in (0.1, 0.5, 0.9):
        left = float(ball.resistance(down, external_wrench=share * most * down))
        assert left == pytest.approx((1 - share) * most, rel=1e-6)


def test_unusable_external_wrenches_are_refused_by_name():
    with pytest.raises(gf.InvalidInputError, match=r"external_wrench: .* times the limits"):
        pinch().resistance([0, -1, 0], external_wrench=[0, -3, 0])
    with pytest.raises(gf.InvalidInputError, match=r"external_wrench: shape \(2,\), expected \(3,\)"):
        pinch().resistance([0, -1, 0], external_wrench=[0, -3])
    with pytest.raises(gf.InvalidInputError, match="external_wrench"):
        pinch().resistance([0, -1, 0], external_wrench=[0, np.nan, 0])
    flat = gf.Grasp([(1, 0, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)])
    with pytest.raises(gf.InfeasibleWrenchError):
        flat.resistance([0, 1, 0, 0, 0, 0], external_wrench=[0, 0, 0, 1, 0, 0])
    assert flat.resistance([0, 0, 0, 1, 0, 0], external_wrench=[0, 0.1, 0, 0, 0, 0]) == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda g: g.resistance(np.ones((2, 5))), r"directions: shape \(2, 5\), expected \(B, 3\) or \(3,\)"),
        (lambda g: g.quality(metric=np.eye(2)), r"metric: shape \(2, 2\), expected \(3, 3\)"),
        (lambda g: g.quality(external_wrench=[1]), r"external_wrench: shape \(1,\), expected \(3,\)"),
        (lambda g: gf.ForceDistributor(g).solve([1]), r"external_wrench: shape \(1,\), expected \(3,\)"),
        (lambda g: gf.ForceDistributor(g).solve_many([1]), r"shape \(1,\), expected \(T, 3\)"),
        (
            lambda g: gf.ForceDistributor(g, min_normal=np.ones((3, 2))),
            r"min_normal: shape \(3, 2\), expected a number or \(2,\)",
        ),
        (
            lambda g: gf.Grasp(g.positions, g.normals, friction=np.ones(3)),
            r"friction: shape \(3,\), expected a number or \(2,\)",
        ),
        (lambda g: gf.Grasp(g.positions, [1]), r"normals: shape \(1,\), expected \(2, 2\)"),
        (
            lambda _: gf.torque_limited_forces(np.ones((2, 2)), [1, 1]),
            r"jacobian: shape \(2, 2\), expected \(3, q\)",
        ),
    ],
)
def test_shapes_are_written_as_numpy_writes_them(call, message):
    with pytest.raises(gf.GraspForceError, match=message):
        call(pinch())
