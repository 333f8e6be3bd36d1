"""A designed recording made virtually, and what a diagnosis then settles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from dynident.closed_loop import Experiment, ExperimentRun
from dynident.diagnosis import Diagnosis, diagnose
from dynident.errors import DesignError
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.designing import design
from dynident.experiment_design.open_questions import open_task
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.model import Model
from dynident.progress import logged
from dynident.recording import Dataset, Recording
from dynident.recording.dataset import numbered
from dynident.tables import Shown, Table

FILE = "designed.csv"


def record_virtually(
    designed: RecordingDesign, truth: Experiment, seed: int, start: float = 0.0
) -> Recording:
    """Have a robot, as it truly is, follow a designed motion, and measure it.

    Parameters
    ----------
    designed : the motion.
    truth : the robot, its controller and its sensors.
    seed : of all noise.
    start : s, when it begins in the session.

    Returns
    -------
    The recording, for training.

    Raises
    ------
    SimulationError
        If the loop diverges.
    DesignError
        If the motion is for a load, and the robot has no payload to carry.
    """
    if designed.task.load and not any(one.effect.is_payload for one in truth.effects):
        raise DesignError("the robot that is to carry a load has none", "payload", "add the effect")
    run = ExperimentRun(
        trajectory=designed.trajectory,
        duration=designed.task.duration * designed.task.repeat,
        file=FILE,
        start=start,
        payload=designed.task.load > 0,
    )
    return replace(truth, runs=(run,), seed=seed).run()[0]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ClosedDesignLoop(Shown):
    """A diagnosis, the recording designed for what it left open, and the diagnosis with it.

    Attributes
    ----------
    before, after : without and with the designed recording.
    designed : the motion.
    recording : of it.
    """

    before: Diagnosis
    designed: RecordingDesign
    recording: Recording
    after: Diagnosis

    @property
    def settled(self) -> tuple[str, ...]:
        """Of each group that was open, what the recording settled, in plain words."""
        found = []
        steps = [
            (step.effect.label, *(one.label for one in step.indistinguishable))
            for step in self.after.steps
        ]
        for group in self.designed.task.tell:
            labels = [one.label for one in group]
            names = " or ".join(labels)
            left = [one for step in steps if set(step) & set(labels) for one in step]
            kept = [one for one in labels if one in left]
            gone = " or ".join(one for one in labels if one not in left)
            rivals = list(dict.fromkeys(one for one in left if one not in labels))
            if not kept:
                found.append(f"{names}: none of them is needed now.")
            elif not gone:
                beside = f" beside {' or '.join(rivals)}" if rivals else ""
                found.append(f"{names}: still open{beside}.")
            elif rivals:
                found.append(f"{names}: not {gone}; {' or '.join(kept + rivals)} is still open.")
            elif len(kept) == 1:
                found.append(f"{names}: settled, it is {kept[0]}.")
            else:
                found.append(f"{names}: settled in part, it is {' or '.join(kept)}.")
        return tuple(found)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        return (
            self.before.step_table(),
            self.before.sentence,
            *self.designed.tables(),
            self.after.step_table(),
            self.after.sentence,
            *self.settled,
        )

    def to_dict(self) -> dict[str, Any]:
        """The loop as JSON has it."""
        return {
            "before": self.before.to_dict(),
            "design": self.designed.to_dict(),
            "after": self.after.to_dict(),
            "settled": list(self.settled),
        }


def close_design_loop(
    model: Model,
    recorded: Dataset,
    truth: Experiment,
    task: DesignTask,
    progress: Callable[[str], None] | None = None,
) -> ClosedDesignLoop:
    """Diagnose, design the recording that settles what is open, make it virtually, diagnose again.

    Parameters
    ----------
    model : the robot and its effects, as they are known.
    recorded : recordings so far.
    truth : the robot as it truly is, for the recording; its seed is that of the recordings so far.
    task : length, repetitions and search of the design.
    progress : is called with what is being done, for a display.

    Returns
    -------
    Both diagnoses, and what is between them.

    Raises
    ------
    DesignError
        If the first diagnosis leaves no pair of effects open that a motion could settle.
    """
    progress = progress or logged("designing")
    progress("diagnosing the recordings so far")
    before = diagnose(model, recorded, propose="never")
    wanted = open_task(before, task)
    if wanted is None or not wanted.tell:
        raise DesignError("the recordings leave no effects open that a motion could tell apart")
    designed = design(before.after.model, recorded, wanted, progress=progress)
    progress("following the designed motion")
    end = max(one.start + one.duration for one in recorded.recordings)
    # Another seed: a run's noise follows from it and from the run's place among the runs.
    made = record_virtually(designed, truth, truth.seed + 1, end)
    (every,) = numbered(replace(recorded, recordings=(*recorded.recordings, made)))
    progress("diagnosing with the designed recording")
    after = diagnose(model, every, propose="never")
    return ClosedDesignLoop(before=before, designed=designed, recording=made, after=after)
