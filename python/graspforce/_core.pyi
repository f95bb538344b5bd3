from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from .metrics import Metrics

_Floats = NDArray[np.float64]
_Indices = NDArray[np.int32]
_Criterion = Literal["max", "sum"]

__all__ = [
    "BoxBound",
    "CandidateSearch",
    "ForceBatch",
    "ForceDistributor",
    "ForceSolution",
    "ForceSteps",
    "Gradient",
    "Grasp",
    "MinkowskiSum",
    "Quality",
    "QualityBatch",
    "TriangleTree",
    "__version__",
    "quality_many",
    "torque_limited_forces",
]

__version__: str

@final
class Grasp:
    def __new__(
        cls,
        positions: ArrayLike,
        normals: ArrayLike,
        friction: ArrayLike = 0.5,
        max_normal_force: ArrayLike = 1.0,
        edges: int | Sequence[int] | NDArray[np.integer[Any]] | None = 8,
        torsion: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        origin: ArrayLike | None = None,
        length_scale: float = 1.0,
        friction_margin: float = 1.0,
        extreme_forces: Sequence[ArrayLike] | None = None,
    ) -> Grasp: ...
    @property
    def wrench_dim(self) -> int: ...
    @property
    def num_contacts(self) -> int: ...
    @property
    def force_dim(self) -> int: ...
    @property
    def positions(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def frames(self) -> _Floats: ...
    @property
    def grasp_matrix(self) -> _Floats: ...
    @property
    def primitive_wrenches(self) -> _Floats: ...
    @property
    def extreme_forces(self) -> _Floats: ...
    @property
    def friction(self) -> _Floats: ...
    @property
    def max_normal_force(self) -> _Floats: ...
    @property
    def num_edges(self) -> NDArray[np.int64]: ...
    @property
    def length_scale(self) -> float: ...
    @property
    def origin(self) -> _Floats: ...
    @property
    def is_force_closure(self) -> bool: ...
    def quality(
        self,
        criterion: _Criterion = "max",
        rtol: float | None = None,
        center: ArrayLike | None = None,
        metric: ArrayLike | None = None,
    ) -> Quality: ...
    def resistance(self, directions: ArrayLike, criterion: _Criterion = "max") -> _Floats: ...
    def metrics(self) -> Metrics: ...
    def _singular_values(self) -> _Floats: ...
    def minkowski_sum(self, max_points: int = 2_000_000) -> MinkowskiSum: ...
    def to_dict(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    def __reduce__(self) -> tuple[type[Grasp], tuple[Any, ...]]: ...

@final
class Quality:
    @property
    def grasp(self) -> Grasp: ...
    @property
    def criterion(self) -> _Criterion: ...
    @property
    def rho(self) -> float: ...
    @property
    def epsilon(self) -> float: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def converged(self) -> bool: ...
    @property
    def closure(self) -> Literal["force", "partial", "none"]: ...
    @property
    def direction(self) -> _Floats: ...
    @property
    def wrench(self) -> _Floats: ...
    @property
    def supports(self) -> int: ...
    @property
    def gradient(self) -> Gradient: ...
    def to_dict(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _restore(
        grasp: Grasp,
        criterion: _Criterion,
        rtol: float | None,
        center: ArrayLike | None,
        metric: ArrayLike | None,
        bracket: tuple[float, float, float],
        found: tuple[bool, str, int],
        direction: Sequence[float],
        wrench: Sequence[float],
    ) -> Quality: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class Gradient:
    @property
    def positions(self) -> _Floats: ...
    @property
    def normals(self) -> _Floats: ...
    @property
    def spins(self) -> _Floats: ...
    @property
    def unique(self) -> bool: ...
    def to_dict(self) -> dict[str, Any]: ...
    @staticmethod
    def _restore(
        positions: Sequence[Sequence[float]],
        normals: Sequence[Sequence[float]],
        spins: Sequence[float],
        unique: bool,
        dim: int,
    ) -> Gradient: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...

@final
class QualityBatch:
    @property
    def rho(self) -> _Floats: ...
    @property
    def epsilon(self) -> _Floats: ...
    @property
    def lower(self) -> _Floats: ...
    @property
    def upper(self) -> _Floats: ...
    @property
    def closure(self) -> NDArray[np.int8]: ...
    @property
    def status(self) -> NDArray[np.int8]: ...
    @property
    def errors(self) -> dict[int, str]: ...
    def to_dict(self) -> dict[str, Any]: ...
    def _repr_html_(self) -> str: ...
    @staticmethod
    def _restore(rows: Sequence[tuple[float, float, float, int, int, str | None]]) -> QualityBatch: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...
    def __len__(self) -> int: ...

def quality_many(
    positions: ArrayLike,
    normals: ArrayLike,
    friction: ArrayLike = 0.5,
    max_normal_force: ArrayLike = 1.0,
    edges: int | Sequence[int] | NDArray[np.integer[Any]] | None = 8,
    torsion: ArrayLike | None = None,
    tangents: ArrayLike | None = None,
    origin: ArrayLike | None = None,
    length_scale: ArrayLike = 1.0,
    friction_margin: float = 1.0,
    extreme_forces: Sequence[ArrayLike] | None = None,
    *,
    criterion: _Criterion = "max",
    rtol: float | None = None,
    center: ArrayLike | None = None,
    metric: ArrayLike | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> QualityBatch: ...
def torque_limited_forces(
    jacobian: ArrayLike,
    torque_limits: ArrayLike,
    friction: float = 0.5,
    max_normal_force: float = 1.0,
    edges: int = 8,
) -> _Floats: ...

@final
class MinkowskiSum:
    @property
    def wrenches(self) -> _Floats: ...
    @property
    def starts(self) -> _Indices: ...
    @property
    def ends(self) -> _Indices: ...
    @property
    def contacts(self) -> _Indices: ...
    @property
    def edges(self) -> _Indices: ...
    # A scipy.sparse.csc_array: SciPy, and so its type, is the caller's to have.
    def to_scipy(self) -> Any: ...
    def to_dict(self) -> dict[str, Any]: ...
    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]: ...
    @staticmethod
    def _restore(
        wrenches: _Floats, indices: Sequence[_Indices], offsets: Sequence[int], rows: int
    ) -> MinkowskiSum: ...
    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]: ...
    def __len__(self) -> int: ...

@final
class ForceDistributor:
    def __new__(
        cls,
        grasp: Grasp,
        objective: _Criterion = "max",
        method: Literal["implicit", "enumerated", "reduced"] = "implicit",
        weight: float = 0.0,
        min_normal: ArrayLike | None = None,
        samples: ArrayLike | None = None,
        tol: float = 1e-9,
    ) -> ForceDistributor: ...
    @property
    def grasp(self) -> Grasp: ...
    @property
    def objective(self) -> _Criterion: ...
    @property
    def method(self) -> Literal["implicit", "enumerated", "reduced"]: ...
    @property
    def reduced_points(self) -> NDArray[np.uint32] | None: ...
    @property
    def weight(self) -> float: ...
    @property
    def min_normal(self) -> _Floats | None: ...
    @property
    def tol(self) -> float: ...
    def solve(self, external_wrench: ArrayLike) -> ForceSolution: ...
    def solve_into(self, external_wrench: ArrayLike, forces: _Floats) -> float: ...
    def solve_many(self, external_wrenches: ArrayLike, parallel: bool = False) -> ForceBatch: ...
    def step(self, external_wrenches: Iterable[ArrayLike]) -> ForceSteps: ...
    def update(self, grasp: Grasp) -> None: ...
    def __copy__(self) -> ForceDistributor: ...

@final
class ForceSteps:
    def __iter__(self) -> ForceSteps: ...
    def __next__(self) -> ForceSolution: ...

@final
class ForceBatch:
    @property
    def forces(self) -> _Floats: ...
    @property
    def sigma_max(self) -> _Floats: ...
    @property
    def sigma_sum(self) -> _Floats: ...
    @property
    def status(self) -> NDArray[np.int8]: ...

@final
class ForceSolution:
    @property
    def grasp(self) -> Grasp: ...
    @property
    def forces(self) -> _Floats: ...
    @property
    def world_forces(self) -> _Floats: ...
    @property
    def contact_wrenches(self) -> _Floats: ...
    @property
    def sigma_max(self) -> float: ...
    @property
    def sigma_sum(self) -> float: ...
    @property
    def dual(self) -> _Floats: ...
    @property
    def gap(self) -> float: ...
    @property
    def pivots(self) -> int: ...
    @property
    def fell_back(self) -> bool: ...
    @property
    def unique(self) -> bool: ...
    @property
    def within_limits(self) -> bool: ...
    @property
    def slip_margin(self) -> _Floats: ...

@type_check_only
class _Winner(TypedDict):
    index: int
    rho: float
    center_rho: float
    candidates: int
    rejected: int
    polytopes: int
    converged: int

@final
class CandidateSearch:
    def __new__(
        cls,
        dim: int,
        criterion: _Criterion = "max",
        rtol: float | None = None,
        center: ArrayLike | None = None,
        metric: ArrayLike | None = None,
        *,
        prune: bool = True,
    ) -> CandidateSearch: ...
    def best(
        self,
        positions: ArrayLike,
        normals: ArrayLike,
        friction: ArrayLike = 0.5,
        max_normal_force: ArrayLike = 1.0,
        edges: int | Sequence[int] | NDArray[np.integer[Any]] | None = 8,
        torsion: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        origin: ArrayLike | None = None,
        length_scale: float = 1.0,
        friction_margin: float = 1.0,
        extreme_forces: Sequence[ArrayLike] | None = None,
        *,
        center_index: int = 0,
        center_rho: float | None = None,
    ) -> _Winner: ...

@final
class TriangleTree:
    def __new__(cls, vertices: ArrayLike, faces: ArrayLike) -> TriangleTree: ...
    def closest(self, points: ArrayLike) -> tuple[_Floats, NDArray[np.int64], _Floats]: ...

@final
class BoxBound:
    def __new__(
        cls,
        dim: int,
        criterion: _Criterion = "max",
        center: ArrayLike | None = None,
        metric: ArrayLike | None = None,
    ) -> BoxBound: ...
    def over(
        self,
        slacks: ArrayLike,
        positions: ArrayLike,
        normals: ArrayLike,
        friction: ArrayLike = 0.5,
        max_normal_force: ArrayLike = 1.0,
        edges: int | Sequence[int] | NDArray[np.integer[Any]] | None = 8,
        torsion: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        origin: ArrayLike | None = None,
        length_scale: float = 1.0,
        friction_margin: float = 1.0,
        extreme_forces: Sequence[ArrayLike] | None = None,
        *,
        enough: float = 0.0,
        axes: int | None = None,
        safety: float = 1.5,
    ) -> _Floats: ...
