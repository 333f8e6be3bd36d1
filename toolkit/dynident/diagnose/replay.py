"""The recorded loop once more, with the identified robot in it: the verb `validate`."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dynident.closed_loop import Controller, Mechanism
from dynident.diagnose.control_law import law_torque, settling_time
from dynident.diagnose.diagnosis import NoiseSource
from dynident.diagnose.loop_run import QUANTITIES, LoopRun, Signals, Skipped
from dynident.diagnose.noise import differences
from dynident.diagnose.validation import Unsimulated, Validation
from dynident.errors import DynidentError, DynidentWarning, RecordingError, SimulationError
from dynident.fit.estimate import Estimate
from dynident.fit.least_squares import sources_of
from dynident.fit.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording, mismatch, periods, uniform
from dynident.threads import single_threaded

if TYPE_CHECKING:
    from dynident.closed_loop.retrace import Retraced

Progress = Callable[[float, float], None]
"""(s simulated, s to simulate)."""

_REPEATS = 0.3
"""Mismatch of two periods, relative to the motion, above which nothing repeats."""


@single_threaded
def validate(
    estimate: Estimate,
    dataset: Dataset,
    controller: Controller,
    *,
    progress: Progress | None = None,
) -> Validation:
    """Simulate the identified robot in the loop that was recorded, and compare the motion.

    Each recording's reference is followed once more, by the identified robot under the stated
    controller, from the reference's beginning. Simulation and measurement pass the same filters
    (`Dataset.filter`), and the loop's settling time is dropped. A second judge beside the torque
    residual (Janot, Vandanjon and Gautier): a model in feedback must also move as the robot did.

    Parameters
    ----------
    estimate : of the robot and its effects.
    dataset : recordings; those without a reference are left out by name.
    controller : of the loop in which they were made.
    progress : called now and then with the seconds simulated, and the seconds to simulate.

    Raises
    ------
    SimulationError
        If no recording has a reference, or the controller cannot be simulated or is another
        robot's. A loop that cannot be simulated is no error: see `Validation.skipped`.
    """
    return simulate_again(Judged.of(estimate), dataset, controller, progress)


@dataclass(frozen=True, eq=False)
class Judged:
    """A model with its parameters (p,), and those of the links (10n,) where a fit chose them."""

    model: Model
    values: np.ndarray
    theta: np.ndarray | None = None

    @staticmethod
    def of(estimate: Estimate) -> Judged:
        """Return what is simulated of an estimate."""
        theta = None if estimate.links is None else estimate.robot.theta
        return Judged(estimate.model, estimate.values, theta)

    def mechanism(self, *, carries_payload: bool) -> Mechanism:
        """Return what is simulated."""
        return Mechanism.of_model(
            self.model, self.values, self.theta, carries_payload=carries_payload
        )


def has_reference(dataset: Dataset) -> bool:
    """Whether there is a recording whose loop can be followed once more."""
    return any(recording.q_ref is not None for recording in dataset.recordings)


def loop_of(
    judged: Judged,
    dataset: Dataset,
    controller: Controller | None,
    progress: Progress | None = None,
) -> Validation | Unsimulated | None:
    """Simulate the loop where there is one to simulate, for those who do not insist.

    Returns
    -------
    None without a controller or a reference; `Unsimulated` where something is in the way.
    """
    if controller is None or not has_reference(dataset):
        return None
    try:
        with warnings.catch_warnings():
            # What is to be said of the recordings was said when they were compared.
            warnings.simplefilter("ignore", DynidentWarning)
            found = simulate_again(judged, dataset, controller, progress)
    except DynidentError as error:
        return Unsimulated(str(error))
    if found.runs:
        return found
    return Unsimulated("; ".join(dict.fromkeys(one.reason for one in found.skipped)))


def simulate_again(
    judged: Judged, dataset: Dataset, controller: Controller, progress: Progress | None = None
) -> Validation:
    """`validate` for any model with values."""
    robot = judged.model.robot
    controller.simulated_rate()
    if controller.n != robot.n:
        what = f"a controller of {controller.n} joints for a robot of {robot.n}"
        raise SimulationError(what, "controller", "give one gain per joint")
    if not has_reference(dataset):
        what = "no recording to compare with"
        if dataset.recordings:
            what = f"no recording has the reference that the controller followed ({_column(robot)})"
        where = ", ".join(r.where for r in dataset.recordings) or None
        mend = f"record it as the column {_column(robot)}, or map it to one in [columns]"
        raise SimulationError(what, where, mend)
    usable = [uniform(r) for r in dataset.recordings if r.q_ref is not None]
    nothing = Validation(
        robot.name,
        robot.names,
        robot.units,
        robot.torque_units,
        _words(controller),
        (),
        tuple(
            Skipped(r.name, "no_reference", f"it has no column {_column(robot)}")
            for r in dataset.recordings
            if r.q_ref is None
        ),
        np.nan,
        "unknown",
        sources_of(Dataset(tuple(usable), dataset.filter)),
    )
    try:
        bodies = {
            carries: judged.mechanism(carries_payload=carries)
            for carries in {bool(r.payload) for r in usable}
        }
        settling = settling_time(controller, next(iter(bodies.values())), usable[0].q)
    except DynidentError as error:
        failed = [Skipped(r.name, "failed", str(error)) for r in usable]
        return replace(nothing, skipped=(*nothing.skipped, *failed))
    skipped = [
        Skipped(r.name, "too_short", _too_short(r, settling))
        for r in usable
        if r.duration <= settling
    ]
    long = [r for r in usable if r.duration > settling]
    again, failed, remarks = _retraced(long, bodies, controller, judged.model, progress)
    runs: list[LoopRun] = []
    for recording, one in again:
        try:
            runs.append(_run(recording, one, controller, judged.model, dataset, settling))
        except RecordingError as error:
            skipped.append(Skipped(recording.name, "too_short", str(error)))
    return replace(
        nothing,
        runs=tuple(runs),
        skipped=(*nothing.skipped, *skipped, *failed),
        settling=settling,
        noise_source=_noise_source(runs, usable),
        remarks=remarks,
    )


def _words(controller: Controller) -> str:
    kind = controller.kind.replace("_", " ")
    name = kind.upper() if len(kind) <= 3 else kind.capitalize()
    return f"{name} controller at {controller.rate_hz:g} Hz"


def _noise_source(runs: list[LoopRun], recordings: list[Recording]) -> NoiseSource:
    if not runs or any(run.noise is None for run in runs):
        return "unknown"
    return "replicates" if any(r.period is not None for r in recordings) else "given"


def _retraced(
    recordings: list[Recording],
    bodies: dict[bool, Mechanism],
    controller: Controller,
    model: Model,
    progress: Progress | None,
) -> tuple[list[tuple[Recording, Retraced]], list[Skipped], tuple[str, ...]]:
    """Simulate every recording's loop: side by side, or one by one if one of them fails."""
    from dynident.closed_loop import ClosedLoop, retrace

    loop = ClosedLoop()

    def follow(some: list[Recording]) -> list[tuple[Recording, Retraced]]:
        mechanisms = [bodies[bool(r.payload)] for r in some]
        found = retrace(loop, mechanisms, some, controller, nominal=model.robot, progress=progress)
        return list(zip(some, found, strict=True))

    if not recordings:
        return [], [], ()
    try:
        return follow(recordings), [], tuple(loop.notes)
    except SimulationError as error:
        if len(recordings) == 1:
            return [], [Skipped(recordings[0].name, "failed", str(error))], tuple(loop.notes)
    found, failed = [], []
    for recording in recordings:
        try:
            found += follow([recording])
        except SimulationError as error:
            failed.append(Skipped(recording.name, "failed", str(error)))
    return found, failed, tuple(loop.notes)


def _run(
    recording: Recording,
    again: Retraced,
    controller: Controller,
    model: Model,
    dataset: Dataset,
    settling: float,
) -> LoopRun:
    """Pass measurement, simulation and reference through the same filters."""
    assert recording.q_ref is not None
    first = recording.t[0] + settling
    window = (first, np.inf)
    if recording.window is not None:
        window = (max(first, recording.window[0]), recording.window[1])
    if not window[0] < window[1]:
        raise RecordingError("its window ends before the loop has settled", recording.where)
    recording = recording.replace(window=window)
    measured = sample(recording, dataset.filter)
    simulated = sample(again.recording.replace(window=window), dataset.filter)
    law = law_torque(recording, controller, model.robot)
    reference = sample(recording.replace(q=recording.q_ref, tau=law), dataset.filter)
    return LoopRun(
        recording.name,
        measured.t,
        _signals(measured),
        _signals(simulated),
        _signals(reference),
        _noise(recording, measured, dataset),
        np.asarray(again.saturated, dtype=float),
    )


def _signals(sampled: Sampled) -> Signals:
    return Signals(sampled.q, sampled.v, sampled.a, sampled.tau)


def _noise(recording: Recording, measured: Sampled, dataset: Dataset) -> np.ndarray | None:
    """Noise of the measured quantities, rms (4, n): of repeated periods, else as stated."""
    signals = _signals(measured)
    if recording.period is not None:
        try:
            found = periods(len(measured.t), measured.rate_hz, recording.period, recording.where)
        except RecordingError:
            found = None
        if found is not None and mismatch(found.fold(measured.q)) <= _REPEATS:
            return np.array([_spread(found.fold(signals.of(one))) for one in QUANTITIES])
    if dataset.noise is None:
        return None
    noisy = _signals(sample(_with_noise(recording, dataset.noise), dataset.filter))
    return np.array(
        [np.sqrt(np.mean((noisy.of(x) - signals.of(x)) ** 2, axis=0)) for x in QUANTITIES]
    )


def _spread(folded: np.ndarray) -> np.ndarray:
    """Root mean square (n,) of what differs from period to period, (P, S, n)."""
    n = folded.shape[2]
    return np.array(
        [np.sqrt(np.mean(differences(folded[..., j], "repeated") ** 2)) for j in range(n)]
    )


def _with_noise(recording: Recording, noise: Noise) -> Recording:
    """Return a recording with one more draw of the stated noise, always the same."""
    stream = np.random.default_rng(0)
    q = recording.q + noise.position_std * stream.standard_normal(recording.q.shape)
    tau = recording.tau + noise.torque_std * stream.standard_normal(recording.tau.shape)
    return recording.replace(q=q, tau=tau)


def _column(robot) -> str:
    return f"q_ref.{robot.names[0]}" if robot.n == 1 else "q_ref.<joint>"


def _too_short(recording: Recording, settling: float) -> str:
    return f"it is {recording.duration:.3g} s long, and the loop settles only after {settling:.3g}"
