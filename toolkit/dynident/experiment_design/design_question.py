"""What is asked of the next recording, as columns along a motion and what is known already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np

from dynident.effects import Effect
from dynident.errors import DesignError
from dynident.experiment_design.carried_load import payload_effect, usual_load
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.columns.predicted_torque import PredictedTorque
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.information import Information
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.experiment_design.telling.imitations import Imitations, TellingMoments, shapes_of
from dynident.fitting.estimate import Estimate
from dynident.fitting.fit_model import fit
from dynident.fitting.sampling import sample
from dynident.inertia import PARAMETERS
from dynident.model import Model
from dynident.recording import Dataset
from dynident.words import nearest

_SIZES = 5  # random motions by which columns are scaled
_UNSEEN = 1e-9  # of the size of the others: it makes no torque
_RIVAL_SHAPES = 3  # of a rival, beside its own
_WIDER = 30.0  # widths of dry friction, over the true one
_COMPARED = 200  # instants
_NARROW = 0.05  # of a column: its change, with wider dry friction, that makes it narrow


@dataclass(frozen=True, eq=False, kw_only=True)
class Asked:
    """What a motion is judged by.

    Attributes
    ----------
    information : of a motion.
    is_narrow : whether dry friction over wider ranges of speed would make a difference to the
        effects that are asked for: many more instants tell what such a law does, and a motion that
        is a little slower or faster tells the same, so that a search ends at many places.
    labels : of what is told, those of interest last.
    rows : of each joint that the recording will have.
    """

    information: Information
    is_narrow: bool
    labels: tuple[str, ...]
    rows: float


class RecordedFits:
    """Fits of models to what was recorded, each made once: several questions share them.

    Parameters
    ----------
    recorded : recordings so far.
    """

    def __init__(self, recorded: Dataset) -> None:
        self.recorded = recorded
        self._known: dict[tuple[Effect, ...], Estimate] = {}

    def of(self, model: Model) -> Estimate:
        """Return the fit of a model; the robot is the same for all."""
        if model.effects not in self._known:
            self._known[model.effects] = fit(model, self.recorded)
        return self._known[model.effects]


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignQuestion:
    """What is asked, of which model.

    Attributes
    ----------
    task : what for.
    told : effects of which it is to be told which one it is, the first taken for true.
    shown : effects that are to be shown.
    bare : the model without these, but with what is carried.
    estimate : of the recordings so far, with the first of those that are to be told apart.
    torque : that motions will take, as far as the recordings and the description tell.
    """

    task: DesignTask
    told: tuple[Effect, ...]
    shown: tuple[Effect, ...]
    bare: Model
    estimate: Estimate
    torque: PredictedTorque

    @classmethod
    def of(
        cls,
        model: Model,
        fits: RecordedFits,
        task: DesignTask,
        motions: MotionFamily,
        told: Sequence[Effect] = (),
    ) -> DesignQuestion:
        """Fit what was recorded.

        Parameters
        ----------
        model : the robot and its effects.
        fits : of recordings so far.
        task : what for.
        motions : among which one is sought.
        told : one of its groups of effects.

        Returns
        -------
        The question of that group; without one, that of what is to be shown, or of all parameters.
        """
        _require_no_payload(model, fits.recorded, task)
        robot = model.robot
        told = tuple(one.on(robot) for one in told)
        shown = () if told else tuple(one.on(robot) for one in task.show)
        bare = model
        for one in (*told, *shown):
            bare = bare - one.label if one in bare else bare
        estimate = fits.of(bare + told[:1] if told else bare)
        fitted = {one.label: one for one in estimate.model.effects}
        torque = _torque(estimate, fits.recorded, motions)
        if task.load:
            torque = torque.carrying(usual_load(robot, task.load))
            bare = bare + payload_effect(robot)
        return cls(
            task=task,
            told=tuple(fitted.get(one.label, one) for one in told),
            shown=shown,
            bare=bare,
            estimate=estimate,
            torque=torque,
        )

    @property
    def values(self) -> np.ndarray:
        """Of the bare model, (p,); not those of the fit alone, which small motions leave open."""
        known = dict(zip(self.torque.model.names, self.torque.values, strict=True))
        return np.array([known[name] for name in self.bare.names])

    @property
    def std(self) -> np.ndarray:
        """Size of the torque's residual, (n,); infinite where there is no torque."""
        return _std(self.estimate)

    @property
    def effect_covariance(self) -> np.ndarray | None:
        """Of the values of the effect that is taken for true, (k, k); None where they are open.

        The recordings so far may tell them with others only, or not at all.
        """
        at = self.estimate.model.slices[self.told[0].label]
        found = self.estimate.covariance[at, at]
        told = self.estimate.alone[at].all() and np.isfinite(found).all() and np.any(found)
        return found if told else None

    def asked(self, recorded: Dataset, motions: MotionFamily) -> Asked:
        """Return what a motion is judged by, and the names of what it tells.

        Raises
        ------
        DesignError
            If no motion makes a torque of what is asked for.
        """
        task, std = self.task, self.std
        extra = self._beside()
        columns = self._columns(extra, carries_payload=task.load > 0)
        mix, last, labels = self._mix(columns, extra)
        size = _sizes(mix, columns, motions, std)
        kept = size > _UNSEEN * np.median(size[size > 0]) if np.any(size > 0) else size > 0
        last = int(np.sum(kept[len(kept) - last :]))
        if last == 0:
            named = self.told[0].title if self.told else task.of_what or "the model"
            raise DesignError(f"no motion of this robot makes a torque of {named}")
        mix = mix[:, kept]
        unladen = self._columns(extra, carries_payload=False)
        prior, rate = _recorded(unladen, mix, recorded, std)
        rows = rate * task.duration * task.repeat
        information = Information(
            columns=columns,
            mix=mix,
            last=last,
            weight=rows / std**2,
            prior=prior,
            scale=size[kept] * np.sqrt(rows * len(std)),
            objective=task.objective,
        )
        return Asked(
            information=information,
            is_narrow=self._is_narrow(columns, extra, motions),
            labels=tuple(np.array(labels)[kept].tolist()),
            rows=rows,
        )

    def _columns(self, extra: Sequence[Effect], *, carries_payload: bool) -> ColumnFunction:
        """Columns of the bare model and of further effects."""
        return ColumnFunction.of(self.bare, self.values, extra, carries_payload=carries_payload)

    def imitations(self, asked: Asked) -> Imitations:
        """Return what the rivals can imitate of the effect that is taken for true."""
        first, *rivals = self.told
        return Imitations(
            model=self.bare,
            values=self.values,
            columns=asked.information.columns,
            effect_values=self.estimate.effect_values(first.label),
            std=self.std,
            rivals=shapes_of(rivals, self.bare.robot),
            shapes=len(first.shape),
            carries_payload=self.task.load > 0,
        )

    def known(self, rivals: Imitations, recorded: Dataset) -> TellingMoments:
        """Return what the recordings so far, without a load, tell of the rivals of an effect."""
        columns = self._columns(self._beside(), carries_payload=False)
        found, rivals = [], replace(rivals, columns=columns, carries_payload=False)
        for recording in recorded.recordings:
            rows = sample(recording, recorded.filter)
            found.append(rivals.moments(rows.t, (rows.q, rows.v, rows.a)))
        return reduce(add, found)

    def _is_narrow(
        self, columns: ColumnFunction, extra: Sequence[Effect], motions: MotionFamily
    ) -> bool:
        if not self.told:
            return False
        t = motions.times(_COMPARED)
        motion = motions.trajectory(motions.random(0) * 0.3).at(t)
        widths = tuple(_WIDER * one for one in self.bare.friction_widths)
        wider = replace(self, bare=replace(self.bare, friction_width=widths))
        soft = wider._columns(extra, carries_payload=self.task.load > 0)
        own = slice(self.bare.size, None)
        sharp, blunt = (one.along(t, *motion)[:, :, own] for one in (columns, soft))
        change, size = (np.linalg.norm(one, axis=(0, 1)) for one in (blunt - sharp, sharp))
        return bool(np.any(change > _NARROW * size))

    def _beside(self) -> tuple[Effect, ...]:
        """Rivals, with the other shapes that they may have, then the effect that is asked for."""
        if not self.told:
            return tuple(one for one in self.shown if one not in self.bare)
        first, *others = self.told
        found: list[Effect] = []
        for rival in others:
            shapes = [one.shape for one in rival.variants(self.bare.robot)]
            step = max(1, len(shapes) // _RIVAL_SHAPES)
            kept = dict.fromkeys((rival.shape, *shapes[step // 2 :: step]))
            found += [rival.shaped(*shape) for shape in kept]
        return (*found, first)

    def _mix(
        self, columns: ColumnFunction, extra: Sequence[Effect]
    ) -> tuple[np.ndarray, int, tuple[str, ...]]:
        """Combinations of columns, how many of them are of interest, and their names."""
        count = columns.count
        if not self.told:
            meant = self._meant(count)
            order = np.argsort(meant, kind="stable")
            labels = tuple(columns.labels[k] for k in order)
            return np.eye(count)[:, order], int(meant.sum()), labels
        own, label = len(extra[-1].parameters(self.bare.robot)), extra[-1].label
        values = self.estimate.effect_values(label)
        if not np.any(values):
            raise DesignError("has no size in the recordings so far", label)
        mix = np.zeros((count, count - own + 1))
        mix[: count - own, : count - own] = np.eye(count - own)
        mix[count - own :, -1] = values
        return mix, 1, (*columns.labels[: count - own], f"torque of {label}")

    def _meant(self, count: int) -> np.ndarray:
        """Which of the columns are of interest, (count,), where no effects are told apart."""
        model, joints = self.bare, set(self.task.joints)
        if self.shown:
            meant = np.arange(count) >= model.size
            for one in self.shown:
                meant[model.slices.get(one.label, slice(0))] = True
            return meant
        if not joints:
            # A load that is carried to tell the others is weighed, and not what is asked for.
            return np.isin(self.bare.names, self.estimate.names)
        names = model.robot.names
        for one in self.task.joints:
            if one not in names:
                remedy = nearest(one, names, "joints")
                raise DesignError(f"the robot has no joint '{one}'", remedy=remedy)
        meant = np.zeros(count, dtype=bool)
        links = np.array(model.base.independent, dtype=int) // len(PARAMETERS)
        meant[: model.base.rank] = [names[link] in joints for link in links]
        for effect in model.effects:
            meant[model.slices[effect.label]] = bool(joints & {effect.joint, effect.source})
        return meant


def _std(estimate: Estimate) -> np.ndarray:
    found = estimate.torque_std
    return np.where(found > 0, found, np.inf)


def _require_no_payload(model: Model, recorded: Dataset, task: DesignTask) -> None:
    """Raise `DesignError` if the recordings carry a load, where that would not be allowed for."""
    if any(effect.is_payload for effect in model.effects):
        raise DesignError(
            "is not designed for: what the recordings carry would count as known",
            "payload",
            "leave it out, and the recordings that carry it; a load says what the next one carries",
        )
    carrying = next((one for one in recorded.recordings if one.payload), None)
    if task.load and carrying is not None:
        raise DesignError(
            "carries a payload, and may be another than the next recording's",
            carrying.where,
            "leave the recordings that carry it out",
        )


def _torque(estimate: Estimate, recorded: Dataset, motions: MotionFamily) -> PredictedTorque:
    """The torque that motions will take; usual ones say how large a column is."""
    model, values, std = estimate.model, estimate.values, _std(estimate)
    columns, every = ColumnFunction.of(model, values), np.eye(model.size)
    known, _ = _recorded(columns, every, recorded, std)
    return PredictedTorque.of(model, values, known, _sizes(every, columns, motions, std))


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
    mix: np.ndarray, columns: ColumnFunction, motions: MotionFamily, std: np.ndarray
) -> np.ndarray:
    """Whitened size of each combination on random motions, (k,)."""
    t = motions.times(100)
    sizes = []
    for k in range(_SIZES):
        motion = motions.trajectory(motions.random(k) * 0.3).at(t)
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
