"""Compiled loops, one a structure: whether there is one, and what it makes of a motion."""

from __future__ import annotations

import ctypes
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dynident.batch import Choice, Evaluation, Price
from dynident.closed_loop.compiled.body_numbers import BodyNumbers, obstacle
from dynident.closed_loop.compiled.c_loop import COUNTED, ENTRY, READ, WRITTEN
from dynident.closed_loop.compiled.loop_source import (
    STATUS,
    BodyStructure,
    LoopCode,
    loop_source,
    traced_part,
)
from dynident.closed_loop.mechanism import Mechanism, Past
from dynident.closed_loop.plant.drive import DriveNumbers, ReferenceSamples
from dynident.closed_loop.plant.point_force import can_be_traced
from dynident.closed_loop.stepped_motion import (
    WINDOW,
    Hold,
    Measurement,
    SteppedMotion,
    chattering,
    rms,
)

PRICE = Price(look_after=5_000, compile_after=5_000)
"""Samples of Drake's loop that are worth a compiler. The cache is asked no sooner: the same call
then makes the same motions, whatever was simulated before, here or elsewhere. Measured for 2 to 60
joints: a sample of a motion takes Drake 0.05 to 0.5 ms, the compiler, once, 0.6 to 12 s."""
MOST_STEPS = 13
"""Logarithm (base 2) of the most steps of a stretch: Drake takes no shorter ones either."""
_TIGHTER = 0.1
"""Our largest distance from the midpoint rule over Drake's: a step costs so much less that an
error like Drake's would be a waste."""
_POSES = 50
_KEPT = 32  # functions

_used: dict[Evaluation, None] = {}
_loops: dict[Hashable, CompiledLoop] = {}


def loop_evaluations() -> tuple[Evaluation, ...]:
    """Return how closed loops were simulated in this process, each way once."""
    return tuple(_used)


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopInput:
    """One motion to be made.

    Attributes
    ----------
    truth, nominal : the mechanism, and that inside the controller.
    through_model : whether the controller's feedback goes through it.
    drive : of n joints.
    reference : where the motion starts, and what it follows.
    measurement : (T, n).
    time : s, of the first sample.
    rate : samples per second.
    hold : of the commands.
    beyond : squared norm of a state that has run away.
    accuracy : as of Drake.
    steps : logarithms (base 2) of the fewest and the most steps of a stretch.
    """

    truth: BodyNumbers
    nominal: BodyNumbers
    through_model: bool
    drive: DriveNumbers
    reference: ReferenceSamples
    measurement: Measurement
    time: float
    rate: float
    hold: Hold
    beyond: float
    accuracy: float
    steps: tuple[int, int] = (0, MOST_STEPS)


class CompiledLoop:
    """The loop of a structure.

    Parameters
    ----------
    truth, nominal : mechanisms of that structure.
    """

    def __init__(self, truth: Mechanism, nominal: Mechanism) -> None:
        self._truth, self._nominal, self._memory = truth, nominal, truth.memory
        self.choice = Choice(lambda: self._source.text, ENTRY, "Drake", "-O2")

    @cached_property
    def obstacle(self) -> str:
        """Why there is none; empty if there may be."""
        for one in (self._truth, self._nominal):
            if one.others and not can_be_traced(traced_part(one).mechanisms[0]):
                labels = ", ".join(other.effect.label for other in one.others)
                return f"{labels} cannot be written as a formula"
        return ""

    @cached_property
    def _source(self) -> LoopCode:
        return loop_source(self._truth, self._nominal)

    def function(self, seen: int) -> Any | None:
        """Return the compiled function, if it is worth its price for some samples."""
        found = self.choice.function(seen, PRICE)
        _used.setdefault(self.choice.evaluation)
        return found

    def run(self, function: Any, given: LoopInput) -> SteppedMotion | str:
        """Return a motion, or why it could not be made.

        Parameters
        ----------
        function : of `function`.
        given : the motion to be made.
        """
        samples, n = given.drive.ahead.shape
        written = {
            "states": np.empty((samples, 2 * n + self._memory)),
            **{name: np.empty((samples, n)) for name in ("measured", "commands", "saturated")},
            "room": np.zeros(self._source.room),
            "found": np.zeros(3),
        }
        # They must live as long as the function reads them.
        numbers, counts = _numbers(given), _counts(given, samples)
        status = function(
            _pointers(numbers, READ), _pointers(counts, COUNTED), _pointers(written, WRITTEN)
        )
        if status != STATUS.index("DONE"):
            return _WHY[STATUS[status]]
        states = written["states"]
        q, v, memory = states[:, :n], states[:, n : 2 * n], states[:, 2 * n :]
        pace, whole = rms(given.reference.v), samples - samples % WINDOW
        for window in v[:whole].reshape(-1, WINDOW, n):
            if chattering(window, pace) is not None:
                return "it oscillates from sample to sample"
        acting, mean = given.hold.arrived(written["commands"])
        return SteppedMotion(
            q=q,
            v=v,
            measured=written["measured"],
            u=written["commands"],
            acting=acting,
            mean=mean,
            saturated=written["saturated"] > 0.0,
            past=Past(q, v, memory) if self._memory else None,
        )


_WHY = {
    "FAR": "it ran away",
    "SINGULAR": "its inertia is lost",
    "STIFF": "it is too stiff for the steps of the compiled loop",
}


def compiled_loop(truth: Mechanism, nominal: Mechanism) -> CompiledLoop | str:
    """Return the loop of a mechanism, made once a structure, or why there is none.

    Parameters
    ----------
    truth : that moves.
    nominal : inside its controller.
    """
    for one in (truth, nominal):
        if why := obstacle(one):
            return why
    key = BodyStructure.of(truth), BodyStructure.of(nominal)
    found = _loops.pop(key, None) or CompiledLoop(truth, nominal)
    while len(_loops) >= _KEPT:
        _loops.pop(next(iter(_loops)), None)
    _loops[key] = found
    return found.obstacle or found


def _numbers(given: LoopInput) -> dict[str, np.ndarray]:
    drive = given.drive
    blend = 1.0 if drive.blend is None else drive.blend
    settings = (given.time, given.rate, given.hold.rest, blend)
    bodies = {"truth": given.truth, "nominal": given.nominal}
    found = {f"{who}_{name}": x for who, one in bodies.items() for name, x in one.numbers.items()}
    found |= {
        "start": np.concatenate([given.reference.q[0], given.reference.v[0]]),
        "q_ref": drive.q_ref,
        "ahead": drive.ahead,
        "noise": given.measurement.noise,
        "resolution": given.measurement.resolution,
        "before": drive.before,
        "speed": drive.speed,
        "integral": drive.integral,
        "kp": drive.kp,
        "kd": drive.kd,
        "ki": drive.ki,
        "limit": drive.limit,
        "settings": np.array([*settings, given.beyond, _TIGHTER * given.accuracy]),
    }
    return {name: np.ascontiguousarray(x, dtype=float) for name, x in found.items()}


def _counts(given: LoopInput, samples: int) -> dict[str, np.ndarray]:
    bodies = {"truth": given.truth, "nominal": given.nominal}
    found = {f"{who}_{name}": x for who, one in bodies.items() for name, x in one.counts.items()}
    flags = (
        given.through_model,
        given.drive.integrates,
        bool(np.isfinite(given.drive.limit).any()),
        bool(np.any(given.measurement.noise)),
        bool(np.any(given.measurement.resolution > 0)),
    )
    every = max(1, samples // _POSES)
    whole = (samples, given.hold.late, *flags, *given.steps, every)
    return found | {"whole": np.array(whole, dtype=ctypes.c_long)}


def _pointers(arrays: Mapping[str, np.ndarray], names: Sequence[str]) -> Any:
    """Return where arrays begin, in an order; the caller keeps them."""
    return (ctypes.c_void_p * len(names))(*(arrays[name].ctypes.data for name in names))
