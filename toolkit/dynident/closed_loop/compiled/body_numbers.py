"""The numbers of a mechanism as the compiled loop takes them, and which ones it cannot take."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dynident.closed_loop.compiled.c_body import LAWS
from dynident.closed_loop.compiled.loop_source import traced_part
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.plant.point_force import parameters_of
from dynident.closed_loop.plant.side_by_side import is_coupled


@dataclass(frozen=True, eq=False)
class BodyNumbers:
    """Arrays by the names of `BODY_NUMBERS`, and by those of `BODY_COUNTS`."""

    numbers: Mapping[str, np.ndarray]
    counts: Mapping[str, np.ndarray]


def obstacle(mechanism: Mechanism) -> str:
    """Return why a mechanism's accelerations are no formulas; empty if they are."""
    for one in mechanism.effects:
        if one.effect.simulated_transmission(one.values, mechanism.robot) is not None:
            return f"{one.effect.label} gives way"
    phi = mechanism.robot.theta.reshape(-1, 10)
    if np.any((phi[:, 0] == 0.0) & np.any(phi[:, 1:4] != 0.0, axis=1)):
        return "a body has a first moment without mass"
    return ""


def body_numbers(mechanism: Mechanism, start: float = 0.0) -> BodyNumbers:
    """Return the numbers of a mechanism without `obstacle`.

    Parameters
    ----------
    mechanism : Mechanism
    start : s, added to its time.
    """
    n, widths = mechanism.robot.n, mechanism.friction_widths
    units: dict[tuple[str, tuple[int, ...], float], list[tuple[int, float]]] = {}
    for term in mechanism.terms:
        of = () if term.law == "constant" else tuple(sorted(term.of))
        # Of joints with friction of several widths, the widest.
        slope = 1.0 / float(widths[list(term.of)].max()) if term.law == "sign" else 1.0
        units.setdefault((term.law, of, slope), []).append((term.at, term.coefficient))
    rows, joints, links = [], [], []
    for (law, of, _), acting in units.items():
        joints += of
        links += acting
        rows += [LAWS.index(law), len(joints), len(links)]
    inertia, loss = np.array(mechanism.inertia), mechanism.loss
    flags = [is_coupled(inertia), bool(np.any(loss)), len(units)]
    values = parameters_of(traced_part(mechanism, start))
    numbers = {
        "theta": mechanism.robot.theta,
        "inertia": inertia.reshape(n * n),
        "gain": mechanism.gain,
        "loss": loss,
        "widths": widths,
        "values": values,
        "slopes": [slope for _, _, slope in units],
        "factors": [coefficient for _, coefficient in links],
    }
    counts = {"flags": flags, "units": rows, "of": joints, "links": [at for at, _ in links]}
    return BodyNumbers(
        {name: np.ascontiguousarray(x, dtype=float) for name, x in numbers.items()},
        {name: np.ascontiguousarray(x, dtype=ctypes.c_long) for name, x in counts.items()},
    )
