"""Datasets of grasps: in memory, in Parquet files larger than memory, on the machines of a Dask cluster.

Needs pyarrow (the ``datasets`` extra), and Dask for clusters (the ``dask`` extra).
"""

from .grade import grade
from .summary import GradeSummary

__all__ = ["GradeSummary", "grade"]
