"""Layouts of contacts: one contact on each of several curves or surfaces, tied parameters, mirror images."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from graspforce._internal.checks import finite_array, finite_vector, real_array
from graspforce._internal.taylor_intervals import TaylorIntervals, real_numbers
from graspforce.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


class Place(Protocol):
    """A curve, a surface or a mesh on which one contact can lie."""

    @property
    def num_params(self) -> int:
        """Number of parameters of a contact."""
        ...

    @property
    def friction(self) -> float | None:
        """Friction coefficient there; None if the place has none."""
        ...

    @property
    def max_normal_force(self) -> float | None:
        """Limit of the normal force in N there; None if the place has none."""
        ...

    def contacts(self, params: Array) -> tuple[Array, Array]:
        """Points and unit normals (B, dim) at parameters (B, num_params)."""
        ...


class Arrangement:
    """A surface of whole grasps, for `graspforce.plan`, with the friction and limits of its contacts.

    Threads may share it if they may share its places; it can be pickled if they can.

    Attributes
    ----------
    num_params : int
        Number of parameters of a grasp.
    grasp_options : dict
        ``friction`` and ``max_normal_force`` (m,), if the places have them. `graspforce.plan` uses them
        unless its caller gives others.
    depends : numpy.ndarray or None
        (m, num_params) bool, True where a parameter moves a contact; None if that is not known.
        `graspforce.plan_global` bounds contacts with parameters of their own apart.
    has_formulas : bool
        True if formulas bound the curvature, so that `graspforce.plan_global` needs no estimate.
    places : tuple
        The places of the contacts, if the parameters are theirs, one after another; else empty.
    """

    def __init__(
        self,
        function: Callable[[Array], tuple[Array, ...]],
        num_params: int,
        grasp_options: Mapping[str, Any],
        settled: Callable[[Array], Array] | None = None,
        depends: NDArray[np.bool_] | None = None,
        *,
        has_formulas: bool = False,
        places: tuple[Place, ...] = (),
    ) -> None:
        self._function, self._settled = function, settled
        self.has_formulas, self.places = has_formulas, places
        self.num_params = num_params
        self.grasp_options = dict(grasp_options)
        self.depends = depends

    def __repr__(self) -> str:
        return f"Arrangement({self.num_params} parameters, {', '.join(self.grasp_options) or 'no options'})"

    def __call__(self, params: ArrayLike) -> tuple[Array, ...]:
        """Contacts of parameters (B, num_params)."""
        if isinstance(params, TaylorIntervals):
            return self._function(params)  # type: ignore[arg-type]
        given = real_array("params", params)
        if given.ndim != 2 or given.shape[1] != self.num_params:
            raise InvalidInputError(f"params: shape {given.shape}, expected (B, {self.num_params})")
        return self._function(given)

    def settled(self, params: Array) -> Array:
        """Return parameters (B, num_params) of the same contacts, from which these move most smoothly."""
        return params if self._settled is None else self._settled(params)


def contacts_on(*places: Place) -> Arrangement:
    """Put one contact on each place, their parameters one after another.

    Threads may share the result if they may share its places.

    Parameters
    ----------
    *places : PlanarCurve, ParametricSurface or MeshSurface
        The place of each contact, in order; all planar or all spatial. Friction and limits are theirs where
        every place has them.

    Returns
    -------
    Arrangement
        Parameters (B, p) to positions (B, m, dim) in m and unit normals (B, m, dim), as `graspforce.plan`
        takes.

    Examples
    --------
    A disc that is slippery on top of a rough straight edge.

    >>> import numpy as np
    >>> from graspforce.surfaces import PlanarCurve, contacts_on, ellipse, line
    >>> surface = contacts_on(ellipse(1.0, 1.0), line((0, 0), (1, 0), object_side="left"))
    >>> positions, normals = surface(np.zeros((5, 2)))
    >>> positions.shape, normals.shape
    ((5, 2, 2), (5, 2, 2))
    """
    if not places:
        raise InvalidInputError("places: a grasp needs at least one contact")
    for contact, place in enumerate(places):
        if not (hasattr(place, "num_params") and callable(getattr(place, "contacts", None))):
            raise InvalidInputError(f"places: contact {contact}: {place!r} is no curve, surface or mesh")
    num_params = sum(place.num_params for place in places)
    options = {}
    for name in ("friction", "max_normal_force"):
        values: list[Any] = [getattr(place, name, None) for place in places]
        known = [value is not None for value in values]
        if any(known) and not all(known):
            raise InvalidInputError(f"{name}: contact {known.index(False)} has none, but others do")
        if all(known):
            options[name] = finite_vector(name, values)
    own = np.repeat(np.arange(len(places)), [place.num_params for place in places])
    depends = own == np.arange(len(places))[:, None]
    function, settled = partial(_one_on_each, places), partial(_settled_on_each, places)
    formulas = all(getattr(place, "has_formulas", False) for place in places)
    return Arrangement(function, num_params, options, settled, depends, has_formulas=formulas, places=places)


def tied(
    surface: Callable[[Array], tuple[Array, ...]], matrix: ArrayLike, offset: ArrayLike = 0.0
) -> Arrangement:
    """Search fewer parameters x than a surface has: it gets ``matrix @ x + offset``.

    Threads may share the result if they may share the surface.

    Parameters
    ----------
    surface : callable
        As `graspforce.plan` takes it, with P parameters.
    matrix : array_like
        (P, p): row by row, how each parameter of the surface follows from the p that are searched.
    offset : array_like
        (P,) or scalar.

    Returns
    -------
    Arrangement
        The surface with p parameters.

    Examples
    --------
    Two contacts on a circle that stay symmetric: the second angle is minus the first.

    >>> import numpy as np
    >>> from graspforce.surfaces import contacts_on, ellipse, tied
    >>> pair = tied(contacts_on(ellipse(1.0, 1.0), ellipse(1.0, 1.0)), [[1], [-1]])
    >>> positions, _ = pair(np.array([[np.pi / 2]]))
    >>> bool(np.allclose(positions, [[[0, 1], [0, -1]]]))
    True
    """
    if not callable(surface):
        raise InvalidInputError(f"surface: {surface!r} is not callable")
    ties = finite_array("matrix", matrix)
    if ties.ndim != 2 or 0 in ties.shape:
        raise InvalidInputError(f"matrix: shape {ties.shape}, expected (P, p)")
    wanted = getattr(surface, "num_params", len(ties))
    if wanted != len(ties):
        raise InvalidInputError(f"matrix: {len(ties)} rows for a surface of {wanted} parameters")
    constant = finite_vector("offset", offset, size=len(ties))
    function = partial(_with_ties, surface, ties, constant)
    depends = getattr(surface, "depends", None)
    if depends is not None:
        depends = depends @ (ties != 0)
    options = getattr(surface, "grasp_options", {})
    known = getattr(surface, "has_formulas", False)
    return Arrangement(function, ties.shape[1], options, depends=depends, has_formulas=known)


def mirrored(
    surface: Callable[[Array], tuple[Array, ...]], normal: ArrayLike, through: ArrayLike = 0.0
) -> Arrangement:
    """Add to each contact its mirror image: 2m contacts for the parameters of m.

    Threads may share the result if they may share the surface.

    Parameters
    ----------
    surface : Arrangement
        Of m contacts, on an object that is symmetric about the plane.
    normal : array_like
        (dim,) of the mirror plane (planar: line), of any length.
    through : array_like
        (dim,) a point of the plane, in m.

    Returns
    -------
    Arrangement
        The m contacts, then their images in the same order.

    Examples
    --------
    >>> import numpy as np
    >>> from graspforce.surfaces import contacts_on, ellipse, mirrored
    >>> both = mirrored(contacts_on(ellipse(2.0, 1.0)), normal=(1, 0))
    >>> both(np.array([[0.0]]))[0].tolist()
    [[[2.0, 0.0], [-2.0, 0.0]]]
    """
    num_params = getattr(surface, "num_params", None)
    if num_params is None:
        raise InvalidInputError("surface: not an arrangement; wrap it by `tied(surface, numpy.eye(p))` first")
    across = finite_vector("normal", normal)
    length = np.linalg.norm(across)
    if not length > 0:
        raise InvalidInputError(f"normal: {across.tolist()} has no direction")
    across = across / length
    point = finite_vector("through", through, size=across.size)
    function = partial(_with_images, surface, across, point)
    options = getattr(surface, "grasp_options", {})
    depends = getattr(surface, "depends", None)
    if depends is not None:
        depends = np.vstack([depends, depends])
    twice = {name: np.tile(value, 2) for name, value in options.items()}
    known = getattr(surface, "has_formulas", False)
    return Arrangement(function, num_params, twice, depends=depends, has_formulas=known)


# Functions of the module, not of a call, so that arrangements can be copied and pickled.
def _columns(places: Sequence[Place], params: Array) -> list[tuple[Place, Array]]:
    columns = np.split(params, np.cumsum([place.num_params for place in places])[:-1], axis=1)
    return list(zip(places, columns, strict=True))


def _settled_on_each(places: Sequence[Place], params: Array) -> Array:
    settled = [
        getattr(place, "settled", lambda own: own)(column) for place, column in _columns(places, params)
    ]
    return np.concatenate(settled, axis=1)


def _one_on_each(places: Sequence[Place], params: Array) -> tuple[Array, ...]:
    found = [place.contacts(column) for place, column in _columns(places, params)]
    for contact, (points, normals) in enumerate(found):
        shapes = np.shape(points), np.shape(normals)
        if shapes != (np.shape(found[0][0]),) * 2:
            raise InvalidInputError(
                f"places: contact {contact} has points {shapes[0]} and normals {shapes[1]}, "
                f"expected {np.shape(found[0][0])}"
            )
    all_points, all_normals = zip(*found, strict=True)
    return np.stack(all_points, axis=1), np.stack(all_normals, axis=1)


def _with_ties(
    surface: Callable[[Array], tuple[Array, ...]], ties: Array, constant: Array, params: Array
) -> tuple[Array, ...]:
    return surface(params @ ties.T + constant)


def _with_images(
    surface: Callable[[Array], tuple[Array, ...]], across: Array, point: Array, params: Array
) -> tuple[Array, ...]:
    positions, *directions = (real_numbers(array) for array in surface(params))
    if positions.shape[-1] != across.size:
        raise InvalidInputError(f"normal: {across.size} components for contacts in {positions.shape[-1]}-D")
    images = [point + _image(positions - point, across), *(_image(vectors, across) for vectors in directions)]
    pairs = zip([positions, *directions], images, strict=True)
    return tuple(np.concatenate(pair, axis=1) for pair in pairs)


def _image(vectors: Array, across: Array) -> Array:
    return vectors - 2.0 * (vectors @ across)[..., None] * across
