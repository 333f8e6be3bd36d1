"""The verb `design`: from a model, its fit and what was recorded to the next recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dynident.arguments import checked
from dynident.errors import DesignError
from dynident.experiment_design.columns.predicted_torque import WRONG
from dynident.experiment_design.design_question import Asked, DesignQuestion, RecordedFits
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.geometry.clearance import Clearance
from dynident.experiment_design.geometry.workspace import Workspace
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_limits import MotionLimits
from dynident.experiment_design.motion_program import FINER, MotionProgram
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.experiment_design.motions.spline_motions import SplineMotions
from dynident.experiment_design.recording_design import LoadTried, RecordingDesign
from dynident.experiment_design.telling.separation import Separation, times_until
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.progress import logged
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.tables import percent
from dynident.threads import single_threaded

_FIRST_USUAL = 10_000  # seed
_USUAL = 20  # random motions, whose median a design is compared with
_HOPELESS = 0.01  # standard deviations with the best usual motion: told by none


@checked
@single_threaded
def design(
    model: Model | Estimate,
    recorded: Dataset | Recording,
    task: DesignTask | None = None,
    *,
    limits: MotionLimits | None = None,
    progress: Callable[[str], None] | None = None,
) -> RecordingDesign:
    """Design the recording that tells the most of what is asked.

    The model is fitted to what was recorded: its values, the size of its noise, and what is known
    already, which the next recording complements.

    Parameters
    ----------
    model : the robot and its effects, or an estimate of it.
    recorded : recordings so far, with their filter, or a single one.
    task : what for; default: all parameters.
    limits : of the motion; default: nine tenths of the description's.
    progress : is called with what is being done, for a display.

    Returns
    -------
    The motion, what it is predicted to tell, and how that compares with a usual motion.

    Raises
    ------
    DesignError
        If no motion within the limits can be found, an effect depends on the past, or nothing that
        the robot can do shows what is asked.
    """
    from dynident.nlp.ipopt import interruptible

    model = model.model if isinstance(model, Estimate) else model
    task = task or DesignTask()
    progress = progress or logged("designing")
    limits = limits or MotionLimits.of(model.robot)
    limits.require_ranges(model.robot)
    recorded = Dataset.of(recorded, model.robot.names)
    loads = tuple(dict.fromkeys(task.loads))
    fits = RecordedFits(recorded)

    def of(one: DesignTask) -> RecordingDesign:
        # CasADi turns a KeyboardInterrupt that arrives within it into another error.
        with interruptible():
            return _designed(model, fits, one, limits, progress)

    if len(loads) < 2:
        return of(task)
    found: list[RecordingDesign] = []
    tried: list[LoadTried] = []
    refused: list[DesignError] = []
    for load in loads:
        progress(f"with {load:g} kg on the last link")
        try:
            one = of(replace(task, loads=(load,)))
        except DesignError as error:  # a load may be too heavy
            tried.append(LoadTried(mass=load, why=str(error)))
            refused.append(error)
        else:
            tried.append(LoadTried(mass=load, tells=one.tells))
            found.append(one)
    if not found:
        raise refused[0]
    best = max(found, key=lambda one: one.tells)
    return replace(best, loads_tried=tuple(tried))


def _designed(
    model: Model,
    fits: RecordedFits,
    task: DesignTask,
    limits: MotionLimits,
    progress: Callable[[str], None],
) -> RecordingDesign:
    """The design with one load, or with none.

    Parameters
    ----------
    model, task, limits, progress : as for `design`; of the loads, the first.
    fits : of what was recorded.
    """
    workspace = _workspace(model.robot, task, limits)
    motions = _motions(task, limits)
    progress("fitting what was recorded")
    questions = [DesignQuestion.of(model, fits, task, motions, told) for told in task.tell or ((),)]
    progress("writing the columns out")
    recorded = fits.recorded
    asked = [one.asked(recorded, motions) for one in questions]
    program = MotionProgram(
        informations=tuple(one.information for one in asked),
        motions=motions,
        torque=questions[0].torque,
        narrow=any(one.is_narrow for one in asked),
        workspace=workspace,
    )
    progress("comparing with usual motions")
    some = _usual_motions(program, task.load)
    program = _without_hopeless(program, some)
    usual = sorted(some, key=program.loss)[len(some) // 2]
    found = program.solved(task.starts, task.seed, progress)
    first, information = questions[0], asked[0].information
    if task.of_what and not np.any(
        np.isfinite(information.sigma(program.told(information, found.variables)))
    ):
        names = " or ".join([*(one.title for one in first.shown), *task.joints])
        raise DesignError(
            f"no motion of this robot shows {names}: the torque cannot be told from the model's"
        )
    return RecordingDesign(
        task=task,
        model=model if task.tell else first.bare,
        limits=limits,
        program=program,
        motion=found,
        usual=usual,
        estimate=first.estimate,
        labels=asked[0].labels,
        separations=tuple(
            _separation(program, one, (found.variables, usual), question, recorded)
            for one, question in zip(asked, questions, strict=True)
            if task.tell
        ),
    )


def _motions(task: DesignTask, limits: MotionLimits) -> MotionFamily:
    """Among which one is sought, by the task."""
    if task.intervals is None:
        return FourierMotions(limits=limits, period=task.duration, harmonics=task.harmonics)
    return SplineMotions(limits=limits, period=task.duration, intervals=task.intervals)


def _workspace(robot: Robot, task: DesignTask, limits: MotionLimits) -> Workspace:
    """Where the robot may be, by its task and the limits."""
    if task.clearance is not None:
        clearance = Clearance.of(robot, task.clearance, limits.obstacles)
        return Workspace(clearance, limits.boxes)
    if limits.obstacles:
        raise DesignError("obstacles, and no clearance from them", remedy="ask for a clearance")
    return Workspace(None, limits.boxes)


def _usual_motions(program: MotionProgram, load: float) -> list[np.ndarray]:
    """Variables of random motions within the limits, of which there are some, with a load (kg)."""
    usual = _random_motions(program)
    if not usual:
        if not load:  # what is not known of a load no recording tells
            _require_known_torque(program)
        kept = program.workspace.in_words()
        carried = f" with {load:g} kg on the last link" if load else ""
        what = f"no usual motion{carried} is within the limits" + (f" and {kept}" if kept else "")
        remedy = "widen them, or move the joints' ranges to where there is room"
        raise DesignError(what, remedy=f"carry less, {remedy}" if load else remedy)
    return usual


def _random_motions(program: MotionProgram) -> list[np.ndarray]:
    """Variables of random motions within the limits; none where all fail."""
    usual = [program.within(program.motions.random(_FIRST_USUAL + k)) for k in range(_USUAL)]
    return [one for one in usual if one is not None]


def _without_hopeless(program: MotionProgram, usual: list[np.ndarray]) -> MotionProgram:
    """The search without what no usual motion tells at all, which would hide what others are."""
    if len(program.informations) == 1:
        return program
    kept = [
        k
        for k, one in enumerate(program.informations)
        if any(_sigma(one, program.told(one, x)) > _HOPELESS for x in usual)
    ]
    kept = kept or [0]
    return replace(program, informations=tuple(program.informations[k] for k in kept))


def _require_known_torque(program: MotionProgram) -> None:
    """Raise `DesignError` if motions are refused for what is not known of their torque alone."""
    if not _random_motions(replace(program, torque=program.torque.taken_for_known)):
        return
    raise DesignError(
        "no usual motion is surely within the limits of torque: too much of it is left open by the "
        f"recordings, and by the description with each link taken for {percent(WRONG, 0)} wrong",
        remedy="add recordings that tell more of it, or state higher limits of torque",
    )


def _sigma(information: Information, matrix: np.ndarray) -> float:
    """Standard deviations between effects, with what was recorded."""
    return float(np.sqrt(max(information.about(matrix)[0, 0], 0.0)))


def _separation(
    program: MotionProgram,
    asked: Asked,
    motions: tuple[np.ndarray, np.ndarray],
    question: DesignQuestion,
    recorded: Dataset,
) -> Separation:
    """How far effects are apart: so far, with the design, with a usual motion."""
    rivals = question.imitations(asked)
    known = question.known(rivals, recorded)
    t = program.motions.times(FINER * program.instants)
    own, other = (
        rivals.moments(t, program.motions.trajectory(one).at(t), asked.rows) for one in motions
    )
    forms = rivals.forms(known + own)
    told = forms.told(rivals.effect_values)
    first, *others = question.told
    return Separation(
        first=first.title,
        others=tuple(one.title for one in others),
        advice=first.advice,
        recorded=rivals.told(known).sigma,
        usual=rivals.told(known + other).sigma,
        predicted=forms.predicted(rivals.effect_values, question.effect_covariance),
        told=told,
        worth=times_until(lambda k: rivals.told(known + other * k).sigma - told.sigma),
        enough=times_until(lambda k: rivals.told(known + own * k).beyond),
    )
