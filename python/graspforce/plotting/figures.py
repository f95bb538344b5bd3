"""Whole figures of what the command line computes."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from graspforce._core import Grasp
from graspforce._internal.checks import instance
from graspforce.planning import Plan
from graspforce.typing import CRITERIA

from .planar import draw_planar_grasp
from .polytopes import draw_wrench_polytopes
from .spatial import draw_spatial_grasp
from .statistics import draw_plan_history
from .style import INK, new_figure
from .trajectories import draw_forces

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D
    from numpy.typing import ArrayLike

_MAX_DRAWN_CONTACTS = 7


def grasp_figure(
    grasp: Grasp,
    forces: ArrayLike | None = None,
    *,
    title: str = "",
    outline: ArrayLike | None = None,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Return a picture of a grasp, and of the forces (m, k) in its contact frames.

    For one thread at a time, as all of matplotlib.

    Examples
    --------
    >>> import graspforce as gf
    >>> from graspforce.plotting import grasp_figure
    >>> grasp = gf.Grasp([(-1, 0), (1, 0)], [(1, 0), (-1, 0)])
    >>> len(grasp_figure(grasp, title="pinch").axes)
    1
    """
    instance("grasp", grasp, Grasp)
    figure = new_figure(5.6, 5.0, title)
    if grasp.wrench_dim == 3:
        _planar(figure.subplots(), grasp, forces, outline)
    else:
        draw_spatial_grasp(_solid(figure, 111), grasp, forces, mesh=mesh)
    return figure


def polytope_figure(grasp: Grasp, *, title: str = "") -> Figure:
    """Return the wrench polytopes of a planar grasp, as `draw_wrench_polytopes` draws them.

    For one thread at a time, as all of matplotlib.
    """
    figure = new_figure(5.6, 5.0, title)
    draw_wrench_polytopes(_solid(figure, 111), grasp)
    return figure


def quality_figure(
    grasp: Grasp,
    *,
    title: str = "",
    outline: ArrayLike | None = None,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Return a grasp and, where it is planar and spans all wrenches, its wrench polytopes beside it.

    For one thread at a time, as all of matplotlib.
    """
    instance("grasp", grasp, Grasp)
    if not _has_polytopes(grasp):
        return grasp_figure(grasp, title=title, outline=outline, mesh=mesh)
    numbers = ", ".join(
        rf"$\epsilon_\mathrm{{{criterion}}}$ = {grasp.quality(criterion).epsilon:.6g} N"
        for criterion in CRITERIA
    )
    figure = new_figure(9.6, 4.8, f"{title}   {numbers}")
    _planar(figure.add_subplot(121), grasp, None, outline)
    draw_wrench_polytopes(_solid(figure, 122), grasp)
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


def history_figure(plan: Plan, *, title: str = "", outline: ArrayLike | None = None) -> Figure:
    """Return the descent of a plan, with the grasp it ends at where that is planar.

    For one thread at a time, as all of matplotlib.
    """
    instance("plan", plan, Plan)
    planar = plan.grasp.wrench_dim == 3
    figure = new_figure(8.8 if planar else 5.2, 4.0, title)
    draw_plan_history(figure.add_subplot(121 if planar else 111), plan)
    if planar:
        _planar(figure.add_subplot(122), plan.grasp, None, outline)
    return figure


def _planar(axes: Axes, grasp: Grasp, forces: ArrayLike | None, outline: ArrayLike | None) -> None:
    draw_planar_grasp(axes, grasp, forces, outline=outline)
    axes.margins(0.06)
    axes.autoscale_view()
    axes.set_xlabel("x (m)", fontsize=8, color=INK)
    axes.set_ylabel("y (m)", fontsize=8, color=INK)
    axes.tick_params(labelsize=7, colors=INK)
    axes.spines[:].set_visible(False)


def _solid(figure: Figure, position: int) -> Axes3D:
    return cast("Axes3D", figure.add_subplot(position, projection="3d"))


def _has_polytopes(grasp: Grasp) -> bool:
    if grasp.wrench_dim != 3 or grasp.num_contacts > _MAX_DRAWN_CONTACTS:
        return False
    return grasp.measures().smallest_singular_value > 0 and grasp.quality("sum").closure == "force"
