"""Seeded grasps for property tests."""

import numpy as np


def random_grasp(seed, dim, count, edges):
    """Contacts spread over an ellipsoid, normals near its own."""
    rng = np.random.default_rng(seed)
    outward = rng.normal(size=(count, dim))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    arguments = {
        "positions": outward * rng.uniform(0.5, 1.5, dim),
        "normals": -outward + 0.2 * rng.normal(size=(count, dim)),
        "friction": rng.uniform(0.1, 1.0, count),
        "max_normal_force": rng.uniform(0.5, 20.0, count),
        "edges": edges,
    }
    if dim == 3:
        arguments["tangents"] = rng.normal(size=(count, dim))
    return arguments
