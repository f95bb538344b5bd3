"""Quality of all grasps of a dataset: in memory, in Parquet files of any size, or on a Dask cluster.

Needs pyarrow (the ``datasets`` extra), and Dask for clusters (the ``dask`` extra).
"""

from .grade import grade
from .summary import GradeSummary

__all__ = ["GradeSummary", "grade"]
