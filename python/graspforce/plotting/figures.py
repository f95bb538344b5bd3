"""Whole figures of what the command line computes and notebooks show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from graspforce._core import ForceSolution, Grasp, Quality
from graspforce._internal.checks import instance
from graspforce._internal.html import vector
from graspforce.planning import Plan
from graspforce.typing import CRITERIA

from .panels import DrawnWrench, draw_panel
from .polytopes import draw_wrench_polytopes
from .statistics import draw_plan_history
from .style import INK, new_figure
from .trajectories import draw_forces

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike, NDArray

    Mesh = tuple[ArrayLike, ArrayLike] | Any

_MAX_DRAWN_CONTACTS = 7
_SIDE = 5.2
"""Larger side of a drawing, in inches."""


def grasp_figure(
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    title: str = "",
    outline: ArrayLike | None = None,
    mesh: Mesh | None = None,
) -> Figure:
    """Return a picture of a grasp, and of the forces (m, k) in its contact frames.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    grasp : Grasp
        What is drawn, with the numbers of its contacts.
    forces : array_like, optional
        (m, k) contact forces in N, in contact frames. The largest is about a third of the object long.
    title : str
        Above the picture.
    outline : array_like, optional
        (n, 2) corners of a planar object in m.
    mesh : tuple of array_like, MeshSurface or trimesh.Trimesh, optional
        A spatial object: vertices (v, 3) in m and triangles (t, 3), or what has ``vertices`` and ``faces``.

    Examples
    --------
    >>> import graspforce as gf
    >>> from graspforce.plotting import grasp_figure
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    >>> len(grasp_figure(grasp, title="pinch").axes)
    1
    """
    instance("grasp", grasp, Grasp)
    return _one_panel(grasp, title, forces=forces, outline=outline, mesh=mesh)


def solution_figure(
    solution: ForceSolution,
    *,
    title: str | None = None,
    outline: ArrayLike | None = None,
    mesh: Mesh | None = None,
) -> Figure:
    """Return a picture of contact forces and of the external wrench that they balance.

    For one thread at a time, as all of matplotlib. Arguments are those of `grasp_figure`; the default title
    names the objective and the wrench.

    Examples
    --------
    >>> import graspforce as gf
    >>> from graspforce.plotting import solution_figure
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    >>> len(solution_figure(gf.ForceDistributor(grasp).solve([0, -1, 0])).axes)
    1
    """
    instance("solution", solution, ForceSolution)
    if title is None:
        sought = f"least {solution.objective}" if solution.balanced else "nearest forces"
        title = f"{sought} against {vector(solution.external_wrench)}"
    if not solution.balanced:
        title += f"\nnot balanced: {solution.distance:.4g} from it"
    wrench = DrawnWrench.external(solution.external_wrench)
    return _one_panel(
        solution.grasp, title, forces=solution.forces, wrench=wrench, outline=outline, mesh=mesh
    )


def polytope_figure(grasp: Grasp, *, title: str = "") -> Figure:
    """Return the wrench polytopes of a planar grasp, as `draw_wrench_polytopes` draws them.

    For one thread at a time, as all of matplotlib.
    """
    figure = new_figure(5.6, 5.8, title)
    draw_wrench_polytopes(_solid(figure, 111), grasp)
    return figure


def quality_figure(
    grasp: Grasp | Quality,
    qualities: Sequence[Quality] | None = None,
    *,
    title: str = "",
    outline: ArrayLike | None = None,
    mesh: Mesh | None = None,
) -> Figure:
    """Return a grasp with its quality and its weakest wrench.

    Where the grasp is planar and spans all wrenches, its wrench polytopes stand beside it. The wrench is the
    one nearest to the origin on the boundary of the wrench set, for the first quality: the contacts exert no
    other so badly. Its force is a straight arrow, its torque a curved one.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    grasp : Grasp or Quality
        What is drawn; a quality stands for its grasp and itself.
    qualities : sequence of Quality, optional
        Whose numbers are written; by default those by both criteria.
    title, outline, mesh
        As for `grasp_figure`.
    """
    instance("grasp", grasp, Grasp, Quality)
    if isinstance(grasp, Quality):
        qualities, grasp = [grasp], grasp.grasp
    found = [grasp.quality(name) for name in CRITERIA] if qualities is None else list(qualities)
    title = "\n".join(line for line in (title, *_numbers(found)) if line)
    wrench = DrawnWrench.weakest(found[0])
    if not _has_polytopes(grasp):
        return _one_panel(grasp, title, wrench=wrench, outline=outline, mesh=mesh)
    figure = new_figure(10.4, 5.8, title)
    entries, _ = draw_panel(figure, 121, grasp, wrench=wrench, outline=outline)
    entries += draw_wrench_polytopes(_solid(figure, 122), grasp)[:4]
    _legend(figure, entries, columns=4)
    return figure


def trajectory_figure(
    normal_forces: ArrayLike, max_normal_force: ArrayLike, *, times: ArrayLike | None = None, title: str = ""
) -> Figure:
    """Return normal forces (T, m) over time with their limits, as `draw_forces` draws them.

    For one thread at a time, as all of matplotlib.
    """
    figure = new_figure(7.2, 3.6, title)
    draw_forces(figure.subplots(), normal_forces, max_normal_force, times=times)
    return figure


def history_figure(
    plan: Plan,
    *,
    title: str = "",
    outline: ArrayLike | None = None,
    mesh: Mesh | None = None,
    curves: Sequence[NDArray[np.float64]] = (),
) -> Figure:
    """Return the descent of a plan beside the grasp it ends at.

    For one thread at a time, as all of matplotlib.

    Parameters
    ----------
    plan : Plan
        What `graspforce.plan` returned.
    title, outline, mesh
        As for `grasp_figure`.
    curves : sequence of array_like
        (n, 2) points in m of the curves on which contacts of a planar grasp may lie.
    """
    instance("plan", plan, Plan)
    figure = new_figure(9.6, 5.0, title)
    draw_plan_history(figure.add_subplot(121), plan)
    entries, _ = draw_panel(
        figure,
        122,
        plan.grasp,
        wrench=DrawnWrench.weakest(plan.quality),
        outline=outline,
        mesh=mesh,
        curves=curves,
    )
    _legend(figure, entries, columns=3)
    return figure


def _one_panel(
    grasp: Grasp,
    title: str,
    *,
    forces: ArrayLike | None = None,
    wrench: DrawnWrench | None = None,
    outline: ArrayLike | None = None,
    mesh: Mesh | None = None,
) -> Figure:
    figure = new_figure(5.6, 5.6, title)
    entries, used = draw_panel(figure, 111, grasp, forces=forces, wrench=wrench, outline=outline, mesh=mesh)
    planar = grasp.wrench_dim == 3
    wide, high = _SIDE * used + ([0.5, 0.4] if planar else [0.0, 0.0])
    wide = max(float(wide), 4.2)
    above, below = 0.2 * (title.count("\n") + bool(title)) + 0.1, 0.2 * -(-len(entries) // 2) + 0.1
    figure.set_size_inches(wide, high + above + below)
    _legend(figure, entries, columns=2)
    if not planar:
        # The axes of three dimensions are square; what a wide or tall object leaves free is cut off.
        figure.set_layout_engine("none")
        width, height = figure.get_size_inches()
        middle = below + high / 2
        figure.axes[0].set_position(
            (0.5 - _SIDE / 2 / width, (middle - _SIDE / 2) / height, _SIDE / width, _SIDE / height)
        )
    return figure


def _numbers(found: Sequence[Quality]) -> list[str]:
    """Lines that say what the qualities are."""
    numbers = ", ".join(rf"$\epsilon_\mathrm{{{q.criterion}}}$ = {q.epsilon + 0.0:.6g} N" for q in found)
    closure = {"force": "", "partial": "partial closure: ", "none": "no force closure: "}[found[0].closure]
    about = found[0].external_wrench
    return [closure + numbers] + ([] if about is None else [f"on top of {vector(about)}"])


def _legend(figure: Figure, entries: Sequence[Artist], *, columns: int) -> None:
    figure.legend(
        handles=list(entries),
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        fontsize=8,
        labelcolor=INK,
    )


def _solid(figure: Figure, position: int) -> Axes3D:
    return cast("Axes3D", figure.add_subplot(position, projection="3d"))


def _has_polytopes(grasp: Grasp) -> bool:
    if grasp.wrench_dim != 3 or grasp.num_contacts > _MAX_DRAWN_CONTACTS:
        return False
    return grasp.measures().smallest_singular_value > 0 and grasp.quality("sum").closure == "force"
