"""Six robots of one kind, that spread by nature."""

from __future__ import annotations

import numpy as np

from dynident import Model, Recording
from synthetic import arm, synthetic, true_values

NAMES = ("ada", "bob", "cleo", "dan", "eve", "fay")
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def robots(**odd: float) -> dict[str, Recording]:
    """Recordings of robots that spread by nature: inertias by 1 %, frictions by 5 %.

    Parameters
    ----------
    odd : factors of parameters of cleo.
    """
    kind, rng = model(), np.random.default_rng(1)
    truth = true_values(kind, **FRICTION)
    relative = np.array([0.05 if name.startswith("F") else 0.01 for name in kind.names])
    found = {}
    for number, name in enumerate(NAMES):
        values = truth * (1.0 + relative * rng.standard_normal(len(truth)))
        for parameter, factor in odd.items() if name == "cleo" else ():
            index = kind.names.index(parameter.replace("__", "@"))
            values[index] = factor * truth[index]
        found[name] = synthetic(
            kind, values, number, rate_hz=250.0, duration=8.0, position_std=1e-5, torque_std=0.2
        )
    return found
