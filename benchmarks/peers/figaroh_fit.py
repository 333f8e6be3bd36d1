"""Regressor, base parameters by double QR and least squares of figaroh."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio
from answering import answer
from figaroh.tools.qrdecomposition import QRDecomposer  # pyright: ignore[reportMissingImports]
from figaroh.tools.regressor import (  # pyright: ignore[reportMissingImports]
    RegressorBuilder,
    RegressorConfig,
    build_regressor_reduced,
    get_index_eliminate,
)

pin: Any = pinocchio


def solve(work: Any, _: dict[str, str]) -> np.ndarray:
    model = pin.buildModelFromXML(str(work["urdf"]))
    robot = SimpleNamespace(model=model, data=model.createData())
    n = model.nv
    settings = RegressorConfig(has_friction=True, has_actuator_inertia=True)
    builder = RegressorBuilder(robot, settings)
    W = builder.build_basic_regressor(work["q"], work["v"], work["a"], {"act_idxv": list(range(n))})
    # Its columns: ten of each link, viscous and dry friction, rotors; no dry friction is sought.
    place = np.r_[: 10 * n, 12 * n : 13 * n, 10 * n : 11 * n]
    names = {f"p{k}": 0.0 for k in range(12 * n)}
    W = W[:, place]
    dropped, left = get_index_eliminate(W, names)
    tau = work["tau"].T.ravel()  # joint by joint
    found = QRDecomposer()
    _, _, _, values = found.double_decomposition(tau, build_regressor_reduced(W, dropped), left)
    theta = np.zeros(12 * n)
    columns = [int(name[1:]) for name in left]
    theta[np.array(columns)[list(found.base_indices)]] = values
    return theta


answer(solve)
