"""A loop over mujoco-sysid's regressor and NumPy's least squares."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from answering import answer, least_squares
from mujoco_sysid.regressors import (  # pyright: ignore[reportMissingImports]
    joint_torque_regressor,
)

mj: Any = mujoco


def solve(work: Any, _: dict[str, str]) -> np.ndarray:
    model = mj.MjModel.from_xml_string(str(work["urdf"]))
    model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_LIMIT
    data = mj.MjData(model)
    q, v, a = work["q"], work["v"], work["a"]
    regressor = np.empty((*q.shape, 10 * q.shape[1]))
    for k in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[k], v[k], a[k]
        mj.mj_inverse(model, data)
        mj.mj_rnePostConstraint(model, data)
        regressor[k] = joint_torque_regressor(model, data)
    return least_squares(regressor, work)


answer(solve)
