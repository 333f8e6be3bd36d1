"""`dynident.fit` on the recording as it is, with the noise of rows, sigma and all it says."""

from __future__ import annotations

from typing import Any

import numpy as np
from answering import answer

import dynident as di


def solve(work: Any, settings: dict[str, str]) -> np.ndarray:
    robot = di.Robot.from_text(str(work["urdf"]))
    model = di.Model(robot) + "rotor_inertia" + "viscous_friction"
    torque: Any = str(work["torque"])
    recording = di.Recording(
        work["t_raw"], work["q_raw"], work["tau_raw"], robot.names, torque=torque
    )
    cutoff = float(work["cutoff_hz"])
    filtered = di.Filter(position_cutoff_hz=cutoff, edge_s=tuple(work["edge_s"]), ends="keep")
    errors: Any = settings.get("errors", "correlated")
    method = di.LeastSquares(errors=errors)
    found = di.fit(model, di.Dataset((recording,), filtered), method)
    n = robot.n
    theta = np.zeros(12 * n)
    theta[list(model.base.independent)] = found.values[: model.base.rank]
    for k, kind in enumerate(("Ia", "Fv")):
        for j, joint in enumerate(robot.names):
            theta[(10 + k) * n + j] = found.values[model.names.index(f"{kind}@{joint}")]
    return theta


answer(solve)
