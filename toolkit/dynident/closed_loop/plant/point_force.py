"""The force of effects as one compiled function of a single instant.

For the effects that are more than a sum of terms (`Effect.simulated_terms`). An integrator asks for
the force of one instant, thousands of times a second. Effects are written for blocks of samples in
NumPy, whose overhead on one sample is twenty times the arithmetic. Run once on symbols, the same
code gives a CasADi function that takes half a microsecond; the values of the effects stay symbols,
so that other values need no other function. Effects that cannot be run on symbols (they branch on
values, say) are evaluated as they are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.plant.side_by_side import Bodies

_PROBES = 64
_AGREEMENT = 1e-9


class PointForce(Protocol):
    """What effects add to a plant's generalised force: minus what they take."""

    def set(self, bodies: Bodies) -> None:
        """Take other values, of the same effects, and other times at which motions start."""
        ...

    def __call__(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the force (N,) at t, state (2 N,) and memory (M,); the next call overwrites it."""
        ...

    def rate(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rate of the memory (M,), per s; the next call overwrites it.

        Parameters
        ----------
        t : s.
        x : (2 N,) state of the plant.
        z : (M,) memory.
        """
        ...


def point_force(bodies: Bodies) -> PointForce:
    """Return the force of effects, as fast as they allow."""
    if all(can_be_traced(one) for one in bodies.distinct):
        return TracedForce(bodies)
    return PlainForce(bodies)


def can_be_traced(mechanism: Mechanism) -> bool:
    """Whether its effects can be run on symbols, and their force is then their force."""
    try:
        return _agrees(mechanism)
    except Exception:  # code that is not symbolic fails in as many ways as there are
        return False


def _agrees(mechanism: Mechanism) -> bool:
    n, rng = mechanism.robot.n, np.random.default_rng(0)
    scale = np.geomspace(1e-3, 10.0, _PROBES)[:, None]
    t = rng.uniform(0.0, 1000.0, _PROBES)
    q = rng.uniform(-3.0, 3.0, (_PROBES, n))
    v = rng.uniform(-1.0, 1.0, (_PROBES, n)) * scale
    # Not at the given values: they may be zero, and others are to come.
    other = tuple(
        replace(one, values=tuple(rng.uniform(0.5, 2.0, len(one.values))))
        for one in mechanism.effects
    )
    probed = replace(mechanism, effects=other)
    force = TracedForce(Bodies((mechanism,), (0.0,), np.arange(n)))
    force.set(Bodies((probed,), (0.0,), np.arange(n)))
    z = rng.uniform(-1.0, 1.0, (_PROBES, mechanism.memory))
    instants = list(zip(t, np.hstack([q, v]), z, strict=True))
    found = np.array([[*-force(*one), *force.rate(*one)] for one in instants])
    expected = np.hstack([probed.force(t, q, v, z), probed.memory_rate(t, q, v, z)])
    return bool(np.abs(found - expected).max() <= _AGREEMENT * np.abs(expected).max())


def traced(bodies: Bodies, name: str = "force") -> Any:
    """Return the force as a CasADi function.

    Its one input is t, the state (2 N,), the memory (M,) and `parameters_of` bodies, one after the
    other; its one output the force (N,) and the rates of the memory (M,).

    Parameters
    ----------
    bodies : whose effects can be run on symbols.
    name : of the function.
    """
    import casadi

    mechanisms, place = bodies.mechanisms, bodies.place
    n, size = mechanisms[0].robot.n, len(place)
    t, x = casadi.SX.sym("t"), casadi.SX.sym("x", 2 * size)
    memory = casadi.SX.sym("z", bodies.memory)
    parameters = casadi.SX.sym("p", len(parameters_of(bodies)))
    left, states = iter(casadi.vertsplit(parameters)), iter(casadi.vertsplit(memory))
    starts = [next(left) for _ in mechanisms]
    added: list = [None] * size
    rates: list = []
    for k, (mechanism, start) in enumerate(zip(mechanisms, starts, strict=True)):
        own = place[k * n : k * n + n]
        # One sample of a block, as the effects expect it.
        q = np.array([[x[int(i)] for i in own]], dtype=object)
        v = np.array([[x[int(i) + size] for i in own]], dtype=object)
        block = mechanism.block(np.array([t + start], dtype=object), q, v)
        force = [casadi.SX(0.0)] * n
        for one in mechanism.effects:
            given: Any = [next(left) for _ in one.values]
            seen = block
            if one.effect.memory:
                z = [[next(states) for _ in range(one.effect.memory)]]
                seen = replace(block, memory=np.array(z, dtype=object))
                rates += [casadi.SX(r) for r in one.effect.simulated_rate(given, seen)[0]]
            # A force is linear in the values: it is traced value by value.
            for value, unit in zip(given, np.eye(len(given)).tolist(), strict=True):
                per_unit = one.effect.simulated_force(unit, seen)[0]
                force = [f + value * casadi.SX(x) for f, x in zip(force, per_unit, strict=True)]
        for i, one in zip(own, force, strict=True):
            added[i] = -one
    inputs = casadi.vertcat(t, x, memory, parameters)
    return casadi.Function(name, [inputs], [casadi.densify(casadi.vertcat(*added, *rates))])


class TracedForce(PointForce):
    """The force as a CasADi function of t, state, starts and values."""

    def __init__(self, bodies: Bodies) -> None:
        function, size = traced(bodies), len(bodies.place)
        # The memory that the function reads and writes is these two arrays for good; the buffer
        # must live as long as they are used.
        self._inside, outside = np.zeros(function.numel_in(0)), np.zeros(function.numel_out(0))
        self._outside, self._rates = outside[:size], outside[size:]
        self._buffer, self._call = function.buffer()
        views: Any = (memoryview(self._inside), memoryview(outside))  # type: ignore[arg-type]
        self._buffer.set_arg(0, views[0])
        self._buffer.set_res(0, views[1])
        end = 1 + 2 * size
        self._state, self._memory = self._inside[1:end], self._inside[end : end + bodies.memory]
        self.set(bodies)

    def set(self, bodies: Bodies) -> None:
        """Take other values and starts."""
        self._inside[1 + len(self._state) + len(self._memory) :] = parameters_of(bodies)

    def __call__(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the force."""
        self._inside[0] = t
        self._state[:] = x
        self._memory[:] = z
        self._call()
        return self._outside

    def rate(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rate of the memory."""
        self(t, x, z)
        return self._rates


def parameters_of(bodies: Bodies) -> list[float]:
    """Return the starts of motions, then the values of all effects."""
    values = [x for body in bodies.mechanisms for one in body.effects for x in one.values]
    return [*bodies.starts, *values]


class PlainForce(PointForce):
    """The force as the effects themselves evaluate it."""

    def __init__(self, bodies: Bodies) -> None:
        self._added, self._rates = np.zeros(len(bodies.place)), np.zeros(bodies.memory)
        self.set(bodies)

    def set(self, bodies: Bodies) -> None:
        """Take other values and starts."""
        self._groups = []
        first = np.cumsum([0, *(one.memory for one in bodies.mechanisms)])
        for one in bodies.distinct:
            rows = np.array([k for k, other in enumerate(bodies.mechanisms) if other is one])
            own = bodies.place.reshape(-1, one.robot.n)[rows]
            kept = first[rows][:, None] + np.arange(one.memory)
            self._groups.append((own, kept, np.array(bodies.starts)[rows], one))

    def __call__(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the force."""
        size = len(self._added)
        for own, kept, start, mechanism in self._groups:
            self._added[own] = -mechanism.force(start + t, x[own], x[own + size], z[kept])
        return self._added

    def rate(self, t: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the rate of the memory."""
        size = len(self._added)
        for own, kept, start, mechanism in self._groups:
            motion = start + t, x[own], x[own + size]
            self._rates[kept] = mechanism.memory_rate(*motion, z[kept])
        return self._rates
