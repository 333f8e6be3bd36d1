"""The force of effects as one compiled function of a single instant.

An integrator asks for the force of one instant, thousands of times a second. Effects are written
for blocks of samples in NumPy, whose overhead on one sample is twenty times the arithmetic. Run
once on symbols, the same code gives a CasADi function that takes half a microsecond. Effects that
cannot be run on symbols (they branch on values, say) are evaluated as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dynident.closed_loop.mechanism import Mechanism

PointForce = Callable[[float, np.ndarray], np.ndarray]
"""(t, state (2 N,)) -> generalised force (N,), an array that the next call overwrites."""

_PROBES = 64
_AGREEMENT = 1e-9


def point_force(
    mechanisms: Sequence[Mechanism], starts: Sequence[float], place: np.ndarray
) -> PointForce | None:
    """Return what the effects of mechanisms side by side add to a plant's generalised force.

    That is minus what they take; None where they take nothing.

    Parameters
    ----------
    mechanisms : of n joints each, N in all.
    starts : s, added to the time of each.
    place : (N,) where each joint's speed stands in the plant's velocities, and its position in
        the plant's positions, which come first in the state.
    """
    distinct = list({id(one): one for one in mechanisms}.values())
    if not any(np.any(one.force(*_probes(one))) for one in distinct):
        return None
    try:
        if all(_agrees(one) for one in distinct):
            return _traced(mechanisms, starts, place)
    except Exception:  # code that is not symbolic fails in as many ways as there are
        pass
    return _plain(mechanisms, starts, place)


def _probes(mechanism: Mechanism) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng, shape = np.random.default_rng(0), (_PROBES, mechanism.robot.n)
    scale = np.geomspace(1e-3, 10.0, _PROBES)[:, None]
    t = rng.uniform(0.0, 1000.0, _PROBES)
    return t, rng.uniform(-3.0, 3.0, shape), rng.uniform(-1.0, 1.0, shape) * scale


def _agrees(mechanism: Mechanism) -> bool:
    t, q, v = _probes(mechanism)
    force = _traced([mechanism], [0.0], np.arange(mechanism.robot.n))
    found = np.array([-force(*instant) for instant in zip(t, np.hstack([q, v]), strict=True)])
    expected = mechanism.force(t, q, v)
    return bool(np.abs(found - expected).max() <= _AGREEMENT * np.abs(expected).max())


def _traced(
    mechanisms: Sequence[Mechanism], starts: Sequence[float], place: np.ndarray
) -> PointForce:
    import casadi

    n, size = mechanisms[0].robot.n, len(place)
    t, x = casadi.SX.sym("t"), casadi.SX.sym("x", 2 * size)
    added: list = [None] * size
    for k, (mechanism, start) in enumerate(zip(mechanisms, starts, strict=True)):
        own = place[k * n : k * n + n]
        # One sample of a block, as the effects expect it.
        q = np.array([[x[int(i)] for i in own]], dtype=object)
        v = np.array([[x[int(i) + size] for i in own]], dtype=object)
        force = mechanism.force(np.array([t + start], dtype=object), q, v)[0]
        for i, one in zip(own, force, strict=True):
            added[i] = -casadi.SX(one)
    function: Any = casadi.Function("force", [casadi.vertcat(t, x)], [casadi.vertcat(*added)])
    # The memory that the function reads and writes is these two arrays for good.
    inside, outside = np.zeros(1 + 2 * size), np.zeros(size)
    buffer, call = function.buffer()
    views: Any = (memoryview(inside), memoryview(outside))  # type: ignore[arg-type]
    buffer.set_arg(0, views[0])
    buffer.set_res(0, views[1])

    def evaluate(t: float, x: np.ndarray) -> np.ndarray:
        inside[0] = t
        inside[1:] = x
        call()
        return outside

    evaluate.buffer = buffer  # type: ignore[attr-defined]  # it must live as long as the function
    return evaluate


def _plain(
    mechanisms: Sequence[Mechanism], starts: Sequence[float], place: np.ndarray
) -> PointForce:
    n, size = mechanisms[0].robot.n, len(place)
    groups = []
    for one in {id(one): one for one in mechanisms}.values():
        rows = np.array([k for k, other in enumerate(mechanisms) if other is one])
        # Effects that are not a force (an inertia, a gain, a body) cost nothing here.
        probe = one.block(*_probes(one))
        acting = tuple(e for e in one.effects if np.any(e.effect.simulated_force(e.values, probe)))
        own = place.reshape(-1, n)[rows]
        groups.append((own, np.array(starts)[rows], replace(one, effects=acting)))
    added = np.zeros(size)

    def evaluate(t: float, x: np.ndarray) -> np.ndarray:
        for own, start, mechanism in groups:
            added[own] = -mechanism.force(start + t, x[own], x[own + size])
        return added

    return evaluate
