"""Layouts of contacts: one contact on each of several curves or surfaces, tied parameters, mirror images."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from graspforce._internal.checks import finite_array, finite_vector, real_array
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
    """

    def __init__(
        self,
        function: Callable[[Array], tuple[Array, ...]],
        num_params: int,
        grasp_options: Mapping[str, Any],
    ) -> None:
        self._function = function
        self.num_params = num_params
        self.grasp_options = dict(grasp_options)

    def __repr__(self) -> str:
        return f"Arrangement({self.num_params} parameters, {', '.join(self.grasp_options) or 'no options'})"

    def __call__(self, params: ArrayLike) -> tuple[Array, ...]:
        """Contacts of parameters (B, num_params)."""
        given = real_array("params", params)
        if given.ndim != 2 or given.shape[1] != self.num_params:
            raise InvalidInputError(f"params: shape {given.shape}, expected (B, {self.num_params})")
        return self._function(given)


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
    return Arrangement(partial(_one_on_each, places), num_params, options)


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
    return Arrangement(function, ties.shape[1], getattr(surface, "grasp_options", {}))


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
    return Arrangement(function, num_params, {name: np.tile(value, 2) for name, value in options.items()})


# Functions of the module, not of a call, so that arrangements can be copied and pickled.
def _one_on_each(places: Sequence[Place], params: Array) -> tuple[Array, ...]:
    columns = np.split(params, np.cumsum([place.num_params for place in places])[:-1], axis=1)
    found = [place.contacts(column) for place, column in zip(places, columns, strict=True)]
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
    positions, *directions = (np.asarray(array, dtype=np.float64) for array in surface(params))
    if positions.shape[-1] != across.size:
        raise InvalidInputError(f"normal: {across.size} components for contacts in {positions.shape[-1]}-D")
    images = [point + _image(positions - point, across), *(_image(vectors, across) for vectors in directions)]
    pairs = zip([positions, *directions], images, strict=True)
    return tuple(np.concatenate(pair, axis=1) for pair in pairs)


def _image(vectors: Array, across: Array) -> Array:
    return vectors - 2.0 * (vectors @ across)[..., None] * across
