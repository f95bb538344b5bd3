"""Calls every function of the extension module: small enough for a memory checker (see docs/trust.md)."""

import copy
import pickle

import numpy as np

import graspforce as gf
from graspforce._core import BoxBound, CandidateSearch, TriangleTree

CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=float)
DOWN = np.array([0.0, 0.1, -1.0, 0.0, 0.05, 0.0])


def refused(call, *arguments, **options):
    try:
        call(*arguments, **options)
    except gf.GraspForceError:
        return
    raise AssertionError("was not refused")


def examine(grasp):
    _ = grasp.positions, grasp.normals, grasp.frames, grasp.grasp_matrix, grasp.friction, grasp.origin
    _ = grasp.is_force_closure, repr(grasp), grasp._singular_values(), grasp.num_edges, grasp.max_normal_force
    for criterion in ("max", "sum"):
        quality = grasp.quality(criterion, rtol=1e-2, external_wrench=0.01 * DOWN)
        _ = quality.gradient.positions, quality.gradient.normals, quality.gradient.spins
        assert pickle.loads(pickle.dumps(quality)).rho == quality.rho
    grasp.resistance([DOWN, -DOWN])
    assert copy.copy(grasp).num_contacts == grasp.num_contacts


def distribute(grasp, **options):
    distributor = gf.ForceDistributor(grasp, rtol=1e-6, **options)
    forces = np.empty((grasp.num_contacts, grasp.force_dim))
    for k in range(5):
        wrench = DOWN + 0.1 * np.sin(np.arange(6) + k)
        solution = distributor.solve(wrench)
        _ = solution.forces, solution.world_forces, solution.contact_wrenches, solution.slip_margin
        distributor.solve_into(wrench, forces)
    distributor.solve_many(np.tile(DOWN, (600, 1)), parallel=True)
    distributor.solve_many(np.tile(DOWN, (6, 1)))
    distributor.solve_many(np.tile(DOWN, (6, 1)), infeasible="nearest")
    jacobians = [np.ones((6, 3))] * grasp.num_contacts
    _ = distributor.nearest(100 * DOWN).joint_torques(jacobians, np.ones((3, 1)), "contact")
    distributor.nearest_into(100 * DOWN, forces, np.eye(6), limits=False)
    distributor.set_limits(np.ones(grasp.num_contacts))
    distributor.solve(DOWN)
    distributor.update(grasp)
    assert len(list(distributor.solve_iter([DOWN, DOWN]))) == 2
    assert copy.copy(pickle.loads(pickle.dumps(distributor))).solve(DOWN).sigma_max > 0
    refused(distributor.solve, [np.nan] * 6)
    refused(distributor.solve_into, DOWN, forces[:2])


def main():
    hard = gf.Grasp(CORNERS, -CORNERS, friction=0.7, edges=4)
    for grasp in (
        hard,
        gf.Grasp(CORNERS, -CORNERS, friction=0.7, edges=None, torsion=0.1),
        gf.Grasp(CORNERS.tolist(), -CORNERS.astype("f4"), 0.7, extreme_forces=[hard.extreme_forces[:4]] * 4),
    ):
        examine(grasp)
        distribute(grasp)
    distribute(hard, method="enumerated")
    distribute(hard, objective="squares", reference=np.ones((4, 3)), weights=2.0, slack=1.0, limits=True)
    distribute(hard, method="reduced", samples=[DOWN])
    distribute(hard, objective="sum", min_normal=0.1)
    listed = hard.minkowski_sum()
    assert np.asarray(listed).shape == pickle.loads(pickle.dumps(listed)).wrenches.shape
    refused(hard.minkowski_sum, max_points=3)
    refused(gf.Grasp, CORNERS, 0 * CORNERS)
    batch = gf.quality_many([CORNERS] * 3, [-CORNERS, 0 * CORNERS, -CORNERS], progress=print)
    _ = batch.rho, batch.errors, pickle.loads(pickle.dumps(batch))
    flat = np.tile(CORNERS, (2, 1))
    batch = gf.quality_many(flat, -flat, offsets=[0, 4, 8, 8], gradient=True)
    _ = batch.gradient.positions, pickle.loads(pickle.dumps(batch))
    gf.forces_many([CORNERS] * 2, [-CORNERS, 0 * CORNERS], [DOWN], infeasible="nearest", gradient=True)
    gf.surrogates.min_weight([CORNERS] * 2, [-CORNERS, 0 * CORNERS])
    gf.surrogates.differentiable_force_closure([CORNERS], [-CORNERS])
    gf.surrogates.span_residual([CORNERS], [-CORNERS], limit=5.0)
    CandidateSearch(3).best([CORNERS, 0.9 * CORNERS], [-CORNERS] * 2)
    BoxBound(3).over([0.1], [CORNERS, 0.9 * CORNERS], [-CORNERS] * 2)
    TriangleTree(CORNERS, [(0, 1, 2), (0, 2, 3)]).closest(CORNERS * 2)
    gf.torque_limited_forces([[0.1, 0], [0, 0.1], [0, 0]], [0.5, 0.5], edges=4)


if __name__ == "__main__":
    main()
