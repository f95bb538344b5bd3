"""Algorithm 1 as Python sees it: the points, their index matrices, and Q."""

import itertools

import numpy as np
import pytest
from support.oracles import grasp_arguments

import graspforce as gf


def ragged_grasp():
    angles = np.array([0.2, 2.1, 4.4])
    outward = np.stack([np.cos(angles), np.sin(angles), 0.1 * angles], axis=1)
    return gf.Grasp(outward, -outward, friction=[0.5, 0.0, 0.3], edges=[4, 8, 3])


def test_points_are_the_sums_of_their_entries_exactly(spatial_case):
    grasp = gf.Grasp(**grasp_arguments(spatial_case))
    if np.prod(grasp.num_edges + 1.0) > 20_000:
        pytest.skip("the sum has more than 20,000 points")
    ms = grasp.minkowski_sum()
    edges, m = int(grasp.num_edges[0]), grasp.num_contacts
    assert len(ms) == (edges + 1) ** m - 1
    assert len(ms.contacts) == len(ms.edges) == m * edges * (edges + 1) ** (m - 1)
    assert np.array_equal(ms.to_scipy().T @ grasp.primitive_wrenches, ms.wrenches)


def test_points_come_in_the_order_of_algorithm_1():
    grasp = ragged_grasp()
    ms = grasp.minkowski_sum()
    first = np.concatenate([[0], np.cumsum(grasp.num_edges)])
    points: list[list[int]] = []
    for i in range(grasp.num_contacts):
        edges = range(first[i], first[i + 1])
        points += [[*old, edge] for edge in edges for old in points] + [[edge] for edge in edges]
    assert len(ms) == len(points) == np.prod(grasp.num_edges + 1) - 1
    for j, point in enumerate(points):
        entries = slice(ms.starts[j], ms.ends[j])
        assert (first[ms.contacts[entries]] + ms.edges[entries]).tolist() == point
        np.testing.assert_array_equal(ms.wrenches[j], sum(grasp.primitive_wrenches[point]))


def test_every_choice_of_edges_occurs_once():
    grasp = ragged_grasp()
    ms = grasp.minkowski_sum()
    made = {
        tuple(zip(ms.contacts[a:b], ms.edges[a:b], strict=True))
        for a, b in zip(ms.starts, ms.ends, strict=True)
    }
    choices = itertools.product(*[[None, *range(count)] for count in grasp.num_edges])
    expected = {tuple((i, h) for i, h in enumerate(choice) if h is not None) for choice in choices} - {()}
    assert made == expected


def test_index_matrices_take_four_bytes_an_index_and_belong_together():
    ms = ragged_grasp().minkowski_sum()
    for array in (ms.starts, ms.ends, ms.contacts, ms.edges):
        assert array.dtype == np.int32
        assert not array.flags.writeable


def test_an_enumeration_too_large_says_how_large_and_takes_no_memory():
    angles = np.linspace(0, 6, 8)
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    with pytest.raises(gf.TooLargeError, match=str(17**8 - 1)) as caught:
        gf.Grasp(outward, -outward, edges=16).minkowski_sum()
    assert "bytes" in str(caught.value)
    grasp = ragged_grasp()
    with pytest.raises(gf.TooLargeError, match="39"):
        grasp.minkowski_sum(max_points=38)
    assert len(grasp.minkowski_sum(max_points=39)) == 39


def test_a_true_cone_has_no_minkowski_points():
    cones = gf.Grasp([(1, 0, 0), (-1, 0, 0)], [(-1, 0, 0), (1, 0, 0)], edges=None)
    for finite in (cones.minkowski_sum, lambda: cones.primitive_wrenches, lambda: cones.extreme_forces):
        with pytest.raises(gf.InvalidGraspError, match="edges, contact 0"):
            finite()
