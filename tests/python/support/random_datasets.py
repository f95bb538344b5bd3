"""Seeded datasets of grasps: as rows in Python, and as Arrow tables."""

import numpy as np
import pyarrow as pa

from support.random_grasps import random_grasp

VECTORS = pa.list_(pa.list_(pa.float64(), 3))
PLANAR_VECTORS = pa.list_(pa.list_(pa.float64(), 2))
NUMBERS = pa.list_(pa.float64())


def grasp_rows(count, dim=3, seed=0):
    """Return rows with 3 to 6 contacts, as dictionaries of lists."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        grasp = random_grasp([seed, number], dim, int(rng.integers(3, 7)), None)
        names = ("positions", "normals", "friction", "max_normal_force")
        rows.append({"id": f"grasp {number}", **{name: grasp[name].tolist() for name in names}})
    return rows


def as_table(rows, **types):
    """Return rows as a table with the types of the documentation, or others."""
    vectors = types.get("positions") or (PLANAR_VECTORS if is_planar(rows) else VECTORS)
    known = {"id": pa.string(), "positions": vectors, "normals": vectors}
    known |= {"friction": NUMBERS, "max_normal_force": NUMBERS, **types}
    return pa.table({name: pa.array([row[name] for row in rows], known[name]) for name in known})


def is_planar(rows):
    """Whether the first row has contacts in the plane."""
    return bool(rows) and len(rows[0]["positions"][0]) == 2


def repeated(table, count):
    """Return a longer table of the same grasps in another order, each row with a number of its own."""
    rows = np.random.default_rng(1).integers(0, len(table), count)
    return table.take(pa.array(rows)).append_column("number", pa.array(np.arange(count)))


def state(folder):
    """Return the bytes of all files of a folder by their names, but those of its lock."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".lock"
    }
