"""The text of the page as HTML: numbers, forces by contact, and the legend."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from graspforce._internal.normal_limits import normal_limits

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from graspforce._core import ForceSolution, Grasp, Quality

    Array = NDArray[np.float64]

OBJECT, CONE, FORCE, OVERLOAD = (200, 192, 172), (120, 170, 220), (42, 120, 200), (222, 56, 48)
WORST, UNBALANCED, HAND = (160, 90, 195), (209, 118, 43), (150, 160, 172)
"""Colours, as red, green and blue up to 255; legible on a light and on a dark page."""

_ARROWS = {FORCE, OVERLOAD, WORST, UNBALANCED}
_BOX = "padding:0 0.75em 0.4em;font-size:0.85em;line-height:1.45"
_TABLE = "width:100%;border-collapse:collapse;font-variant-numeric:tabular-nums"


def numbers(
    grasp: Grasp,
    quality: Mapping[str, Quality],
    solution: ForceSolution | None,
    more: Iterable[tuple[str, str]] = (),
    notes: Iterable[str] = (),
) -> str:
    """Quality and closure, how hard the contacts press, and what `more` and `notes` add."""
    rows = [(f"epsilon {name}", f"{found.epsilon:.6g} N") for name, found in quality.items()]
    rows.append(("closure", quality["max"].closure))
    rows.append(("friction", _range(grasp.friction / grasp.friction_margin, "")))
    rows.append(("limits", _range(normal_limits(grasp), " N")))
    rows += more
    lines = list(notes)
    if solution is not None:
        rows.append(("forces", f"up to {100 * solution.sigma_max:.3g} % of the limit"))
        if not solution.balanced:
            # The residual of nearest forces is as exact as its gap: digits below are rounding.
            parts = solution.residual[:3], solution.residual[3:]
            force, torque = (round(float(np.linalg.norm(part)), 9) for part in parts)
            rows.append(("unbalanced", f"{force:.3g} N, {torque:.3g} N m"))
            lines.append("No forces balance this wrench; the nearest ones within the limits are shown.")
    body = "".join(
        f"<tr><td>{escape(name)}</td><td style='text-align:right'><b>{escape(value)}</b></td></tr>"
        for name, value in rows
    )
    return _boxed(f"<table style='{_TABLE}'>{body}</table>" + "".join(map(_line, lines)))


def contact_table(grasp: Grasp, forces: Array | None, shares: Array | None, names: Iterable[str] = ()) -> str:
    """One row for each contact: its force (m, 3) in world axes, and its share of the limit where known.

    Without forces the rows show friction and limits. `names` are those of the fingers.
    """
    limits = normal_limits(grasp)
    if forces is None:
        heads = ["contact", "friction", "limit (N)"]
        columns = [grasp.friction / grasp.friction_margin, limits]
    else:
        normal = np.einsum("ij,ij->i", forces, grasp.normals)
        tangential = np.linalg.norm(forces - normal[:, None] * grasp.normals, axis=1)
        heads, columns = ["contact", "normal (N)", "tangential (N)"], [normal, tangential]
        if shares is not None:
            heads, columns = [*heads, "of limit (%)"], [*columns, 100 * shares]
    # Rounding errors of zero are no forces.
    dust = 1e-9 * max(float(limits.max()), 1e-300)
    cells = [[f"{0.0 if abs(value) < dust else value:.3g}" for value in column] for column in columns]
    labels = [str(i) for i in range(grasp.num_contacts)]
    given = list(names)
    if given:
        labels = [f"{label} {name}" for label, name in zip(labels, given, strict=True)]
    past = [False] * len(labels) if shares is None else (shares > 1 + 1e-9).tolist()
    head = "".join(f"<th style='text-align:{_side(k)}'>{escape(name)}</th>" for k, name in enumerate(heads))
    rows = ""
    for label, red, *values in zip(labels, past, *cells, strict=True):
        color = f";color:rgb{OVERLOAD}" if red else ""
        rows += "<tr>" + "".join(
            f"<td style='text-align:{_side(k)}{color}'>{escape(value)}</td>"
            for k, value in enumerate((label, *values))
        )
    return _boxed(f"<table style='{_TABLE}'><tr>{head}</tr>{rows}</table>")


def legend(*, polytopes: bool, forces: bool, hand: bool) -> str:
    """Colours of the scene with what they stand for.

    `polytopes`: the contacts show the hull of their extreme forces. `forces`: a wrench is balanced. `hand`: a
    hand is shown, with its forces at rest.
    """
    cone = "forces that the contact can exert" if polytopes else "forces within friction and limit"
    entries = [(CONE, cone)]
    if forces or hand:
        entries.append((FORCE, "force, at its limit as long as its cone"))
    if forces:
        entries += [(OVERLOAD, "force past its limit"), (UNBALANCED, "unbalanced force")]
    entries.append((WORST, "weakest disturbance: force and torque (ring)"))
    if hand:
        entries.append((HAND, "hand"))
    lines = (
        f"<div><span style='color:rgb{color}'>{'&#10142;' if color in _ARROWS else '&#9632;'}</span> "
        f"{escape(text)}</div>"
        for color, text in entries
    )
    return _boxed("".join(lines))


def _boxed(content: str) -> str:
    return f"<div style='{_BOX}'>{content}</div>"


def _line(text: str) -> str:
    return f"<div style='margin-top:0.4em'>{escape(text)}</div>"


def _side(column: int) -> str:
    return "right" if column else "left"


def _range(values: Array, unit: str) -> str:
    low, high = float(values.min()), float(values.max())
    same = high - low <= 1e-9 * high
    return (f"{high:.3g}" if same else f"{low:.3g} to {high:.3g}") + unit
