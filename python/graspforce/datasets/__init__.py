"""Quality of all grasps of a dataset: in memory, in Parquet files of any size, or on a Dask cluster.

Needs pyarrow (the ``datasets`` extra), and Dask for clusters (the ``dask`` extra).

- `grade`: the public function; `options`: its options; `summary`: its result on files.
- Rows to grades: `schema`: the columns; `rows` and `arrow_lists`: grasps of Arrow columns; `grade_table`:
  their grades; `uncertainty`: least friction and probability of closure; `dataframes`: pandas and Dask
  DataFrames.
- Files: `grade_files`: a whole run; `matching` and `parquet_source`: the source; `parts` and `part_files`:
  result files; `manifest` and `replacement`: the folder of results; `atomic_files`: its lock; `dask_cluster`:
  parts on a cluster.
- `numpy_files`: NumPy files of other programs, without running code from them.
"""

from .grade import grade
from .numpy_files import load_numpy
from .summary import GradeSummary

__all__ = ["GradeSummary", "grade", "load_numpy"]
