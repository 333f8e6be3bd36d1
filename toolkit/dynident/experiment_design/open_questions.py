"""What a diagnosis left open, as the task of the next recording."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis import Diagnosis
from dynident.diagnosis.advice.experiments import DESIGNED, NO_MOTION
from dynident.diagnosis.advice.open_groups import open_groups
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.experiment_design.telling.separation import Separation

ADVISED = 2.0
"""Standard deviations below which a recording is not worth advising."""


def open_task(diagnosis: Diagnosis, task: DesignTask) -> DesignTask | None:
    """Return the task of the recording that settles what a diagnosis left open.

    That is the effects that it could not tell apart; where there are none, those that the
    recordings could not show.

    Parameters
    ----------
    diagnosis : of the recordings so far.
    task : for its length, its repetitions and its search.

    Returns
    -------
    The task; None where nothing is left open that a motion could settle.
    """
    groups = open_groups(diagnosis)
    if groups:
        return replace(task, tell=groups, show=())
    hidden = tuple(
        one.effect
        for one in diagnosis.candidates
        if one.status == "absorbed" and one.effect.is_of_an_instant
    )
    return replace(task, tell=(), show=hidden) if hidden else None


def with_designed_advice(diagnosis: Diagnosis, design: RecordingDesign) -> Diagnosis:
    """Return a diagnosis whose advice is the designed recording, in the place of usual words.

    Parameters
    ----------
    diagnosis : of the recordings so far.
    design : of what it left open, see `open_task`.
    """
    length = design.task.duration * design.task.repeat
    told = {
        group[0].label: _advice(one, length)
        for group, one in zip(design.task.tell, design.separations, strict=True)
    }
    steps = tuple(
        replace(step, advice=told.get(step.effect.label, step.advice)) for step in diagnosis.steps
    )
    return replace(diagnosis, steps=steps)


def _advice(one: Separation, length: float) -> str:
    """The recording to make, without a full stop; what is not worth making is said to be so."""
    if one.designed >= ADVISED:
        return f"{DESIGNED}: {one.sentence(length).rstrip('.')}"
    return f"{NO_MOTION} {length:g} s decides: {one.sentence(length).rstrip('.')}"
