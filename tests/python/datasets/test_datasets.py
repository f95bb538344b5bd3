"""Datasets in memory: every row is the grasp it says, and a bad row costs itself alone."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.random_datasets import NUMBERS, VECTORS, as_table, grasp_rows

import graspforce as gf

GRADES = [
    "status",
    "message",
    "closure",
    *(f"rho_{criterion}{end}" for criterion in ("max", "sum") for end in ("", "_lower", "_upper")),
]
LISTS = pa.list_(pa.list_(pa.float64()))


def one_by_one(row, criterion, **options):
    arguments = {name: value for name, value in row.items() if name != "id"}
    return gf.Grasp(**arguments, **options).quality(criterion)


def assert_is_graded(graded, rows, **options):
    """Check every grade of a table against grasps that are made one at a time."""
    for found, row in zip(graded.to_pylist(), rows, strict=True):
        for criterion in ("max", "sum"):
            expected = one_by_one(row, criterion, **options)
            name = f"rho_{criterion}"
            numbers = (found[name], found[f"{name}_lower"], found[f"{name}_upper"])
            assert numbers == (expected.rho, expected.lower, expected.upper)
            assert found["closure"] == expected.closure
        assert found["status"] == "converged"
        assert found["message"] is None


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("edges", [4, 8])
def test_every_grade_is_that_of_the_grasp_alone(dim, edges):
    rows = grasp_rows(40, dim)
    graded = gf.grade(as_table(rows), edges=edges)
    assert graded.column_names == [*rows[0], *GRADES]
    assert_is_graded(graded, rows, edges=edges)


def test_true_cones_are_graded_to_their_own_tolerance():
    rows = grasp_rows(10, seed=3)
    assert_is_graded(gf.grade(as_table(rows), edges=None), rows, edges=None)


def test_optional_columns_are_arguments_of_the_grasp():
    rng = np.random.default_rng(5)
    rows = grasp_rows(30, seed=5)
    for row in rows:
        count = len(row["positions"])
        row["tangents"] = rng.normal(size=(count, 3)).tolist()
        row["torsion"] = rng.uniform(0, 0.01, count).tolist()
        row["origin"] = rng.normal(size=3).tolist()
        row["length_scale"] = float(rng.uniform(0.1, 2))
    types = {"tangents": VECTORS, "torsion": NUMBERS, "origin": NUMBERS, "length_scale": pa.float64()}
    assert_is_graded(gf.grade(as_table(rows, **types)), rows)


@pytest.mark.parametrize(
    "vectors",
    [
        LISTS,
        pa.large_list(pa.large_list(pa.float64())),
        pa.list_(pa.list_(pa.float32(), 3)),
        pa.large_list(pa.list_(pa.float64(), 3)),
    ],
    ids=str,
)
def test_every_layout_of_lists_is_read(vectors):
    rows = grasp_rows(25, seed=7)
    table = as_table(rows, positions=vectors, normals=vectors, friction=pa.large_list(pa.float32()))
    assert_is_graded(gf.grade(table), table.to_pylist())


def test_grasps_of_one_number_of_contacts_may_be_arrays_of_fixed_shape():
    rows = [row for row in grasp_rows(40, seed=8) if len(row["positions"]) == 4]
    vectors = pa.list_(pa.list_(pa.float64(), 3), 4)
    table = as_table(rows, positions=vectors, normals=vectors, friction=pa.list_(pa.float64(), 4))
    assert_is_graded(gf.grade(table.slice(2, 5)), rows[2:7])


def test_one_number_stands_for_all_contacts():
    rows = [{**row, "friction": 1, "max_normal_force": 2.5} for row in grasp_rows(12)]
    table = as_table(rows, friction=pa.int16(), max_normal_force=pa.float64())
    assert_is_graded(gf.grade(table), rows)


def test_planar_and_spatial_grasps_may_stand_in_one_table():
    rows = [*grasp_rows(5, 2), *grasp_rows(5, 3)]
    assert_is_graded(gf.grade(as_table(rows, positions=LISTS, normals=LISTS)), rows)


@settings(max_examples=25)
@given(st.lists(st.integers(0, 60), max_size=4), st.integers(1, 60))
def test_a_grade_does_not_depend_on_what_stands_beside_it(cuts, chunk):
    table = as_table(grasp_rows(60, 2, seed=2))
    whole = gf.grade(table)
    bounds = sorted({0, *cuts, 60})
    pieces = [gf.grade(table.slice(a, b - a)) for a, b in pairwise(bounds)]
    assert pa.concat_tables(pieces).equals(whole)
    chunked = pa.Table.from_batches(table.to_batches(max_chunksize=chunk))
    assert gf.grade(chunked).equals(whole)


GOOD = {
    "id": "good",
    "positions": [[-1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]],
    "normals": [[1.0, 0, 0], [-1.0, 0, 0], [0, -1.0, 0]],
    "friction": [0.5, 0.5, 0.5],
    "max_normal_force": [1.0, 2.0, 3.0],
}
BAD = [
    ({"positions": None}, "positions: null"),
    ({"positions": []}, "positions: a grasp needs at least one contact"),
    ({"positions": [[0, 0, 0], None, [0, 0, 1]]}, "positions, contact 1: null"),
    ({"positions": [[0, 0, 0], [0, None, 0], [0, 0, 1]]}, "positions, contact 1: a coordinate is null"),
    ({"positions": [[0, 0, 0, 0]] * 3}, "positions, contact 0: 4 coordinates, expected 2 or 3"),
    ({"positions": [[0, 0, 0], [0, 0, 0], [0, 0]]}, "positions, contact 2: 2 coordinates, contact 0 has 3"),
    ({"positions": [[0, 0, 0], [0, math.nan, 0], [0, 0, 1]]}, "positions, contact 1: [0.0, NaN, 0.0]"),
    ({"positions": [[0, 0, 0], [0, math.inf, 0], [0, 0, 1]]}, "positions, contact 1: [0.0, inf, 0.0]"),
    ({"positions": [[0, 0, 0], [0, 1e200, 0], [0, 0, 1]]}, "positions, contact 1: its wrenches reach"),
    ({"normals": None}, "normals: null"),
    ({"normals": []}, "normals: 0 contacts, positions has 3"),
    ({"normals": [[1, 0, 0]] * 2}, "normals: 2 contacts, positions has 3"),
    ({"normals": [[1, 0]] * 3}, "normals: 2 coordinates, positions has 3"),
    ({"normals": [[1, 0, 0], [1, 0, 0], [0, 0, 0]]}, "normals, contact 2: the normal [0.0, 0.0, 0.0]"),
    ({"friction": None}, "friction: null"),
    ({"friction": [0.5, None, 0.5]}, "friction, contact 1: null"),
    ({"friction": [0.5] * 4}, "friction: 4 numbers for 3 contacts"),
    ({"friction": [0.5, 0.5, -0.25]}, "friction, contact 2: -0.25"),
    ({"friction": [0.5, math.nan, 0.5]}, "friction, contact 1: NaN"),
    ({"max_normal_force": [1.0, 0.0, 1.0]}, "max_normal_force, contact 1: 0"),
    ({"max_normal_force": [1.0, 1.0, -2.0]}, "max_normal_force, contact 2: -2"),
    ({"max_normal_force": [1.0]}, "max_normal_force: 1 numbers for 3 contacts"),
    ({"torsion": None}, "torsion: null"),
    ({"torsion": [0.0, -0.125, 0.0]}, "torsion, contact 1: -0.125"),
    ({"origin": None}, "origin: null"),
    ({"origin": [0, 0]}, "origin: 2 coordinates, positions has 3"),
    ({"origin": [0, None, 0]}, "origin: a coordinate is null"),
    ({"origin": [0, math.inf, 0]}, "origin: [0.0, inf, 0.0] is not finite"),
    ({"length_scale": None}, "length_scale: null"),
    ({"length_scale": -0.5}, "length_scale: -0.5 must be finite and positive"),
    ({"tangents": [[1, 0, 0]] * 3}, "tangents, contact 0: [1.0, 0.0, 0.0]"),
    (
        {"positions": [[0, 1], [1, 0]], "normals": [[0, -1], [-1, 0]], "friction": [1, 1]}
        | {"max_normal_force": [1, 1], "origin": [0, 0], "torsion": [0, 0], "tangents": [[1, 0], [1, 0]]},
        "tangents: a planar contact has only one tangent",
    ),
]


@pytest.mark.parametrize(("fault", "message"), BAD, ids=[message for _, message in BAD])
def test_a_bad_row_says_why_and_costs_itself_alone(fault, message):
    types = {"positions": LISTS, "normals": LISTS}
    full = dict(GOOD)
    for name, value, kind in (
        ("torsion", [0.0] * 3, NUMBERS),
        ("origin", [0.0] * 3, NUMBERS),
        ("length_scale", 1.0, pa.float64()),
        ("tangents", [[0.0, 0.0, 1.0]] * 3, LISTS),
    ):
        if name in fault:
            full[name], types[name] = value, kind
    graded = gf.grade(as_table([full, {**full, **fault, "id": "bad"}, full], **types)).to_pylist()
    assert [row["status"] for row in graded] == ["converged", "invalid", "converged"]
    assert graded[1]["message"].startswith(message)
    assert graded[1]["id"] == "bad"
    assert all(graded[1][name] is None for name in GRADES[2:])
    assert graded[0] == graded[2]
    assert graded[0]["rho_max"] == one_by_one(full, "max").rho


def test_the_first_fault_of_a_row_is_told_and_all_rows_may_be_bad():
    bad = {**GOOD, "positions": None, "normals": None, "friction": [-1.0] * 3}
    graded = gf.grade(as_table([bad] * 3, positions=VECTORS))
    assert graded["message"].to_pylist() == ["positions: null"] * 3


def test_columns_in_which_everything_is_null_are_columns_of_bad_rows():
    table = as_table([GOOD] * 2).set_column(1, "positions", pa.nulls(2))
    assert gf.grade(table)["message"].to_pylist() == ["positions: null"] * 2
    table = table.set_column(1, "positions", pa.array([[None], []]))
    assert gf.grade(table)["message"].to_pylist() == [
        "positions, contact 0: null",
        "positions: a grasp needs at least one contact",
    ]


def test_a_bracket_is_told_where_the_work_limit_leaves_it_wide():
    # Soft fingertips on a tetrahedron that is not quite regular have nearly a continuum of worst directions.
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    corners *= 0.05 * np.array([[1.01], [0.99], [1.005], [1.0]])
    hard = {"id": "hard", "positions": corners.tolist(), "normals": (-corners).tolist()}
    hard |= {"friction": [0.5] * 4, "max_normal_force": [1.0] * 4, "torsion": [0.02] * 4}
    (row,) = gf.grade(as_table([hard], torsion=NUMBERS), edges=None).to_pylist()
    assert row["status"] == "bracketed"
    told = []
    for rho in ("rho_max", "rho_sum"):
        assert row[f"{rho}_lower"] <= row[rho] <= row[f"{rho}_upper"]
        assert row[f"{rho}_lower"] < row[f"{rho}_upper"] < 0
        told.append(f"{row[f'{rho}_lower']:.9g} <= {rho} <= {row[f'{rho}_upper']:.9g}")
    assert row["message"] == f"bracket wider than asked for: {', '.join(told)}"


def test_grades_are_never_nan_without_a_status():
    graded = gf.grade(as_table([GOOD, {**GOOD, "friction": [-1.0] * 3}]))
    for name in GRADES[3:]:
        assert graded[name].null_count == 1
        assert not np.isnan(graded[name].drop_null().to_numpy()).any()


def test_no_rows_are_no_grades():
    graded = gf.grade(as_table([]))
    assert len(graded) == 0
    assert graded.schema == gf.grade(as_table([GOOD])).schema


def test_other_columns_are_passed_on_as_they_are():
    table = as_table([GOOD, {**GOOD, "positions": None}, GOOD])
    extra = {
        "text": pa.array(["a", None, "c"]),
        "dictionary": pa.array(["x", "y", None]).dictionary_encode(),
        "nested": pa.array([{"a": [1, None]}, None, {"a": []}]),
        "bytes": pa.array([b"\0", b"", None], pa.binary()),
    }
    for name, column in extra.items():
        table = table.append_column(name, column)
    table = table.replace_schema_metadata({"made by": "a robot"})
    graded = gf.grade(table)
    assert graded.select(table.column_names).equals(table, check_metadata=True)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop_columns(["friction"]), "column friction: not among the columns, which are id, pos"),
        (
            lambda t: t.set_column(3, "friction", pa.array(["a"])),
            f"column friction: {pa.string()}, expected a numb",
        ),
        (
            lambda t: t.set_column(1, "positions", pa.array([[1.0]])),
            f"column positions: {pa.list_(pa.float64())}, e",
        ),
        (lambda t: t.set_column(1, "positions", pa.array(["[[1, 2]]"])), "dataframe.convert-string"),
        (
            lambda t: t.append_column("origin", pa.array([0.0])),
            f"column origin: {pa.float64()}, expected a list of 2",
        ),
        (lambda t: t.append_column("rho_sum", pa.array([0.0])), "column rho_sum: grading adds a column"),
        (lambda t: t.append_column("friction", pa.array([0.0])), "column friction: there are 2 of them"),
    ],
)
def test_columns_that_cannot_be_graded_are_named_before_any_work(change, message):
    with pytest.raises(gf.InvalidInputError, match="column") as caught:
        gf.grade(change(as_table([GOOD])))
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"criteria": "mean"}, "mean"),
        ({"criteria": []}, "criteria"),
        ({"criteria": ("max", "max")}, "criteria"),
        ({"edges": 0}, "edges"),
        ({"rtol": 2.0}, "rtol"),
        ({"length_scale": 0.0}, "length_scale"),
        ({"out": "folder"}, "out"),
        ({"client": object()}, "client"),
    ],
)
def test_wrong_options_are_named(options, message):
    with pytest.raises(gf.GraspForceError, match=message):
        gf.grade(as_table([GOOD]), **options)


def test_a_length_scale_is_an_option_or_a_column_and_not_both():
    with_column = as_table([{**GOOD, "length_scale": 0.5}], length_scale=pa.float64())
    graded = gf.grade(as_table([GOOD]), length_scale=0.5)
    assert graded["rho_max"] == gf.grade(with_column)["rho_max"]
    with pytest.raises(gf.InvalidInputError, match="length_scale"):
        gf.grade(with_column, length_scale=0.5)


def test_the_answer_is_of_the_kind_of_the_question():
    table = as_table([GOOD, {**GOOD, "friction": [-1.0] * 3}])
    graded = gf.grade(table)
    (batch,) = table.to_batches()
    assert gf.grade(batch).equals(graded.to_batches()[0])
    assert len(gf.grade(batch.slice(0, 0))) == 0
    frame = table.to_pandas().set_index("id")
    found = gf.grade(frame)
    assert found[frame.columns.tolist()].equals(frame)
    assert found.index.equals(frame.index)
    assert found["status"].tolist() == ["converged", "invalid"]
    assert found["rho_max"].tolist()[0] == graded["rho_max"].to_pylist()[0]
    assert found["rho_max"].isna().tolist() == [False, True]
    assert found["message"].isna().tolist() == [True, False]
    assert gf.grade(frame[:0]).dtypes.equals(found.dtypes)
    with pytest.raises(gf.InvalidInputError, match=r"source: builtins\.list"):
        gf.grade([1, 2])


def test_progress_ends_with_all_rows_and_may_end_the_run():
    table, seen = as_table(grasp_rows(50)), []
    gf.grade(table, progress=lambda *told: seen.append(told))
    assert seen[-1] == (50, 50)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)

    def stop(_done, _total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gf.grade(table, progress=stop)


def test_errors_of_datasets_survive_the_way_between_machines():
    error = pickle.loads(pickle.dumps(gf.ResumeError("why")))
    assert isinstance(error, gf.GraspForceError)
    assert str(error) == "why"
