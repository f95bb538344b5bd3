"""The controls of the page, and which values of them are accepted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .messages import one_of, within

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import viser

    from .messages import Filter
    from .state import ViewState

_SMALL_TABLE = 6
_STEPS = 10_000
"""Largest number of steps of the time slider."""


class Controls:
    """Sliders, check boxes and texts of the page.

    Attributes
    ----------
    numbers, contacts, legend, message
        Texts; errors stand in the message.
    row : slider
        The wrench: its time in s, or its row where the wrenches have no times.
    playing, dark : check box
    friction, limits : slider
        Factors of all coefficients and of all limits.
    criterion : drop-down
        The quality whose weakest direction is drawn.
    stage : slider or None
        Of a hand: 0 pregrasp, 1 grasp, 2 squeeze.
    share : button
    """

    def __init__(self, gui: viser.GuiApi, state: ViewState, stages: Sequence[str], fixed: str | None) -> None:
        """Add the controls; `fixed` says why friction and limits cannot be changed."""
        self.numbers = gui.add_html("")
        self.stage = None
        if stages:
            label = " to ".join((stages[0], stages[-1]))
            last = len(stages) - 1.0
            self.stage = gui.add_slider(label, 0.0, last, 0.05, 1.0, marks=((1.0, stages[1]),))
        rows = len(state.wrenches)
        self._end = max(1, rows - 1)
        if rows > 1 and state.times is not None:
            first, last = float(state.times[0]), float(state.times[-1])
            step = max((last - first) / (rows - 1), (last - first) / _STEPS)
            self._range = (first, last)
            self.row = gui.add_slider("time (s)", first, last, step, first)
        else:
            self._range = (0.0, float(self._end))
            self.row = gui.add_slider("wrench (row)", 0, self._end, 1, 0, visible=rows > 1)
        self.playing = gui.add_checkbox("play", initial_value=False, visible=rows > 1)
        hint = "factor of all friction coefficients" if fixed is None else fixed
        self.friction = gui.add_slider(
            "friction x", 0.1, 2.0, 0.05, 1.0, disabled=fixed is not None, hint=hint
        )
        hint = "factor of all limits of normal forces" if fixed is None else fixed
        self.limits = gui.add_slider("limits x", 0.1, 3.0, 0.05, 1.0, disabled=fixed is not None, hint=hint)
        if fixed is not None:
            gui.add_html(f"<div style='padding:0 0.75em 0.4em;font-size:0.8em;opacity:0.75'>{fixed}</div>")
        self.criterion = gui.add_dropdown("weakest by", ("max", "sum"))
        self.message = gui.add_markdown("")
        with gui.add_folder("Contacts", expand_by_default=state.grasp.num_contacts <= _SMALL_TABLE):
            self.contacts = gui.add_html("")
        self.legend = gui.add_html("")
        self.dark = gui.add_checkbox("dark page", initial_value=False)
        self.share = gui.add_button("Save as HTML", hint="one file that opens without a server")
        self._takes: list[tuple[Any, Callable[[Any], bool]]] = [
            (self.criterion, one_of("max", "sum")),
            (self.dark, one_of(False, True)),
            (self.share, one_of(True)),
        ]
        if fixed is None:
            self._takes += [(self.friction, within(0.1, 2.0)), (self.limits, within(0.1, 3.0))]
        if rows > 1:
            self._takes += [(self.row, within(*self._range)), (self.playing, one_of(False, True))]
        if self.stage is not None:
            self._takes.append((self.stage, within(0, len(stages) - 1)))

    def register(self, accepted: Filter, changed: Callable[[Any], object]) -> None:
        """Let clients set the controls, and call `changed` when they do."""
        accepted.controls = {identifier(control): values for control, values in self._takes}
        for control, _ in self._takes:
            if control not in (self.share, self.playing):
                control.on_update(changed)

    def advance(self, state: ViewState, seconds: float) -> None:
        """Move on to the next wrench, or by a time; a short trajectory is played slowly."""
        first, last = self._range
        step = 1.0 if state.times is None else min(seconds, (last - first) / 40)
        value = self.row.value + step
        value = first if value > last else value
        self.row.value = value if state.times is not None else int(value)  # type: ignore[misc] # meant to be assigned


def identifier(control: Any) -> str:
    """Return the identifier by which clients name a control; viser does not publish it."""
    return str(control._impl.uuid)  # noqa: SLF001 - the tests drag and slide by it
