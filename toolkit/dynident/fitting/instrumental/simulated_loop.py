"""Instruments from the simulated closed loop (Janot, Vandanjon and Gautier, IDIM-IV, 2010).

In: the recordings, the controller of their loop, and one estimate after another. Out: the motions
that the robot of each estimate makes in that loop. One diagram serves all estimates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dynident.closed_loop import ClosedLoop, Controller, Mechanism, Retraced
from dynident.errors import FitError, SimulationError
from dynident.fitting.instrumental import standard_parameters as lift
from dynident.fitting.instrumental.gains import poses_of, retuned, stiffness
from dynident.fitting.instrumental.noise_level import position_noise
from dynident.fitting.instrumental.simulated_run import SimulatedRun
from dynident.fitting.instrumental.source import Guess, Instruments, prepared
from dynident.fitting.sampling import LEAST_ROWS
from dynident.model import InertiaMatrices, Model
from dynident.recording import Dataset, Recording, within
from dynident.robot import Robot

_TRANSIENT = 5.0
"""Transient in units of 1/w_n, as in the paper: of an offset at the start, (1 + 5) exp(-5) = 4 % is
left at critical damping."""
_MASSLESS = 0.02
"""Share of the expected inertia below which a start is not worth a simulation."""
_ITERATIONS = 5
"""Simulations that an estimate is expected to take."""
_DOUBT = 1.1
"""Distance of the simulated from the measured motion over that of the reference from it."""


@dataclass(frozen=True)
class SimulatedLoop(Instruments):
    """The robot of the last estimate in the recording's own closed loop.

    The simulated motion has no noise, and is as good an instrument as it is near to the true
    motion. Only the regressor comes from it: the torque stays the measured one.

    Attributes
    ----------
    controller : of the recorded loop: its structure must be the real one's.
    natural_frequency_hz : (n,) or one number; poles that the simulated loop keeps, with the damping
        of the stated gains: at each iteration its gains belong to the inertia of the estimate
        (equations 45 to 47). None: the gains as stated, which are the real loop's; only those of
        the start, if its inertia is not the expected one, are in proportion.
    lift : how base parameters become bodies: "minimum_norm" (nearest to the description, possible
        or not) or "consistent" (the nearest possible robot).
    nominal : the robot inside a computed torque or a feed-forward; None: the description.
    """

    controller: Controller
    natural_frequency_hz: float | Sequence[float] | None = None
    lift: Literal["minimum_norm", "consistent"] = "minimum_norm"
    nominal: Robot | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.controller, Controller):
            what = f"a {type(self.controller).__name__} where a Controller is needed"
            remedy = "give the study's: di.IV(study.controller); it needs a [controller] table"
            raise FitError(what, "instruments", remedy)
        if self.lift not in ("minimum_norm", "consistent"):
            remedy = 'choose "minimum_norm" or "consistent"'
            raise FitError(f"lift = {self.lift!r}", "instruments", remedy)
        if self.natural_frequency_hz is not None:
            given = np.atleast_1d(np.asarray(self.natural_frequency_hz, dtype=float))
            if given.shape not in ((1,), (self.controller.n,)) or not np.all(given > 0):
                remedy = "give one positive number, or one per joint"
                raise FitError(f"natural_frequency_hz = {given.tolist()}", "instruments", remedy)

    @property
    def name(self) -> str:
        """In words."""
        return "simulated closed loop"

    def prepare(self, model: Model, dataset: Dataset, guess: Guess) -> LoopSource:
        """Return the loop of a robot, ready to be simulated at any estimate.

        Raises
        ------
        FitError
            If a recording is shorter than the transient.
        SimulationError
            If a recording has no reference, or the controller does not suit the robot.
        """
        return LoopSource(self, model, prepared(dataset), guess)


@dataclass(frozen=True, eq=False)
class Projected:
    """The nearest possible robot: its parameters (p,), and the instruments that it makes."""

    values: np.ndarray
    instruments: Dataset


class LoopSource:
    """The closed loops of some recordings, as an `InstrumentSource`.

    Attributes
    ----------
    transient : s that each recording's window leaves out at its start.
    last_run : the latest simulation; None before the first.
    """

    iterates = True
    noise_share = 1.0

    def __init__(
        self, settings: SimulatedLoop, model: Model, dataset: Dataset, guess: Guess
    ) -> None:
        controller, n = settings.controller, model.robot.n
        if controller.n != n:
            what = f"a controller of {controller.n} joints for a robot of {n}"
            raise SimulationError(what, "controller", "give its gains for every joint")
        controller.simulated_rate()
        self._settings, self._model, self._progress = settings, model, guess.progress
        references = [_reference(one) for one in dataset.recordings]
        self._matrices = InertiaMatrices(model, poses_of(references))
        self._start = guess.start
        self._expected = self._expected_inertias(guess)
        self._stiffness = stiffness(controller, self._expected)
        for joint, k in zip(model.robot.names, self._stiffness, strict=True):
            if not k > 0:
                remedy = "nothing holds it at its reference: choose other instruments"
                raise SimulationError(f"kp = 0 at joint '{joint}'", "controller", remedy)
        # Of a double integrator under this feedback (equation 44).
        frequencies = np.sqrt(self._stiffness / self._expected)
        if settings.natural_frequency_hz is not None:
            given = 2 * np.pi * np.asarray(settings.natural_frequency_hz, dtype=float)
            controller = retuned(controller, given / frequencies)
            frequencies = np.broadcast_to(given, (n,)).copy()
        self._controller = controller
        self._frequencies = frequencies
        self.transient = float(_TRANSIENT / frequencies.min())
        cut = tuple(_without_transient(one, self.transient) for one in dataset.recordings)
        self.measured = replace(dataset, recordings=cut)
        self._loop = ClosedLoop(repeats=_ITERATIONS)
        self._last: tuple[Retraced, ...] = ()
        self.last_run: SimulatedRun | None = None

    @property
    def builds(self) -> int:
        """Diagrams built so far."""
        return self._loop.builds

    @property
    def notes(self) -> tuple[str, ...]:
        """Caveats, and the settings that the instruments rest on."""
        hertz = ", ".join(f"{f / (2 * np.pi):.3g}" for f in self._frequencies)
        saturated = max((float(one.saturated.max()) for one in self._last), default=0.0)
        found = [
            f"Instruments: simulated closed loop ({self._settings.controller.kind}), natural "
            f"frequencies {hertz} Hz, the first {self.transient:.3g} s of each recording dropped. "
            "They are right if the controller's structure is the real one's, and stay usable down "
            "to about half of the real bandwidth."
        ]
        if saturated > 0:
            found.append(
                f"The simulated torque is at its limit in up to {100 * saturated:.2g} % of the "
                "samples: there the loop does not have these natural frequencies."
            )
        return (*found, *self._loop.notes)

    def next_to_massless(self, values: np.ndarray) -> bool:
        """Whether a joint's inertia is far below what is expected of it.

        Noise that least squares cannot cope with makes that of it: such a robot under real
        friction takes steps of microseconds to simulate.
        """
        return bool(np.any(self._matrices.joint_inertias(values) < _MASSLESS * self._expected))

    def at(self, values: np.ndarray) -> Dataset:
        """Simulate an estimate; see `InstrumentSource.at`."""
        if self._settings.lift == "consistent":
            return self.projected(values).instruments
        self._matrices.require_positive(values)
        theta = lift.minimum_norm(self._model, values)
        return self._simulated(values, theta, self._feedback_scale(values, values))

    def projected(self, values: np.ndarray, root: np.ndarray | None = None) -> Projected:
        """Simulate the nearest possible robot.

        Parameters
        ----------
        values : (p,) an estimate.
        root : (r, p) of the information that the data hold; None: each parameter by the torque
            that a unit of it makes.
        """
        if root is None:
            root = np.diag(self._column_scale())
        found = lift.consistent(self._model, values, root)
        theta = found[: 10 * self._model.robot.n]
        rigid = self._model.base.coordinates(theta)
        nearest = np.concatenate([rigid, found[len(theta) :]])
        self._matrices.require_positive(nearest)
        scale = self._feedback_scale(values, nearest)
        return Projected(nearest, self._simulated(nearest, theta, scale))

    def verdict(self) -> str:
        """Return which joints are further from the measured motion than the reference is.

        The encoder's noise is in both distances and is taken off; within it no joint is reported.
        """
        names = self._model.robot.names
        simulated, reference, rows = np.zeros(len(names)), np.zeros(len(names)), 0
        for one, retraced in zip(self.measured.recordings, self._last, strict=True):
            inside = within(one.t, *(one.window or (one.t[0], one.t[-1])), one.where)
            assert one.q_ref is not None
            simulated += np.sum((retraced.recording.q - one.q)[inside] ** 2, axis=0)
            reference += np.sum((one.q_ref - one.q)[inside] ** 2, axis=0)
            rows += int(np.count_nonzero(inside))
        again = replace(self.measured, recordings=tuple(one.recording for one in self._last))
        noise = rows * position_noise(self, again) ** 2
        far, near = simulated - noise, np.maximum(reference - noise, noise)
        bad = [
            f"{name} ({np.sqrt(s / r):.2g} times as far)"
            for name, s, r in zip(names, far, near, strict=True)
            if s > _DOUBT**2 * r > 0
        ]
        if not bad:
            return ""
        what = "this the controller of the recorded loop (structure, gains, rate, delay)"
        if self._settings.natural_frequency_hz is not None:
            what = "this the controller of the recorded loop, and are its natural frequencies these"
        return (
            "the simulated motion is further from the measured one than the reference is, at "
            + ", ".join(bad)
            + f": is {what}?"
        )

    # --- inside --------------------------------------------------------------------------------

    def _simulated(self, values: np.ndarray, theta: np.ndarray, scale: np.ndarray) -> Dataset:
        recordings, model = self.measured.recordings, self._model
        bodies = {
            carries: Mechanism.of_model(model, values, theta, carries_payload=carries)
            for carries in {bool(one.payload) for one in recordings}
        }
        total = sum(one.duration for one in recordings)

        def progress(done: float, whole: float) -> None:
            self._progress("simulating", done, whole or total)

        self.last_run = SimulatedRun(
            values=values,
            mechanisms=tuple(bodies[bool(one.payload)] for one in recordings),
            recordings=tuple(recordings),
            controller=self._controller,
            nominal=self._settings.nominal or model.robot,
            feedback_scale=scale,
        )
        self._last = self.last_run.retraced(self._loop, progress)
        return replace(self.measured, recordings=tuple(one.recording for one in self._last))

    def _feedback_scale(self, asked: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Feedback of these values, (n,) times the stated; `asked` is what they were made of."""
        started = np.array_equal(asked, self._start)
        if started or self._settings.natural_frequency_hz is not None:
            return self._matrices.joint_inertias(values) / self._expected
        return np.ones(len(self._expected))

    def _expected_inertias(self, guess: Guess) -> np.ndarray:
        """Joint inertias before the first iteration: the largest expected of each.

        A description often lacks the motors' inertia, and least squares shrinks what it estimates
        from noisy accelerations: both err downwards.
        """
        for group in (guess.others, (guess.start,)):
            inertias = [self._matrices.joint_inertias(values) for values in group]
            sound = [J for J in inertias if np.all(np.isfinite(J)) and np.all(J > 0)]
            if sound:
                return np.max(sound, axis=0)
        remedy = 'start from "regular", or state natural_frequency_hz'
        raise SimulationError("no start has positive joint inertias", "instruments", remedy)

    def _column_scale(self) -> np.ndarray:
        scale = np.ones(self._model.size)
        base = self._model.base
        scale[: base.rank] = base.scale[list(base.independent)]
        return scale


def _reference(recording: Recording) -> np.ndarray:
    if recording.q_ref is None:
        remedy = (
            f"add columns q_ref.{recording.joints[0]}, ..., or take other instruments: "
            "di.fitting.SwappedPeriods() or di.fitting.Filtered(cutoff_hz)"
        )
        raise SimulationError("the recording has no reference", recording.where, remedy)
    return recording.q_ref


def _without_transient(recording: Recording, transient: float) -> Recording:
    start = float(recording.t[0]) + transient
    first, last = recording.window or (float(recording.t[0]), float(recording.t[-1]))
    first = max(first, start)
    if last - first < LEAST_ROWS / recording.rate_hz:
        what = (
            f"{recording.duration:.4g} s are shorter than the loop's transient, {transient:.3g} s"
        )
        remedy = "record longer, leave it out, or state the loop's natural_frequency_hz"
        raise FitError(what, recording.where, remedy)
    return recording.replace(window=(first, last))
