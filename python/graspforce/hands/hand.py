"""A hand: its joints with their limits, how they are coupled, and its fingertips."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError

from .hand_data import HandData
from .hand_model import HandModel, read_hand
from .model_file import spec_from_file

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .pose import HandPose

    Array = NDArray[np.float64]


class Hand(HandData):
    """A multifingered hand with a free wrist, as planning and simulation see it.

    Parameters
    ----------
    spec : mujoco.MjSpec or mujoco.MjModel
        The model, which is only read. `Hand.load` reads files.
    fingertips : sequence
        Two or more tips, each by the name of a body, geom or site. A mapping with the fields ``name``,
        ``radius``, ``position``, ``axis`` and ``half_length`` gives a sphere or capsule in the frame of the
        body, in m; ``pad`` is the direction in which it presses.
    palm : str, optional
        Body whose frame is the pose of the hand. By default the deepest body that holds all fingers.
    root : str, optional
        Body above the palm down from which the model belongs to the hand. The joints between the two are
        fixed. By default the palm itself.
    coupling : array_like or mapping, optional
        (n, k) matrix C of q = C z, a pair of C and an offset (n,) in rad, or for each dependent joint
        ``{"joint": driver, "ratio": 1.1, "offset": 0.0}``. By default as the model's tendons and equality
        constraints say.
    pads : array_like or mapping, optional
        Direction (3,) in which tips press, in the frames of their bodies: one for all, or by tip.
    joint_limits : mapping, optional
        Lower and upper limits in rad by joint, in place of the model's.
    torque_limits, stiffness, damping, armature : float or mapping, optional
        Torque limit in N m, stiffness of the position servo in N m/rad, damping in N m s/rad and armature in
        kg m^2: one for all joints or by joint, in place of the model's. A servo of unknown stiffness reaches
        its torque limit at 0.25 rad. A joint without damping gets 0.03 s times its stiffness: undamped
        fingers diverge in simulation.
    posture : mapping, optional
        Joint positions in rad of an open, preshaped hand. The search for grasps starts around it. Other
        joints are at a third of their range from the end nearest to 0.
    name : str, optional
        Name in tables and pictures.

    Attributes
    ----------
    joints : tuple of str
        Names of all n joints below the palm, in the order of the model.
    joint_limits : numpy.ndarray
        (n, 2) in rad.
    torque_limits : numpy.ndarray
        (n,) in N m; infinite for joints that follow others.
    stiffness, damping, armature : numpy.ndarray
        (n,) of the servos.
    coupling, coupling_offset : numpy.ndarray
        C (n, k) and c (n,) of q = C z + c, where z are the driven joints.
    driven : numpy.ndarray
        (k,) numbers of the driven joints.
    fingertips : tuple of Fingertip
        The tips in the order given.
    posture : numpy.ndarray
        (n,) in rad.
    name : str
        Name in tables and pictures.
    source : dict or None
        What makes the hand again when a plan is loaded: a preset or a hand file.

    Raises
    ------
    InvalidInputError
        A name is unknown (the error lists the candidates), a joint has no limits, a torque limit is missing
        or not positive, or the coupling leaves a joint no range.
    MissingExtraError
        MuJoCo is not installed.

    Notes
    -----
    Nothing of it changes once it is made: threads may share it. It can be copied and pickled.

    Examples
    --------
    >>> import graspforce as gf
    >>> import mujoco
    >>> finger = (
    ...     '<body name="{0}" pos="{1} 0 0">'
    ...     '<joint name="{0}" axis="0 1 0" range="-1 1" actuatorfrcrange="-1 1"/>'
    ...     '<geom name="{0}_tip" type="capsule" size="0.01" fromto="0 0 0 0 0 0.08"/></body>'
    ... )
    >>> fingers = finger.format("left", -0.04) + finger.format("right", 0.04)
    >>> palm = f'<body name="palm"><geom type="box" size=".05 .02 .01" pos="0 0 -.02"/>{fingers}</body>'
    >>> spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{palm}</worldbody></mujoco>")
    >>> hand = gf.hands.Hand(spec, ["left_tip", "right_tip"])
    >>> hand.joints, hand.torque_limits.tolist()
    (('left', 'right'), [1.0, 1.0])
    """

    __slots__ = ()

    def __init__(
        self,
        spec: Any,
        fingertips: Sequence[str | Mapping[str, Any]],
        *,
        palm: str | None = None,
        root: str | None = None,
        coupling: ArrayLike | Mapping[str, Any] | None = None,
        pads: ArrayLike | Mapping[str, ArrayLike] | None = None,
        joint_limits: Mapping[str, tuple[float, float]] | None = None,
        torque_limits: float | Mapping[str, float] | None = None,
        stiffness: float | Mapping[str, float] | None = None,
        damping: float | Mapping[str, float] | None = None,
        armature: float | Mapping[str, float] | None = None,
        posture: Mapping[str, float] | None = None,
        name: str | None = None,
    ) -> None:
        if not isinstance(spec, HandModel):
            mujoco = optional("mujoco", "hands")
            if not isinstance(spec, mujoco.MjSpec | mujoco.MjModel):
                raise InvalidInputError(
                    f"spec: {spec!r} is neither a mujoco.MjSpec nor a mujoco.MjModel; see Hand.load"
                )
            try:
                model = spec.copy().compile() if isinstance(spec, mujoco.MjSpec) else spec
            except (ValueError, RuntimeError) as error:
                raise InvalidInputError(f"spec: MuJoCo cannot compile it: {error}") from None
            spec = read_hand(model, palm, root)
        options = {
            "coupling": coupling, "pads": pads, "joint_limits": joint_limits, "torque_limits": torque_limits,
            "stiffness": stiffness, "damping": damping, "armature": armature, "posture": posture,
            "name": name,
        }  # fmt: skip
        super().__init__(spec, fingertips, options)

    @staticmethod
    def load(
        path: str | os.PathLike[str],
        fingertips: Sequence[str | Mapping[str, Any]] | None = None,
        *,
        package_dirs: Sequence[str | os.PathLike[str]] | None = None,
        **options: Any,
    ) -> Hand:
        """Read a hand from a hand file (YAML, JSON), or from an MJCF or URDF file.

        Safe to call from several threads.

        Parameters
        ----------
        path : path-like
            ``.yaml``, ``.yml`` or ``.json`` for a hand file, which states everything itself; any other suffix
            for a model.
        fingertips : sequence, optional
            As for `Hand`; needed for a model.
        package_dirs : sequence of path-like, optional
            Folders in which ``package://NAME/...`` of a URDF is looked for. The folders above the URDF are
            tried, too.
        **options
            As for `Hand`.

        Raises
        ------
        InvalidFileError
            The file cannot be read, is no hand file or model, or names a file that is not there.
        InvalidInputError
            As for `Hand`.

        Examples
        --------
        >>> import graspforce as gf
        >>> hand = gf.hands.Hand.load("hand.urdf", ["thumb_tip", "index_tip"])  # doctest: +SKIP
        """
        path = Path(path)
        folders = [Path(folder) for folder in package_dirs or ()]
        if path.suffix.lower() in (".yaml", ".yml", ".json"):
            from .hand_file import read_hand_file  # noqa: PLC0415 - pydantic only where a hand file is read

            if fingertips is not None or options or folders:
                raise InvalidInputError(
                    "fingertips, package_dirs and other options: a hand file states them itself"
                )
            file = read_hand_file(path)
            try:
                hand = Hand(file.spec, file.fingertips, **file.options)
            except InvalidInputError as error:
                raise file.error(error) from None
            hand.source = {"file": str(path.resolve())}
            return hand
        if fingertips is None:
            raise InvalidInputError(
                f"fingertips: missing, and {path} is no hand file (YAML, JSON) that names them; give bodies, "
                "geoms or sites of the tips"
            )
        return Hand(spec_from_file(path, folders), fingertips, **options)

    def surface(
        self, palm: ArrayLike, joints: ArrayLike, *, forearm: bool = True
    ) -> tuple[Array, NDArray[np.int64]]:
        """Return vertices (V, 3) in m and triangles (F, 3) of the hand, for pictures.

        `palm` is its pose (4, 4), `joints` are positions (n,) in rad. Visual meshes are shown where the model
        has them, elsewhere the shapes that collide. False for `forearm` leaves out bodies behind the wrist.
        """
        from .surface import hand_surface  # noqa: PLC0415 - for pictures alone

        return hand_surface(self, palm, joints, forearm=forearm)

    def reach(self, positions: ArrayLike, normals: ArrayLike, mesh: Any = None, **options: Any) -> HandPose:
        """Find a pose whose fingertips touch given contacts; see `graspforce.hands.reach`."""
        from .reaching import reach  # noqa: PLC0415 - mink only where it is asked for

        return reach(self, positions, normals, mesh, **options)

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return _restored, (self._model, self._arguments, self.source)


def _restored(model: HandModel, arguments: dict[str, Any], source: dict[str, Any] | None) -> Hand:
    if not isinstance(model, HandModel):
        raise InvalidInputError("state: model, expected that of a hand")
    hand = Hand(model, **arguments)
    hand.source = source
    return hand
