"""The verb `design`: from a model, its fit and what was recorded to the next recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from dynident.effects import Effect
from dynident.errors import DesignError
from dynident.experiment_design.column_function import ColumnFunction
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_limits import MotionLimits
from dynident.experiment_design.motion_program import DesignedMotion, MotionProgram, instants_of
from dynident.experiment_design.periodic import PeriodicMotions
from dynident.experiment_design.recording_design import DECIDES, RecordingDesign, Separation
from dynident.fitting.estimate import Estimate
from dynident.fitting.fit_model import fit
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.progress import logged
from dynident.recording import Dataset
from dynident.threads import single_threaded

_FIRST_USUAL = 10_000  # seed
_USUAL = 20  # random motions, whose median a design is compared with
_SIZES = 5  # random motions by which columns are scaled
_UNSEEN = 1e-9  # of the size of the others: it makes no torque
_MOST_TIMES = 1000.0
_RIVAL_SHAPES = 3  # of a rival, beside its own


@single_threaded
def design(
    model: Model,
    recorded: Dataset,
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
    model : the robot and its effects.
    recorded : recordings so far, with their filter.
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
    task = task or DesignTask()
    progress = progress or logged("designing")
    limits = limits or MotionLimits.of(model.robot)
    progress("fitting what was recorded")
    question = _Question.of(model, recorded, task)
    progress("writing the columns out")
    motions = PeriodicMotions(limits=limits, period=task.duration, harmonics=task.harmonics)
    information, labels = question.information(recorded, motions)
    program = MotionProgram(information, motions)
    found = program.solved(task.starts, task.seed, progress)
    progress("comparing with usual motions")
    usual = _usual(program)
    if task.show is not None and not np.any(np.isfinite(information.sigma(_whole(program, found)))):
        what = f"no motion of this robot shows {question.asked[0].title}"
        raise DesignError(f"{what}: its torque cannot be told from the model's")
    return RecordingDesign(
        task=task,
        model=question.bare,
        limits=limits,
        program=program,
        motion=found,
        usual=usual,
        estimate=question.estimate,
        labels=labels,
        separation=_separation(program, found.variables, usual, question),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Question:
    """What is asked, of which model.

    Attributes
    ----------
    task : what for.
    bare : the model without the effects that are asked for.
    asked : these, with the shapes that were fitted.
    estimate : of the recordings so far, with the first of them where two are to be told apart.
    """

    task: DesignTask
    bare: Model
    asked: tuple[Effect, ...]
    estimate: Estimate

    @classmethod
    def of(cls, model: Model, recorded: Dataset, task: DesignTask) -> _Question:
        """Fit what was recorded."""
        rivals = task.tell or (() if task.show is None else (task.show,))
        asked = tuple(one.on(model.robot) for one in rivals)
        bare = model
        for one in asked:
            bare = bare - one.label if one in bare else bare
        estimate = fit(bare + asked[:1] if task.tell else bare, recorded)
        asked = tuple(_shaped_as(one, estimate) for one in asked)
        return cls(task=task, bare=bare, asked=asked, estimate=estimate)

    @property
    def values(self) -> np.ndarray:
        """Of the bare model, (p,)."""
        known = dict(zip(self.estimate.names, self.estimate.values, strict=True))
        return np.array([known[name] for name in self.bare.names])

    @property
    def std(self) -> np.ndarray:
        """Size of the torque's residual, (n,); infinite where there is no torque."""
        found = self.estimate.torque_std
        return np.where(found > 0, found, np.inf)

    def information(
        self, recorded: Dataset, motions: PeriodicMotions
    ) -> tuple[Information, tuple[str, ...]]:
        """Return what motions tell, and the names of what they tell of."""
        task, std = self.task, self.std
        extra = _beside(self.asked, self.bare, task)
        columns = ColumnFunction.of(self.bare, self.values, extra)
        mix, last, labels = _mix(self.bare, columns, extra, self.estimate, task)
        size = _sizes(mix, columns, motions, std)
        kept = size > _UNSEEN * np.median(size[size > 0]) if np.any(size > 0) else size > 0
        last = int(np.sum(kept[len(kept) - last :]))
        if last == 0:
            named = self.asked[0].title if self.asked else "the model"
            raise DesignError(f"no motion of this robot makes a torque of {named}")
        mix = mix[:, kept]
        prior, rate = _recorded(columns, mix, recorded, std)
        rows = rate * task.duration * task.repeat
        information = Information(
            columns=columns,
            mix=mix,
            last=last,
            weight=rows / instants_of(motions) / std**2,
            prior=prior,
            scale=size[kept] * np.sqrt(rows * len(std)),
            objective=task.objective,
        )
        return information, tuple(np.array(labels)[kept].tolist())


def _whole(program: MotionProgram, found: DesignedMotion) -> np.ndarray:
    """Information of a designed motion."""
    t = program.motions.times(program.instants)
    series = program.motions.fourier(found.variables)
    return program.information.matrix(t, series.at(t))


def _usual(program: MotionProgram) -> np.ndarray:
    """Variables of the median of some random motions within the limits."""
    usual = [program.within(program.motions.random(_FIRST_USUAL + k)) for k in range(_USUAL)]
    possible = sorted((one for one in usual if one is not None), key=program.loss)
    if not possible:
        raise DesignError("no usual motion is within the limits", remedy="widen them")
    return possible[len(possible) // 2]


def _shaped_as(effect: Effect, estimate: Estimate) -> Effect:
    same = [one for one in estimate.model.effects if one.label == effect.label]
    return same[0] if same else effect


def _beside(asked: Sequence[Effect], model: Model, task: DesignTask) -> tuple[Effect, ...]:
    """Rivals, with the other shapes that they may have, then the effect that is asked for."""
    if not task.tell:
        return tuple(asked)
    first, *others = asked
    found: list[Effect] = []
    for rival in others:
        shapes = [one.shape for one in rival.variants(model.robot)]
        step = max(1, len(shapes) // _RIVAL_SHAPES)
        kept = dict.fromkeys((rival.shape, *shapes[step // 2 :: step]))
        found += [rival.shaped(*shape) for shape in kept]
    return (*found, first)


def _mix(
    model: Model,
    columns: ColumnFunction,
    extra: Sequence[Effect],
    estimate: Estimate,
    task: DesignTask,
) -> tuple[np.ndarray, int, tuple[str, ...]]:
    """Combinations of columns, how many of them are of interest, and their names."""
    count = columns.count
    if not extra:
        return np.eye(count), count, columns.labels
    own = len(extra[-1].parameters(model.robot))
    if task.show is not None:
        return np.eye(count), own, columns.labels
    label = extra[-1].label
    values = estimate.effect_values(label)
    if not np.any(values):
        raise DesignError("has no size in the recordings so far", label)
    mix = np.zeros((count, count - own + 1))
    mix[: count - own, : count - own] = np.eye(count - own)
    mix[count - own :, -1] = values
    return mix, 1, (*columns.labels[: count - own], f"torque of {label}")


def _recorded(
    columns: ColumnFunction, mix: np.ndarray, recorded: Dataset, std: np.ndarray
) -> tuple[np.ndarray, float]:
    """Information of the recordings so far, (k, k), and their rows per second."""
    total, rates = np.zeros((mix.shape[1],) * 2), []
    for recording in recorded.recordings:
        rows = sample(recording, recorded.filter)
        found = _numbers(columns, columns.along(rows.t, rows.q, rows.v, rows.a)) @ mix
        weighted = (found / std[None, :, None]).reshape(-1, mix.shape[1])
        total += weighted.T @ weighted
        rates.append((len(rows.t) - 1) / float(rows.t[-1] - rows.t[0]))
    return total, float(np.median(rates))


def _sizes(
    mix: np.ndarray, columns: ColumnFunction, motions: PeriodicMotions, std: np.ndarray
) -> np.ndarray:
    """Whitened size of each combination on random motions, (k,)."""
    t = motions.times(100)
    sizes = []
    for k in range(_SIZES):
        motion = motions.fourier(motions.random(k) * 0.3).at(t)
        found = _numbers(columns, columns.along(t, *motion)) @ mix
        sizes.append(np.sqrt(np.mean((found / std[None, :, None]) ** 2, axis=(0, 1))))
    return np.mean(sizes, axis=0)


def _numbers(columns: ColumnFunction, found: np.ndarray) -> np.ndarray:
    """Columns (T, n, m), if all of them are finite."""
    bad = ~np.isfinite(found).all(axis=(0, 1))
    if bad.any():
        name = columns.labels[int(np.argmax(bad))]
        remedy = "state tighter limits of its joint, within which the formula is a number"
        raise DesignError(f"{name}: its torque is not finite within the limits", remedy=remedy)
    return found


def _separation(
    program: MotionProgram, best: np.ndarray, usual: np.ndarray, question: _Question
) -> Separation | None:
    """How far the effects are apart: so far, with the design, with a usual motion."""
    if not question.task.tell:
        return None
    information = program.information
    t = program.motions.times(program.instants)

    told, other = (
        information.matrix(t, program.motions.fourier(variables).at(t))
        for variables in (best, usual)
    )

    def sigma(matrix: np.ndarray) -> float:
        return float(np.sqrt(max(information.about(matrix)[0, 0], 0.0)))

    first, *others = question.asked
    return Separation(
        first=first.title,
        others=tuple(one.title for one in others),
        recorded=sigma(0.0 * told),
        designed=sigma(told),
        usual=sigma(other),
        worth=_times(lambda k: sigma(k * other), sigma(told)),
        enough=_times(lambda k: sigma(k * told), DECIDES),
    )


def _times(sigma: Callable[[float], float], wanted: float) -> float:
    """How many times a motion separates as far as is wanted; what was recorded stays as it is."""
    if sigma(_MOST_TIMES) < wanted:
        return float("inf")
    if sigma(0.0) >= wanted:
        return 0.0
    return float(brentq(lambda k: sigma(float(k)) - wanted, 0.0, _MOST_TIMES))  # type: ignore[arg-type]
