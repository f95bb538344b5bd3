"""Joints that follow others, as a MuJoCo model states them."""

from __future__ import annotations

from typing import Any

import numpy as np

from graspforce._internal.optional_imports import optional

_COUPLED = 0.5  # rad: a tendon whose dead band is wider limits its joints, but does not couple them


def model_relations(model: Any) -> list[tuple[str, str, float, float]]:
    """List dependent joint, driver, ratio and offset, from equalities and short tendons of two joints."""
    mujoco = optional("mujoco", "hands")
    found = []
    for e in range(model.neq):
        joint_kind = int(model.eq_type[e]) == int(mujoco.mjtEq.mjEQ_JOINT)
        if joint_kind and model.eq_obj2id[e] >= 0 and not np.any(model.eq_data[e][2:5]):
            one, two = (model.joint(int(model.eq_obj1id[e])), model.joint(int(model.eq_obj2id[e])))
            offset, ratio = (float(x) for x in model.eq_data[e][:2])
            found.append((one.name, two.name, ratio, float(one.qpos0[0] + offset - ratio * two.qpos0[0])))
    for t in range(model.ntendon):
        first, count = int(model.tendon_adr[t]), int(model.tendon_num[t])
        kinds = model.wrap_type[first : first + count]
        if count != 2 or (kinds != int(mujoco.mjtWrap.mjWRAP_JOINT)).any() or not model.tendon_limited[t]:
            continue
        ends = [int(j) for j in model.wrap_objid[first : first + 2]]
        coefficients = [float(c) for c in model.wrap_prm[first : first + 2]]
        # The joint further from the palm depends on the other one.
        if int(model.jnt_bodyid[ends[0]]) < int(model.jnt_bodyid[ends[1]]):
            ends, coefficients = ends[::-1], coefficients[::-1]
        (own, driving), (low, high) = coefficients, model.tendon_range[t]
        if own * driving >= 0 or (high - low) / abs(own) > _COUPLED:
            continue
        # An object that presses on the tip takes up the dead band: the dependent joint is flexed the least.
        bends_up = abs(model.jnt_range[ends[0]][1]) >= abs(model.jnt_range[ends[0]][0])
        at = low if bends_up == (own > 0) else high
        found.append((model.joint(ends[0]).name, model.joint(ends[1]).name, -driving / own, float(at) / own))
    return found
