"""Contacts of a MuJoCo simulation."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np

from graspforce._core import unwarned_grasp
from graspforce._internal.checks import instance, known_options
from graspforce._internal.optional_imports import optional
from graspforce.errors import InvalidInputError, NoContactError

from .contact_reading import ContactReading, ReadingOptions


def from_mujoco(
    model: Any,
    data: Any,
    body: str | int,
    **options: Unpack[ReadingOptions],
) -> ContactReading:
    """Read the contacts on a body of a MuJoCo simulation.

    Contact dimension 1 is frictionless, 3 a hard finger, 4 and 6 a soft finger with the pair's torsional
    coefficient; rolling friction is left out. Of two different sliding coefficients the smaller is taken.
    MuJoCo's pyramidal cones lie inside the linearised cones of 8 edges here, and its elliptic ones are the
    true cones of ``edges=None``.

    The simulation belongs to one thread while it is read: nothing may step it meanwhile.

    Parameters
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        The simulation, after ``mj_forward`` or ``mj_step``. Both are only read.
    body : str or int
        Name or number of the body; bodies welded to it count as parts of it.
    **options
        ``max_normal_force``, ``edges``, ``origin`` (by default the body's centre of mass), ``length_scale``
        and ``friction_margin`` of `graspforce.Grasp`.

    Returns
    -------
    ContactReading
        The grasp, and MuJoCo's own contact forces on the body.

    Raises
    ------
    InvalidInputError
        There is no such body.
    NoContactError
        Nothing touches it.
    MissingExtraError
        MuJoCo is not installed.

    Examples
    --------
    A box rests on the floor: the least forces are no larger than MuJoCo's.

    >>> import mujoco
    >>> import graspforce as gf
    >>> model = mujoco.MjModel.from_xml_string(
    ...     "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='box' pos='0 0 0.049'>"
    ...     "<freejoint/><geom type='box' size='0.05 0.05 0.05' mass='1'/></body></worldbody></mujoco>"
    ... )
    >>> data = mujoco.MjData(model)
    >>> mujoco.mj_forward(model, data)
    >>> reading = gf.from_mujoco(model, data, "box", max_normal_force=50.0)
    >>> reading.grasp.normals.tolist() == [[0, 0, 1]] * 4
    True
    >>> least = gf.ForceDistributor(reading.grasp).solve(reading.external_wrench)
    >>> least.sigma_max <= reading.sigma_max * (1 + 1e-9)
    True
    """
    known_options(options, ReadingOptions.__annotations__)
    mujoco = optional("mujoco", "mujoco")
    instance("model", model, mujoco.MjModel)
    instance("data", data, mujoco.MjData)
    try:
        body_id = int(model.body(body).id)
    except (KeyError, IndexError, TypeError) as error:
        raise InvalidInputError(f"body: {body!r}: {error}") from None
    weld = model.body_weldid[model.geom_bodyid]
    rows, ids = [], []
    wrench = np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        ours = [geom >= 0 and weld[geom] == model.body_weldid[body_id] for geom in contact.geom]
        # A pair inside the body, or one within its margin but not yet touching, presses nothing.
        if ours[0] == ours[1] or contact.exclude:
            continue
        mujoco.mj_contactForce(model, data, i, wrench)
        # MuJoCo's frame and force are those of the second geom; the first feels the opposite.
        normal, tangent, _ = contact.frame.reshape(3, 3) * ([[1], [1], [1]] if ours[1] else [[-1], [1], [1]])
        force = wrench[:4] * (1, 1 if ours[1] else -1, 1, 1)
        mu = min(contact.friction[:2]) if contact.dim > 1 else 0.0
        gamma = contact.friction[2] if contact.dim > 3 else 0.0
        rows.append((contact.pos.copy(), normal, tangent, mu, gamma, force))
        ids.append(i)
    if not rows:
        raise NoContactError(f"body: nothing touches {body!r}")
    positions, normals, tangents, friction, torsion, forces = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    given: dict[str, Any] = {"origin": data.xipos[body_id].copy(), **options}
    soft = bool((torsion > 0).any())
    grasp = unwarned_grasp(
        positions, normals, friction, tangents=tangents, torsion=torsion if soft else None, **given
    )
    return ContactReading(grasp, forces[:, : grasp.force_dim], tuple(ids))
