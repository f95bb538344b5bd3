"""The page: what is drawn, the sliders, and what happens when they move."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from graspforce._core import Grasp, unwarned_grasp
from graspforce.errors import GraspForceError, MissingExtraError

from .state import ViewState

try:
    import viser
except ModuleNotFoundError as error:
    raise MissingExtraError("viewer", error) from error

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

__all__ = ["Viewer", "view"]

_OBJECT, _CONE, _FORCE, _WORST = (200, 192, 172), (120, 170, 220), (31, 95, 153), (192, 57, 43)
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
    """Serve a grasp on a page of its own; parameters as for `ViewState`, then the address to listen at.

    Anyone who can reach the address can move the sliders, so by default only this machine can.

    Threads of its own serve the page; any thread may call this.
    """
    return Viewer(ViewState(grasp, mesh, wrenches), host=host, port=port)


class Viewer:
    """A running viewer; its callbacks come from viser's threads and take turns.

    Attributes
    ----------
    state : ViewState
        What is shown.
    port : int
        Where the page is served.
    """

    def __init__(self, state: ViewState, *, host: str = "127.0.0.1", port: int = 8080) -> None:
        self.state = state
        self._turn = threading.RLock()
        self._server = viser.ViserServer(host=host, port=port, label="graspforce", verbose=False)
        self.port = self._server.get_port()
        self._size = self._extent()
        self._metres_per_newton = _LONGEST * self._size / (self.state.largest_force() or 1.0)
        self._stopped = threading.Event()
        self._add_panel()
        self._add_object()
        self.update()
        self._player = threading.Thread(target=self._play, daemon=True)
        self._player.start()

    def stop(self) -> None:
        """Close the page."""
        self._stopped.set()
        self._player.join()
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
            elif len(self.state.wrenches):
                lines.append("**forces** none balance this wrench")
            self._numbers.content = "\n\n".join(lines)
            self._draw_cones()
            self._draw_forces(None if solution is None else solution.world_forces)
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
        for handle in (self._friction, self._limits):
            handle.on_update(self._rescale)
        self._criterion.on_update(lambda _: self.update())
        self._row.on_update(lambda _: self.update())

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
        middle = self.state.grasp.positions.mean(axis=0)
        self._server.initial_camera.look_at = tuple(middle)
        self._server.initial_camera.position = tuple(middle + self._size * np.array([1.2, -1.2, 0.9]))

    def _rescale(self, _event: Any) -> None:
        with self._turn:
            self.state.scale(self._friction.value, self._limits.value)
            self.update()

    def _drag(self, contact: int, event: Any) -> None:
        with self._turn:
            try:
                self.state.move(contact, event.target.position)
                self._message.content = ""
            except GraspForceError as error:
                self._message.content = str(error)
            # The handle goes back to where its contact has stayed: on the surface.
            if event.phase == "end":
                event.target.position = tuple(self.state.grasp.positions[contact])
            self.update()

    def _normal_limits(self) -> NDArray[np.float64]:
        """Of each contact the largest normal force in N: its limit, or that of the forces given for it."""
        grasp = self.state.grasp
        if self.state.has_cones:
            return grasp.max_normal_force
        normals = np.split(grasp.extreme_forces[:, 0], np.cumsum(grasp.num_edges)[:-1])
        return np.array([of_contact.max(initial=0.0) for of_contact in normals])

    def _draw_cones(self) -> None:
        grasp, limits = self.state.grasp, self._normal_limits()
        # Where cones are true ones, or forces were given, what is drawn is the cone of the coefficient.
        cones = unwarned_grasp(
            grasp.positions,
            grasp.normals,
            grasp.friction,
            edges=_CONE_EDGES,
            friction_margin=grasp.friction_margin,
        )
        lengths = _LONGEST * self._size * limits / (limits.max() or 1.0)
        fans = np.split(cones.extreme_forces, np.cumsum(cones.num_edges)[:-1])
        parts = zip(fans, cones.frames, cones.positions, lengths, strict=True)
        for i, (fan, frame, tip, length) in enumerate(parts):
            rim = tip - length * fan @ frame
            count = len(rim)
            triangles = [(0, 1 + h, 1 + (h + 1) % count) for h in range(count)]
            self._server.scene.add_mesh_simple(
                f"/cones/{i}",
                np.vstack([tip, rim]),
                np.array(triangles),
                color=_CONE,
                opacity=0.35,
                side="double",
            )

    def _draw_forces(self, forces: NDArray[np.float64] | None) -> None:
        """Draw them as long as the largest of all wrenches allows; cones are as long as the limits."""
        tips = self.state.grasp.positions
        shown = np.zeros_like(tips) if forces is None else self._metres_per_newton * forces
        self._arrows("/forces", np.stack([tips - shown, tips], axis=1), _FORCE)

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


def serve(viewer: Viewer, announce: Callable[[], object]) -> None:
    """Announce the page and wait until someone presses Ctrl-C, then close it."""
    try:
        announce()
        while True:
            time.sleep(1)
    except KeyboardInterrupt:
        viewer.stop()
