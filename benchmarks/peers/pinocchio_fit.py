"""A loop over Pinocchio's regressor and NumPy's least squares, as one writes them by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio
from answering import answer, least_squares

pin: Any = pinocchio  # its bindings carry no types


def solve(work: Any, _: dict[str, str]) -> np.ndarray:
    model = pin.buildModelFromXML(str(work["urdf"]))
    data = model.createData()
    q, v, a = work["q"], work["v"], work["a"]
    regressor = np.empty((*q.shape, 10 * q.shape[1]))
    for k in range(len(q)):
        regressor[k] = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
    return least_squares(regressor, work)


answer(solve)
