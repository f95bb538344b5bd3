"""Symmetric grasps: pinches and rings whose brackets close, beside independent answers."""

from __future__ import annotations

import copy
import pickle
import time

import numpy as np
import pytest
from benches.trust import symmetric_cones
from benches.trust.symmetric_cones import Pinch

import graspforce as gf


def test_brackets_of_the_families_are_narrow_and_hold_the_oracle() -> None:
    for row in symmetric_cones.rows(0.03):
        assert row.missed == 0, row
        assert row.wrong == 0, row


def test_the_pinch_of_torsion_20_mm_has_its_known_quality() -> None:
    known = Pinch(0.04, 0.5, 0.02, 1.0).epsilon("max")
    assert 40 * known == pytest.approx(1.597446, abs=1e-6)
    grasp = gf.Grasp(
        [(0.04, 0, 0), (-0.04, 0, 0)],
        [(-1, 0, 0), (1, 0, 0)],
        friction=0.5,
        torsion=0.02,
        max_normal_force=40,
        edges=None,
    )
    q = grasp.quality("max")
    assert -q.upper <= 1.597446 + 1e-6
    assert -q.lower >= 1.597446 - 1e-6
    assert q.upper - q.lower < 1e-3 * 1.597446


def test_fifty_symmetric_grasps_take_below_five_seconds() -> None:
    widths = np.linspace(0.01, 0.1, 50)
    x = np.stack([widths, -widths], axis=1)
    positions = np.stack([x, 0 * x, 0 * x], axis=-1)
    normals = -np.sign(positions)
    start = time.process_time()
    batch = gf.quality_many(positions, normals, friction=0.5, torsion=0.02, edges=None)
    # Seconds of all cores together, which other processes do not change: on two cores half as many pass.
    assert time.process_time() - start < 10.0
    assert (batch.upper - batch.lower < 1e-3 * batch.epsilon).all()


def test_the_work_can_be_bounded_and_bought() -> None:
    grasp = Pinch(0.04, 0.5, 0.02, 1.0).grasp()
    few, many = (grasp.quality("max", max_facets=facets) for facets in (500, 100_000))
    assert not few.converged
    assert many.upper - many.lower < 0.5 * (few.upper - few.lower)
    batch = gf.quality_many(
        grasp.positions[None], grasp.normals[None], torsion=0.02, edges=None, max_facets=500
    )
    assert (batch.lower[0], batch.upper[0]) == (few.lower, few.upper)
    for facets in (0, 10**12):
        with pytest.raises(gf.InvalidInputError, match="max_facets"):
            grasp.quality("max", max_facets=facets)
        with pytest.raises(gf.InvalidInputError, match="max_facets"):
            gf.quality_many(grasp.positions[None], grasp.normals[None], max_facets=facets)
    again = pickle.loads(pickle.dumps(few))
    assert (again.lower, again.upper) == (few.lower, few.upper)
    assert copy.copy(few).hint == few.hint


def test_a_length_scale_of_ten_extents_is_hinted_at() -> None:
    pinch = Pinch(0.04, 0.5, 0.02, 1.0).grasp()
    hint = pinch.quality("sum").hint
    assert hint is not None
    assert "length scale" in hint
    assert hint in repr(pinch.quality("sum"))
    assert pinch.quality("sum").to_dict()["hint"] == hint
    assert pinch.quality("sum", metric=np.eye(6)).hint is None
    assert Pinch(0.04, 0.5, 0.02, 0.79).grasp().quality("sum").hint is None
    assert Pinch(0.04, 0.5, 0.02, 0.81).grasp().quality("sum").hint is not None
