"""The recorded loop once more, with the identified robot in it: the verb `validate`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dynident.arguments import checked
from dynident.closed_loop import Controller, Mechanism
from dynident.criteria import DEFAULTS, Criteria, LoopCriteria
from dynident.errors import DynidentError, RecordingError, SimulationError, without_warnings
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import sources_of
from dynident.model import Model
from dynident.recording import Dataset, Recording, uniform
from dynident.recording.dataset import NoiseSource
from dynident.robot import Robot
from dynident.threads import single_threaded
from dynident.validation.control_law import time_constant
from dynident.validation.loop_errors import LoopRun
from dynident.validation.loop_signals import filtered_run
from dynident.validation.validation_result import Skipped, Unsimulated, Validation

if TYPE_CHECKING:
    from dynident.closed_loop.retrace import Retraced

Progress = Callable[[float, float], None]
"""(s simulated, s to simulate)."""

_ROUNDING = 1.05
"""Share of the limit that noise and resolution of a torque may add to it."""


@checked
@single_threaded
def validate(
    estimate: Estimate,
    dataset: Dataset | Recording,
    controller: Controller,
    *,
    criteria: Criteria = DEFAULTS,
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
    dataset : recordings, or a single one; those without a reference are left out by name.
    controller : of the loop in which they were made.
    criteria : its `loops` say what the errors mean.
    progress : called now and then with the seconds simulated, and the seconds to simulate.

    Returns
    -------
    Four errors of every joint, what they are held against, and a verdict.

    Raises
    ------
    SimulationError
        If no recording has a reference, or the controller cannot be simulated or is another
        robot's. A loop that cannot be simulated is no error: see `Validation.skipped`.
    """
    dataset = Dataset.of(dataset, estimate.robot.names)
    return simulate_again(Judged.of(estimate), dataset, controller, criteria.loops, progress)


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
    criteria: LoopCriteria = DEFAULTS.loops,
) -> Validation | Unsimulated | None:
    """Simulate the loop where there is one to simulate, for those who do not insist.

    Parameters
    ----------
    judged : the model with its values.
    dataset : recordings, some with their reference.
    controller : of their loop; None where it is not known.
    criteria : what the errors mean.

    Returns
    -------
    None without a controller or a reference; `Unsimulated` where something is in the way.
    """
    if controller is None or not has_reference(dataset):
        return None
    try:
        with without_warnings():
            # What is to be said of the recordings was said when they were compared.
            found = simulate_again(judged, dataset, controller, criteria)
    except DynidentError as error:
        return Unsimulated(str(error))
    if found.runs:
        return found
    return Unsimulated("; ".join(f"{one.name}: {one.reason}" for one in found.skipped))


def simulate_again(
    judged: Judged,
    dataset: Dataset,
    controller: Controller,
    criteria: LoopCriteria,
    progress: Progress | None = None,
) -> Validation:
    """Simulate the recorded loops of any model with values.

    Parameters
    ----------
    judged, dataset, controller, criteria, progress : as in `validate`.

    Returns
    -------
    As of `validate`.

    Raises
    ------
    SimulationError
        As `validate`.
    """
    robot = judged.model.robot
    _require_loop(robot, dataset, controller)
    usable = [uniform(r) for r in dataset.recordings if r.q_ref is not None]
    nothing = Validation(
        criteria=criteria,
        robot=robot.name,
        joints=robot.names,
        units=robot.units,
        torque_units=robot.torque_units,
        controller=_words(controller),
        runs=(),
        skipped=tuple(
            Skipped(r.name, "no_reference", f"it has no column {_column(robot)}")
            for r in dataset.recordings
            if r.q_ref is None
        ),
        settling=np.nan,
        noise_source="unknown",
        sources=sources_of(Dataset(tuple(usable), dataset.filter)),
    )
    free = [robot.names[j] for j in np.flatnonzero(controller.feedback().position == 0)]
    if free:
        what = f"nothing holds {', '.join(free)} at its reference (a gain of position is 0)"
        failed = [Skipped(r.name, "failed", f"{what}: its loop never settles") for r in usable]
        return replace(nothing, skipped=(*nothing.skipped, *failed))
    try:
        bodies = {
            carries: judged.mechanism(carries_payload=carries)
            for carries in {bool(r.payload) for r in usable}
        }
        times = [time_constant(controller, bodies[bool(r.payload)], r.q) for r in usable]
        # Not finite where an inertia is negative: that loop will not be simulated.
        slowest = max((x for x in times if np.isfinite(x)), default=0.0)
    except DynidentError as error:
        failed = [Skipped(r.name, "failed", _reason(error, r)) for r in usable]
        return replace(nothing, skipped=(*nothing.skipped, *failed))
    settling = [_settling(r, slowest) for r in usable]
    pairs = list(zip(usable, settling, strict=True))
    skipped = [Skipped(r.name, "too_short", _too_short(r, s)) for r, s in pairs if r.duration <= s]
    long = [r for r, s in pairs if r.duration > s]
    again, failed, remarks = _retraced(long, bodies, controller, judged.model, progress)
    runs: list[LoopRun] = []
    for recording, one in again:
        try:
            drop = _settling(recording, slowest)
            run = filtered_run(recording, one, controller, judged.model, dataset, drop, criteria)
            runs.append(run)
        except RecordingError as error:
            skipped.append(Skipped(recording.name, "too_short", _reason(error, recording)))
    return replace(
        nothing,
        runs=tuple(runs),
        skipped=(*nothing.skipped, *skipped, *failed),
        settling=max(settling),
        noise_source=_noise_source(runs, usable),
        remarks=(*_beyond_limit(usable, controller), *remarks),
    )


def _require_loop(robot: Robot, dataset: Dataset, controller: Controller) -> None:
    """Refuse a controller that is another robot's or has no rate, and data without a reference."""
    controller.simulated_rate()
    if controller.n != robot.n:
        what = f"a controller of {controller.n} joints for a robot of {robot.n}"
        raise SimulationError(what, "controller", "give one gain per joint")
    if not has_reference(dataset):
        what = "no recording to compare with"
        if dataset.recordings:
            what = f"no recording has the reference that the controller followed ({_column(robot)})"
        where = ", ".join(r.where for r in dataset.recordings) or None
        remedy = f"record it as the column {_column(robot)}, or map it to one in [columns]"
        raise SimulationError(what, where, remedy)


def _beyond_limit(recordings: list[Recording], controller: Controller) -> list[str]:
    """Joints whose recorded torque is larger than the controller's limit, a sentence each."""
    if controller.limit is None:
        return []
    largest = np.max([np.abs(r.tau).max(axis=0) for r in recordings], axis=0)
    return [
        f"{joint}: the recorded torque reaches {most:.4g}, and the stated limit is {limit:.4g}: "
        "the limit, or the unit of the torque, is another."
        for joint, most, limit in zip(recordings[0].joints, largest, controller.limit, strict=True)
        if most > _ROUNDING * limit
    ]


def _words(controller: Controller) -> str:
    kind = controller.kind.replace("_", " ")
    name = kind.upper() if len(kind) <= 3 else kind.capitalize()
    return f"{name} controller at {controller.rate_hz:g} Hz"


def _settling(recording: Recording, slowest: float) -> float:
    """Time to drop at the start of a recording, s: simulation and measurement began differently.

    Five time constants; up to ten where that is a tenth of the recording at most.
    """
    return max(5.0 * slowest, min(10.0 * slowest, 0.1 * recording.duration))


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
            return (
                [],
                [Skipped(recordings[0].name, "failed", _reason(error, recordings[0]))],
                tuple(loop.notes),
            )
    found, failed = [], []
    for recording in recordings:
        try:
            found += follow([recording])
        except SimulationError as error:
            failed.append(Skipped(recording.name, "failed", _reason(error, recording)))
    return found, failed, tuple(loop.notes)


def _column(robot: Robot) -> str:
    return f"q_ref.{robot.names[0]}" if robot.n == 1 else "q_ref.<joint>"


def _too_short(recording: Recording, settling: float) -> str:
    return (
        f"it is {recording.duration:.3g} s long, and the loop settles only after {settling:.3g} s"
    )


def _reason(error: DynidentError, recording: Recording) -> str:
    """Return the message without the recording's name, which stands beside it already."""
    said = str(error)
    for name in filter(None, (recording.where, recording.name)):
        said = said.removeprefix(f"{name}, ").removeprefix(f"{name}: ")
    return said
