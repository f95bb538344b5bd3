"""The page: what is drawn, the sliders, and what happens when they move."""

from __future__ import annotations

import contextlib
import io
import threading
import time
import warnings
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, unwarned_grasp
from graspforce._internal.normal_limits import normal_limits
from graspforce.errors import GraspForceError, MissingExtraError

from .state import ViewState

try:
    import viser

    from .guard import Guard, guarded, is_loopback
    from .messages import Filter, one_of, within
except ModuleNotFoundError as error:
    raise MissingExtraError("viewer", error) from error

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from graspforce._core import ForceSolution

_OBJECT, _CONE, _FORCE, _WORST = (200, 192, 172), (120, 170, 220), (31, 95, 153), (192, 57, 43)
_UNBALANCED = (209, 118, 43)
_CONE_EDGES = 16
_LONGEST = 0.3
"""Length of the largest cone, and of the largest force, as a share of the object's size."""

_FRAMES_PER_SECOND = 20


def view(
    grasp: Grasp,
    mesh: tuple[ArrayLike, ArrayLike] | None = None,
    wrenches: ArrayLike | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
) -> Viewer:
    """Serve a grasp on a page of its own, at `Viewer.address`.

    Parameters
    ----------
    grasp, mesh, wrenches
        As for `ViewState`.
    host : str, optional
        The address to listen at. By default only this machine can reach it. Any other address raises a
        warning, because nothing is encrypted, not even the token.
    port : int, optional
        The port; the next free one where it is taken.

    Returns
    -------
    Viewer
        The running viewer. Threads of its own serve the page; any thread may call this.

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
    return Viewer(ViewState(grasp, mesh, wrenches), host=host, port=port)


def exposure(host: str) -> str:
    """Return the warning for an address that other machines can reach."""
    return (
        f"the viewer listens at {host}, where other machines can reach it: anyone with its address and "
        "token can see and move the grasp; nothing is encrypted"
    )


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

    def __init__(self, state: ViewState, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        self.state = state
        self._turn = threading.RLock()
        self._filter = Filter()
        self._guard = Guard(host, self._filter)
        with guarded(self._guard) as guarded_host:
            self._server = viser.ViserServer(host=guarded_host, port=port, label="graspforce", verbose=False)
        self.port = self._server.get_port()
        self.address = self._guard.address(self.port)
        if not self._guard.applied:
            self._server.stop()
            raise GraspForceError(f"viser {viser.__version__}: its server cannot be guarded; use viser 1.1")
        self._size = self._extent()
        self._metres_per_newton = _LONGEST * self._size / (self.state.largest_force() or 1.0)
        self._stopped = threading.Event()
        self._changed = threading.Event()
        self._noting = threading.Lock()
        self._moved: set[int] = set()
        self._released: set[int] = set()
        self._add_panel()
        self._add_object()
        self.update()
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._play, self._follow)]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Close the page."""
        self._stopped.set()
        self._changed.set()
        self._guard.close()
        for thread in self._threads:
            thread.join()
        # viser prints that it has stopped.
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def update(self) -> None:
        """Show the state as it is now."""
        with self._turn, self._server.atomic():
            quality = {criterion: self.state.quality(criterion) for criterion in ("max", "sum")}
            solution = self.state.forces(self._row.value) if len(self.state.wrenches) else None
            lines = [f"**epsilon {name}** {found.epsilon:.6g} N" for name, found in quality.items()]
            lines.append(f"**closure** {quality['max'].closure}")
            if solution is not None:
                lines.append(f"**forces** up to {100 * solution.sigma_max:.3g} % of the limit")
                lines += _unbalanced(solution)
            self._numbers.content = "\n\n".join(lines)
            self._draw_cones()
            self._draw_forces(solution)
            self._draw_worst(quality[self._criterion.value].direction)

    def _add_panel(self) -> None:
        gui = self._server.gui
        gui.configure_theme(dark_mode=False, show_logo=False, show_share_button=False)
        self._numbers = gui.add_markdown("")
        self._criterion = gui.add_dropdown("Worst wrench of", ("max", "sum"))
        fixed = not self.state.has_cones
        hints = ("factor of all coefficients", "factor of all limits")
        self._friction = gui.add_slider("Friction", 0.1, 2.0, 0.05, 1.0, disabled=fixed, hint=hints[0])
        self._limits = gui.add_slider("Force limits", 0.1, 3.0, 0.05, 1.0, disabled=fixed, hint=hints[1])
        rows = len(self.state.wrenches)
        self._row = gui.add_slider("Wrench", 0, max(1, rows - 1), 1, 0, disabled=rows < 2)
        self._playing = gui.add_checkbox("Play", initial_value=False, disabled=rows < 2)
        self._message = gui.add_markdown("")
        for handle in (self._friction, self._limits, self._criterion, self._row):
            handle.on_update(lambda _: self._changed.set())
        takes: list[tuple[Any, Callable[[Any], bool]]] = [(self._criterion, one_of("max", "sum"))]
        if not fixed:
            takes += [(self._friction, within(0.1, 2.0)), (self._limits, within(0.1, 3.0))]
        if rows > 1:
            takes += [(self._row, within(0, rows - 1)), (self._playing, one_of(False, True))]
        self._filter.controls = {identifier(control): values for control, values in takes}

    def _add_object(self) -> None:
        scene = self._server.scene
        scene.set_up_direction("+z")
        if self.state.mesh is not None:
            scene.add_mesh_simple("/object", *self.state.mesh, color=_OBJECT, opacity=0.6, side="double")
        self._handles = []
        for i, position in enumerate(self.state.grasp.positions):
            handle = scene.add_transform_controls(
                f"/contacts/{i}", scale=0.15 * self._size, disable_rotations=True, disable_sliders=True,
                position=position,
            )  # fmt: skip
            handle.on_update(partial(self._drag, i))
            self._handles.append(handle)
            self._filter.handles.add(handle.name)
        middle = self.state.grasp.positions.mean(axis=0)
        self._server.initial_camera.look_at = tuple(middle)
        self._server.initial_camera.position = tuple(middle + self._size * np.array([1.2, -1.2, 0.9]))

    def _drag(self, contact: int, event: Any) -> None:
        with self._noting:
            self._moved.add(contact)
            if event.phase == "end":
                self._released.add(contact)
        self._changed.set()

    def _follow(self) -> None:
        """Apply what clients have changed. Changes that arrive meanwhile are applied together."""
        while self._changed.wait() and not self._stopped.is_set():
            self._changed.clear()
            with self._turn:
                try:
                    self._apply_changes()
                    self.update()
                    self._message.content = ""
                except (GraspForceError, ValueError, ArithmeticError) as error:
                    self._message.content = str(error)

    def _apply_changes(self) -> None:
        """Apply the moves and slider values that clients sent."""
        with self._noting:
            moved, self._moved = self._moved, set()
            released, self._released = self._released, set()
        try:
            self.state.scale(self._friction.value, self._limits.value)
            for contact in moved:
                self.state.move(contact, self._handles[contact].position)
        finally:
            # A handle goes back to where its contact has stayed: on the surface.
            for contact in released:
                self._handles[contact].position = tuple(self.state.grasp.positions[contact])

    def _draw_cones(self) -> None:
        grasp, limits = self.state.grasp, normal_limits(self.state.grasp)
        # Where cones are true ones, or forces were given, what is drawn is the cone of the coefficient.
        cones = unwarned_grasp(
            grasp.positions, grasp.normals, grasp.friction, edges=_CONE_EDGES,
            friction_margin=grasp.friction_margin,
        )  # fmt: skip
        lengths = _LONGEST * self._size * limits / limits.max()
        fans = np.split(cones.extreme_forces, np.cumsum(cones.num_edges)[:-1])
        parts = zip(fans, cones.frames, cones.positions, lengths, strict=True)
        for i, (fan, frame, tip, length) in enumerate(parts):
            rim = tip - length * fan @ frame
            count = len(rim)
            triangles = np.array([(0, 1 + h, 1 + (h + 1) % count) for h in range(count)])
            self._server.scene.add_mesh_simple(
                f"/cones/{i}", np.vstack([tip, rim]), triangles, color=_CONE, opacity=0.35, side="double"
            )

    def _draw_forces(self, solution: ForceSolution | None) -> None:
        """Draw contact forces, and the unbalanced force at the origin, in one scale for all wrenches."""
        tips, origin = self.state.grasp.positions, self.state.grasp.origin
        shown, rest = np.zeros_like(tips), np.zeros_like(origin)
        if solution is not None:
            shown = self._metres_per_newton * solution.world_forces
            if not solution.balanced:
                rest = self._metres_per_newton * solution.residual[:3]
        self._arrows("/forces", np.stack([tips - shown, tips], axis=1), _FORCE)
        self._arrows("/unbalanced", np.stack([origin, origin + rest])[None], _UNBALANCED)

    def _draw_worst(self, direction: NDArray[np.float64]) -> None:
        """Draw the force of the worst disturbance, opposite to the weakest direction, at the origin."""
        force = -direction[:3]
        length = float(np.linalg.norm(force))
        start = self.state.grasp.origin
        end = start + (0.5 * self._size / length if length > 1e-9 else 0.0) * force
        self._arrows("/worst", np.stack([start, end])[None], _WORST)

    def _arrows(self, name: str, ends: NDArray[np.float64], color: tuple[int, int, int]) -> None:
        thick = 0.012 * self._size
        self._server.scene.add_arrows(
            name, ends, color, shaft_radius=thick, head_radius=2.2 * thick, head_length=5 * thick
        )

    def _play(self) -> None:
        while not self._stopped.wait(1 / _FRAMES_PER_SECOND):
            if self._playing.value:
                row = (self._row.value + 1) % len(self.state.wrenches)
                self._row.value = row  # type: ignore[misc] # declared read-only, meant to be assigned

    def _extent(self) -> float:
        points = self.state.grasp.positions
        if self.state.mesh is not None:
            points = np.vstack([points, self.state.mesh[0]])
        return float(np.ptp(points, axis=0).max()) or 1.0


def _unbalanced(solution: ForceSolution) -> list[str]:
    """Return the lines about a wrench that no forces balance."""
    if solution.balanced:
        return []
    # The residual of nearest forces is as exact as its gap: digits below are rounding.
    parts = solution.residual[:3], solution.residual[3:]
    force, torque = (round(float(np.linalg.norm(part)), 9) for part in parts)
    return [
        "No forces balance this wrench; the nearest ones within the limits are shown.",
        f"**unbalanced** {force:.3g} N, {torque:.3g} N m",
    ]


def identifier(control: Any) -> str:
    """Return the identifier by which clients name a control; viser does not publish it."""
    return str(control._impl.uuid)  # noqa: SLF001 - the tests drag and slide by it


def serve(viewer: Viewer, announce: Callable[[], object]) -> None:
    """Announce the page and wait until someone presses Ctrl-C, then close it."""
    try:
        announce()
        while True:
            time.sleep(1)
    except KeyboardInterrupt:
        viewer.stop()
