"""Write 1,000 random grasps to grasps.parquet, a dataset for `graspforce grade`.

Usage: python random_grasps.py
"""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

ROWS = 1000


def main() -> None:
    """Write grasps of four to six contacts on a ball of 5 cm radius, with tilted normals."""
    random = np.random.default_rng(0)
    counts = random.integers(4, 7, ROWS)
    total = counts.sum()
    outward = random.standard_normal((total, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    inward = 0.2 * random.standard_normal((total, 3)) - outward
    starts = pa.array(np.concatenate([[0], np.cumsum(counts)]), pa.int32())

    def vectors(values: np.ndarray) -> pa.Array:
        return pa.ListArray.from_arrays(starts, pa.FixedSizeListArray.from_arrays(values.ravel(), 3))

    columns = {
        "id": np.arange(ROWS),
        "positions": vectors(0.05 * outward),
        "normals": vectors(inward),
        "friction": random.uniform(0.3, 0.8, ROWS),
        "max_normal_force": np.full(ROWS, 10.0),
    }
    pq.write_table(pa.table(columns), "grasps.parquet")


if __name__ == "__main__":
    main()
