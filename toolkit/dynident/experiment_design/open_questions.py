"""What a diagnosis left open, as the task of the next recording."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis import Diagnosis
from dynident.diagnosis.advice.experiments import NO_MOTION
from dynident.effects import Effect
from dynident.experiment_design.column_function import is_of_an_instant
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.recording_design import RecordingDesign
from dynident.experiment_design.telling.separation import Separation

DESIGNED = "record the motion that was designed"
"""How advice begins that is a designed recording."""
ADVISED = 2.0
"""Standard deviations below which a recording is not worth advising."""


def open_groups(diagnosis: Diagnosis) -> tuple[tuple[Effect, ...], ...]:
    """Return each effect that was added with those that explain the recordings as well.

    Only such as the design of a recording knows: whose torque is a function of an instant.

    Parameters
    ----------
    diagnosis : of the recordings so far.
    """
    added = {step.effect.label for step in diagnosis.steps}
    found = []
    for step in diagnosis.steps:
        rivals = tuple(
            one
            for one in step.indistinguishable
            if one.label not in added and is_of_an_instant(one)
        )
        if rivals and is_of_an_instant(step.effect):
            found.append((step.effect, *rivals))
    return tuple(found)


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
        if one.status == "absorbed" and is_of_an_instant(one.effect)
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
