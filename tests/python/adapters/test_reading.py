"""What is computed from a simulator's forces, beside the same numbers of a force distribution."""

import numpy as np
import pytest

import graspforce as gf
from graspforce.adapters import ContactReading

POSITIONS = [(0.04, 0, 0), (-0.02, 0.035, 0), (-0.02, -0.035, 0.01)]
NORMALS = [(-1, 0, 0), (0.5, -0.866, 0), (0.5, 0.866, 0.1)]
WRENCH = [0.1, 0, -0.3, 0, 0.001, 0.002]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"torsion": [0.01, 0, 0.02]},
        {"friction_margin": 1.3},
        {"friction": [0.6, 0.5, 0.7], "edges": None},
    ],
)
def test_the_slip_margin_is_that_of_the_same_forces_in_a_solution(options):
    grasp = gf.Grasp(POSITIONS, NORMALS, **options)
    solution = gf.ForceDistributor(grasp).solve(WRENCH)
    reading = ContactReading(grasp, solution.forces, (0, 1, 2))
    np.testing.assert_allclose(reading.slip_margin, solution.slip_margin, atol=1e-12)
    assert not reading.slip_margin.flags.writeable


def test_the_slip_margin_is_signed_and_defined_for_contacts_without_force_or_friction():
    across = [(-1, 0), (1, 0), (0, 1), (0, -1)]
    grasp = gf.Grasp(across, -np.array(across), friction=[0.5, 0.5, 0.5, 0.0])
    forces = np.array([[1.0, 0.25], [1.0, -1.0], [0.0, 0.0], [1.0, 0.0]])
    assert ContactReading(grasp, forces, (0, 1, 2, 3)).slip_margin.tolist() == [0.5, -1.0, 1.0, 0.0]
