"""The page: what is shown, and what happens when clients change it."""

from __future__ import annotations

import contextlib
import gc
import io
import re
import threading
import time
import warnings
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._internal.checks import instance
from graspforce.errors import GraspForceError, MissingExtraError
from graspforce.hands import HandPlan

from .state import ViewState

try:
    import viser

    from .controls import Controls
    from .drawing import Drawing
    from .guard import Guard, exposure, guarded, is_loopback
    from .messages import Filter
except ModuleNotFoundError as error:
    raise MissingExtraError("viewer", error) from error

from . import panel, share
from .hand import HandOnPage
from .ports import free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import ForceSolution, Grasp, Quality

_FRAMES_PER_SECOND = 20
_SHARED_FRAMES = 100
"""Largest number of wrenches that a shared file plays."""

_SHARE_SECONDS = 1.0
"""Least time between two shared files."""


def view(
    grasp: Grasp | HandPlan,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    wrenches: ArrayLike | None = None,
    *,
    times: ArrayLike | None = None,
    title: str = "graspforce",
    host: str = "127.0.0.1",
    port: int | None = None,
) -> Viewer:
    """Serve a grasp on a page of its own, at `Viewer.address`.

    Parameters
    ----------
    grasp : Grasp or HandPlan
        A spatial grasp, or the plan of a hand. The page of a plan also shows the hand, and what the torque
        limits of its joints allow at the contacts.
    mesh, wrenches, times
        As for `ViewState`.
    title : str, optional
        Title of the page.
    host : str, optional
        The address to listen at. By default only this machine can reach it. Any other address raises a
        warning, because nothing is encrypted, not even the token.
    port : int, optional
        The port; 0 for any free one. By default 8080, or the next free one.

    Returns
    -------
    Viewer
        The running viewer. Threads of its own serve the page; any thread may call this.

    Raises
    ------
    InvalidInputError
        The port is taken, the address is not one of this machine, or as for `ViewState`.

    Warns
    -----
    UserWarning
        Other machines can reach `host`.

    Examples
    --------
    >>> import graspforce as gf
    >>> from graspforce.viewer import view
    >>> viewer = view(gf.Grasp([(-1, 0, 0), (1, 0, 0)], [(1, 0, 0), (-1, 0, 0)]))
    >>> viewer.address.partition("?token=")[0] == f"http://127.0.0.1:{viewer.port}/"
    True
    >>> viewer.stop()
    """
    if not is_loopback(host):
        warnings.warn(exposure(host), stacklevel=2)
    hand = HandOnPage(grasp) if isinstance(grasp, HandPlan) else None
    state = ViewState(grasp if hand is None else hand.grasp, mesh, wrenches, times)  # type: ignore[arg-type] # no plan
    return Viewer(state, title=title, host=host, port=port, hand=hand)


class Viewer:
    """A running viewer. Its own thread applies what clients change; of several values the newest counts.

    Attributes
    ----------
    state : ViewState
        What is shown.
    port : int
        Where the page is served.
    address : str
        The page's address with the token. The viewer refuses requests without the token.
    """

    def __init__(
        self,
        state: ViewState,
        *,
        title: str = "graspforce",
        host: str = "127.0.0.1",
        port: int | None = None,
        hand: HandOnPage | None = None,
    ) -> None:
        instance("state", state, ViewState)
        self.state = state
        self._title, self._hand, self._dark, self._stage = title, hand, False, -1.0
        self._turn = threading.RLock()
        self._filter = Filter()
        self._guard = Guard(host, self._filter, title)
        chosen = free_port(host, port)
        with guarded(self._guard) as guarded_host:
            self._server = viser.ViserServer(host=guarded_host, port=chosen, label=title, verbose=False)
        self.port = self._server.get_port()
        self.address = self._guard.address(self.port)
        self._threads: list[threading.Thread] = []
        self._stopped = threading.Event()
        self._changed = threading.Event()
        self._noting = threading.Lock()
        self._moved: set[int] = set()
        self._released: set[int] = set()
        self._asking: set[Any] = set()
        self._asked = threading.Event()
        try:
            self._start()
        except BaseException:
            # The server would keep the port.
            self.stop()
            raise

    def _start(self) -> None:
        if not self._guard.applied:
            raise GraspForceError(f"viser {viser.__version__}: its server cannot be guarded; use viser 1.1")
        self._size = self.state.extent()
        self._add_panel()
        self._add_object()
        self._drawing = Drawing(
            self._server.scene, self.state.grasp, self._size, polytopes=not self.state.has_cones
        )
        self.update()
        for each in (self._play, self._follow, self._share):
            thread = threading.Thread(target=each, daemon=True)
            thread.start()
            self._threads.append(thread)

    def stop(self) -> None:
        """Close the page."""
        self._stopped.set()
        self._changed.set()
        self._asked.set()
        self._guard.close()
        for thread in self._threads:
            thread.join()
        # viser prints that it has stopped.
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def update(self) -> None:
        """Show the state as it is now."""
        controls = self._controls
        with self._turn, self._server.atomic():
            if controls.dark.value != self._dark:
                self._dark = controls.dark.value
                self._set_theme()
            quality, solution = self._quality(), self._solution()
            self._drawing.grasp(self.state.grasp)
            self._drawing.weakest(self.state.grasp, quality[controls.criterion.value].direction)
            self._draw_forces(solution)
            if controls.stage is not None:
                self._draw_hand(controls.stage.value)
            controls.numbers.content = self._numbers(quality, solution)
            controls.contacts.content = self._contact_table(solution)
            controls.legend.content = panel.legend(
                polytopes=not self.state.has_cones, forces=solution is not None, hand=self._hand is not None
            )

    def html(self) -> str:
        """Return the page as one HTML file that opens without a server.

        It holds the scene as it is now, the numbers and the legend, but no sliders and nothing to drag. It
        plays the wrenches, or the hand from pregrasp to squeeze.

        Examples
        --------
        >>> from pathlib import Path
        >>> Path("cup.html").write_text(viewer.html(), encoding="utf-8")  # doctest: +SKIP
        """
        with self._turn:
            frames = self._frames()
            # Numbers of one wrench would be wrong while others are played.
            still = self._solution() if len(self.state.wrenches) < 2 else None
            text = self._numbers(self._quality(), still) + self._contact_table(still)
            text += self._controls.legend.content
            try:
                return share.html_of(
                    self._server, self._handles, frames, text, title=self._title, dark=self._dark
                )
            finally:
                self.update()

    def _frames(self) -> list[tuple[float, Callable[[], object]]]:
        """Pictures that a shared file plays: seconds since the one before, and the call that draws it."""
        rows, times = len(self.state.wrenches), self.state.times
        if rows > 1:
            shown = np.unique(np.linspace(0, rows - 1, min(rows, _SHARED_FRAMES)).round().astype(int))
            at = shown / _FRAMES_PER_SECOND if times is None else times[shown]
            waits = np.diff(at, prepend=at[0])
            forces = [partial(lambda row: self._draw_forces(self.state.forces(row)), int(k)) for k in shown]
            return list(zip(waits.tolist(), forces, strict=True))
        if self._hand is None:
            return []
        stages = np.linspace(0, len(self._hand.stages) - 1, 21).tolist()
        return [(0.1 * (stage > 0), partial(self._draw_hand, stage)) for stage in stages]

    def _add_panel(self) -> None:
        self._set_theme()
        fixed = None
        if not self.state.has_cones:
            fixed = "Fixed: each contact has its own extreme forces, which replace friction and limit."
        if self._hand is not None:
            fixed = "Fixed: friction and the torque limits of the joints bound the forces."
        stages = () if self._hand is None else self._hand.stages
        self._controls = Controls(self._server.gui, self.state, stages, fixed)
        self._controls.register(self._filter, lambda _: self._changed.set())
        self._controls.share.on_click(self._ask)

    def _set_theme(self) -> None:
        self._server.gui.configure_theme(dark_mode=self._dark, show_logo=False, show_share_button=False)

    def _add_object(self) -> None:
        scene = self._server.scene
        scene.set_up_direction("+z")
        if self.state.mesh is not None:
            opacity = 0.5 if self._hand is None else 0.8
            scene.add_mesh_simple(
                "/object", *self.state.mesh, color=panel.OBJECT, opacity=opacity, side="double"
            )
        if self._hand is not None:
            self._hand.add(scene)
        self._handles = []
        # Contacts of a hand's plan belong to its fingers.
        free = self.state.grasp.positions if self._hand is None else ()
        for i, position in enumerate(free):
            handle = scene.add_transform_controls(
                f"/contacts/{i}", scale=0.15 * self._size, disable_rotations=True, disable_sliders=True,
                position=position,
            )  # fmt: skip
            handle.on_update(partial(self._drag, i))
            self._handles.append(handle)
            self._filter.handles.add(handle.name)
        middle, towards = self.state.grasp.positions.mean(axis=0), np.array([1.2, -1.2, 0.9])
        if self._hand is not None:
            middle, towards = self._hand.view(middle)
        self._server.initial_camera.look_at = tuple(middle)
        self._server.initial_camera.position = tuple(middle + self._size * towards)

    def _drag(self, contact: int, event: Any) -> None:
        with self._noting:
            self._moved.add(contact)
            if event.phase == "end":
                self._released.add(contact)
        self._changed.set()

    def _ask(self, event: Any) -> None:
        if event.client is not None:
            with self._noting:
                self._asking.add(event.client)
            self._asked.set()

    def _share(self) -> None:
        """Send the page as a file to clients that ask for it; who asks often gets it once a second."""
        while self._asked.wait() and not self._stopped.is_set():
            self._asked.clear()
            with self._noting:
                asking, self._asking = self._asking, set()
            name = re.sub(r"[^\w.-]+", "_", Path(self._title).stem) or "grasp"
            with self._errors_on_page():
                content = self.html().encode()
                # Others have left meanwhile.
                for client in asking & set(self._server.get_clients().values()):
                    client.send_file_download(f"{name}.html", content, save_immediately=True)
            self._stopped.wait(_SHARE_SECONDS)

    @contextlib.contextmanager
    def _errors_on_page(self) -> Iterator[None]:
        try:
            yield
        except (GraspForceError, ValueError, ArithmeticError) as error:
            self._controls.message.content = str(error)
        except Exception as error:  # noqa: BLE001 - what goes wrong once must not end the thread
            self._controls.message.content = f"{type(error).__name__}: {error}; the terminal shows where"
            # As the thread's end would do: its traceback goes to the terminal.
            threading.excepthook(threading.ExceptHookArgs((type(error), error, error.__traceback__, None)))

    def _follow(self) -> None:
        """Apply what clients have changed. Changes that arrive meanwhile are applied together."""
        while self._changed.wait() and not self._stopped.is_set():
            self._changed.clear()
            with self._turn, self._errors_on_page():
                self._apply_changes()
                self.update()
                self._controls.message.content = ""

    def _apply_changes(self) -> None:
        """Apply the moves and slider values that clients sent."""
        with self._noting:
            moved, self._moved = self._moved, set()
            released, self._released = self._released, set()
        try:
            self.state.scale(self._controls.friction.value, self._controls.limits.value)
            for contact in moved:
                self.state.move(contact, self._handles[contact].position)
        finally:
            # A handle goes back to where its contact has stayed: on the surface.
            for contact in released:
                self._handles[contact].position = tuple(self.state.grasp.positions[contact])

    def _quality(self) -> dict[str, Quality]:
        return {"max": self.state.quality("max"), "sum": self.state.quality("sum")}

    def _solution(self) -> ForceSolution | None:
        return self.state.forces(self.state.row_at(self._controls.row.value))

    def _numbers(self, quality: dict[str, Quality], solution: ForceSolution | None) -> str:
        if self._hand is None:
            return panel.numbers(self.state.grasp, quality, solution)
        notes = [
            *self._hand.notes,
            *(["The forces are those at rest."] if self._resting() is not None else []),
        ]
        return panel.numbers(self.state.grasp, quality, solution, self._hand.rows, notes)

    def _draw_forces(self, solution: ForceSolution | None) -> None:
        if solution is not None:
            rest = None if solution.balanced else solution.residual[:3]
            self._drawing.forces(self.state.grasp, solution.world_forces, solution.shares, rest)
        else:
            self._drawing.forces(self.state.grasp, self._resting(), None, None)

    def _resting(self) -> NDArray[np.float64] | None:
        """Return the forces of a hand at rest, unless wrenches are given that it balances instead."""
        return None if self._hand is None or len(self.state.wrenches) else self._hand.forces

    def _draw_hand(self, stage: float) -> None:
        if self._hand is not None and stage != self._stage:
            self._hand.move(stage)
            self._stage = stage

    def _contact_table(self, solution: ForceSolution | None) -> str:
        names = () if self._hand is None else self._hand.names
        if solution is not None:
            return panel.contact_table(self.state.grasp, solution.world_forces, solution.shares, names)
        return panel.contact_table(self.state.grasp, self._resting(), None, names)

    def _play(self) -> None:
        seconds = 1 / _FRAMES_PER_SECOND
        while not self._stopped.wait(seconds):
            if self._controls.playing.value:
                with self._errors_on_page():
                    self._controls.advance(self.state, seconds)


def serve(viewer: Viewer, announce: Callable[[], object]) -> None:
    """Announce the page and wait until someone presses Ctrl-C, then close it."""
    try:
        announce()
        while True:
            time.sleep(1)
    except KeyboardInterrupt:
        # The process ends now. To look for garbage in it costs more than closing hundreds of sockets.
        gc.freeze()
        viewer.stop()
