"""HTML tables of results, for notebooks.

The classes of the extension module call these functions.
"""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from graspforce.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from graspforce._core import ForceBatch, ForceSolution, Grasp, Quality, QualityBatch

FORCE_COMPONENTS = {2: "[n, t]", 3: "[n, o, t]", 4: "[n, o, t, torsion]"}
"""Names of the components of a force in its contact frame, by their number."""

_CLOSURES = {1: "force", 0: "partial", -1: "none"}
_ROWS_SHOWN = 10


def grasp_html(grasp: Grasp) -> str:
    """One row for each contact."""
    header = ("contact", "position (m)", "normal", "friction", "limit (N)")
    columns = zip(grasp.positions, grasp.normals, grasp.friction, grasp.max_normal_force, strict=True)
    rows = (
        (str(i), vector(r), vector(n), f"{mu:g}", f"{limit:g}") for i, (r, n, mu, limit) in enumerate(columns)
    )
    return table(repr(grasp), header, rows)


def solution_html(solution: ForceSolution) -> str:
    """One row for each contact."""
    names = FORCE_COMPONENTS[solution.grasp.force_dim]
    columns = zip(solution.forces, solution.shares, solution.slip_margin, strict=True)
    rows = (
        (str(i), vector(force), f"{share:.4f}", f"{margin:.4f}")
        for i, (force, share, margin) in enumerate(columns)
    )
    header = ("contact", f"force {names} (N)", "share of limit", "slip margin")
    return table(repr(solution), header, rows)


def forces_html(batch: ForceBatch) -> str:
    """Show the first rows of a batch."""
    rows = [
        (str(i), f"{largest:.6g}", f"{total:.6g}", Status(status).name.lower().replace("_", " "))
        for i, largest, total, status in _first_rows(batch.sigma_max, batch.sigma_sum, batch.status)
    ]
    if len(batch) > _ROWS_SHOWN:
        rows.append(("...", "", "", f"{len(batch) - _ROWS_SHOWN} more"))
    return table(repr(batch), ("row", "sigma_max", "sigma_sum", "status"), rows)


def quality_html(quality: Quality) -> str:
    """Numbers of a quality, one a row."""
    rows = [
        ("epsilon", f"{quality.epsilon:.9g}"),
        ("rho", f"{quality.rho:.9g}, proven within [{quality.lower:.9g}, {quality.upper:.9g}]"),
        ("closure", quality.closure),
        ("weakest along", vector(quality.direction)),
        ("converged", "yes" if quality.converged else "no: the bracket is wider than asked for"),
    ]
    if quality.hint is not None:
        rows.append(("hint", quality.hint))
    return table(f"Quality, criterion {quality.criterion}", ("", ""), rows)


def batch_html(batch: QualityBatch) -> str:
    """Show the first rows of a batch."""
    errors = batch.errors
    rows = [
        (str(i), f"{epsilon:.6g}", _CLOSURES.get(closure, errors.get(i, "")))
        for i, epsilon, closure in _first_rows(batch.epsilon, batch.closure)
    ]
    if len(batch) > _ROWS_SHOWN:
        rows.append(("...", "", f"{len(batch) - _ROWS_SHOWN} more"))
    return table(repr(batch), ("row", "epsilon", "closure"), rows)


def _first_rows(*columns: NDArray[Any]) -> Iterable[tuple[Any, ...]]:
    """Return the rows that are shown: their numbers, and their entries of each column."""
    cells = zip(*(column[:_ROWS_SHOWN].tolist() for column in columns), strict=True)
    return ((i, *row) for i, row in enumerate(cells))


def vector(values: Iterable[float]) -> str:
    """Write numbers as a list of five digits each."""
    return "[" + ", ".join(f"{value + 0.0:.5g}" for value in values) + "]"


def table(title: str, header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Write an HTML table; every text is escaped."""

    def line(cells: tuple[str, ...], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    head = f"<thead>{line(header, 'th')}</thead>" if any(header) else ""
    body = "".join(line(row, "td") for row in rows)
    return f"<table><caption>{html.escape(title)}</caption>{head}<tbody>{body}</tbody></table>"
