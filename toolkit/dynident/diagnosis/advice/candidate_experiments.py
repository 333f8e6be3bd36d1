"""Experiments that could be made with a robot, and what a model and effects say of them."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynident.closed_loop.trajectories import UNLIMITED, Fourier
from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Block, Effect
from dynident.evidence.evidence import Evidence
from dynident.model import Model

_EVERY = 5  # samples: rows that are compared
_WIDE, _FAST, _UNHURRIED = (10.0, 5), (4.0, 8), (20.0, 5)  # period in s, harmonics
_SAMPLES = 1000
_DEPENDENT = 1e-7  # of the largest singular value of scaled columns


@dataclass(frozen=True, eq=False, kw_only=True)
class Recorded:
    """What motion there is already, each (n,) in SI units.

    Attributes
    ----------
    lower, upper : positions.
    speed, acceleration, torque : largest.
    span : s, from the first start to the last end in the session.
    """

    lower: np.ndarray
    upper: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray
    span: float

    @classmethod
    def of(cls, evidence: Evidence) -> Recorded:
        """Return the ranges of the recordings in the evidence."""
        runs = [run.replicates[0] for run in evidence.runs]
        starts = [run.recording.start for run in runs]
        ends = [run.recording.start + run.recording.duration for run in runs]

        def largest(name: str) -> np.ndarray:
            return np.max([np.abs(getattr(run, name)).max(0) for run in runs], axis=0)

        return cls(
            lower=np.min([run.q.min(0) for run in runs], axis=0),
            upper=np.max([run.q.max(0) for run in runs], axis=0),
            speed=largest("v"),
            acceleration=largest("a"),
            torque=largest("tau"),
            span=max(ends) - min(starts),
        )


Motion = tuple[str, str | None]
"""Name of a motion, and the joint that moves alone."""


@dataclass(frozen=True)
class CandidateExperiment:
    """An experiment that could be made.

    Attributes
    ----------
    kind : "wide", "fast" or "slow" motion of all joints, one joint "alone", motion early and late
        in a "session", with and without a "payload", or "everything" of these but one joint alone.
    joint : that moves alone.
    """

    kind: str
    joint: str | None = None

    @property
    def motions(self) -> tuple[Motion, ...]:
        """Names of the motions that it consists of."""
        parts = {
            "session": ("wide", "late"),
            "payload": ("wide", "loaded"),
            "everything": ("wide", "fast", "slow", "late", "loaded"),
        }
        return tuple((name, self.joint) for name in parts.get(self.kind, (self.kind,)))


EVERYTHING = CandidateExperiment("everything")


@dataclass(eq=False, kw_only=True)
class CandidateExperiments:
    """Experiments evaluated with a fitted model; each motion is evaluated once.

    Attributes
    ----------
    model : with its effects.
    values : (p,) its parameters.
    recorded : what has been recorded.
    excluded : labels of effects of the model whose columns do not count as the model's.
    criteria : what is advised.
    """

    model: Model
    values: np.ndarray
    recorded: Recorded
    excluded: tuple[str, ...] = ()
    criteria: Criteria = DEFAULTS
    _blocks: dict[Motion, Block] = field(default_factory=dict)
    _blocks_ready: dict[Hashable, Block] = field(default_factory=dict)
    _columns: dict[Motion, np.ndarray] = field(default_factory=dict)
    _effects: dict[tuple[Effect, Motion], np.ndarray] = field(default_factory=dict)
    _bases: dict[CandidateExperiment, np.ndarray] = field(default_factory=dict)

    def without(self, effects: Sequence[Effect]) -> CandidateExperiments:
        """Return the same experiments with these effects not counted as the model's."""
        return replace(self, excluded=tuple(effect.label for effect in effects), _bases={})

    def left(self, effect: Effect, trial: CandidateExperiment = EVERYTHING) -> float:
        """Share of an effect's columns that is left beside the model's, in an experiment.

        The largest over all directions of the columns; 0 where they vanish.
        """
        columns = _nonzero(self.columns(effect, trial))
        if not columns.shape[1]:
            return 0.0
        own, basis = _orthonormal(columns), self._basis(trial)
        rest = own - basis @ (basis.T @ own)
        return float(np.linalg.svd(rest, compute_uv=False)[0])

    def absorbing(self, effect: Effect, trial: CandidateExperiment = EVERYTHING) -> tuple[str, ...]:
        """Return the names of the model's parameters that take most of an effect's torque.

        None where it makes no torque.
        """
        torque = _nonzero(self.columns(effect, trial)).sum(axis=1)
        columns = self._model_columns(trial)
        scale = np.linalg.norm(columns, axis=0)
        scaled = columns / np.where(scale > 0, scale, 1.0)
        taken = np.abs(np.linalg.lstsq(scaled.T @ scaled, scaled.T @ torque, rcond=1e-10)[0])
        largest = np.argsort(-taken)[:2]
        large = [k for k in largest if taken[k] > 0.3 * taken[largest[0]] > 0]
        return tuple(self.model.names[self._counted()[k]] for k in large)

    def difference(
        self, effect: Effect, own: Sequence[float], other: Effect, trial: CandidateExperiment
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compare an effect's torque with what another effect and the model can make of it.

        Parameters
        ----------
        effect, own : the effect and its values.
        other : free in its values, as the model's parameters are.
        trial : the experiment.

        Returns
        -------
        Root mean squares of the torque, and of what is left of it, (n,) each.
        """
        torque = self.columns(effect, trial) @ np.asarray(own, dtype=float)
        basis = self._basis(trial)
        rest = self.columns(other, trial)
        rest = rest - basis @ (basis.T @ rest)
        norms = np.linalg.norm(rest, axis=0)
        before = np.linalg.norm(self.columns(other, trial), axis=0)
        rest = rest[:, norms > _DEPENDENT * before]
        remaining = torque - basis @ (basis.T @ torque)
        if rest.shape[1]:
            rest = _orthonormal(rest)
            remaining = remaining - rest @ (rest.T @ remaining)
        shape = (-1, self.model.robot.n)
        return tuple(np.sqrt(np.mean(x.reshape(shape) ** 2, axis=0)) for x in (torque, remaining))

    def columns(self, effect: Effect, trial: CandidateExperiment) -> np.ndarray:
        """Columns of an effect in an experiment, (rows, k)."""
        return np.concatenate([self._of_effect(effect, motion) for motion in trial.motions])

    @property
    def longer(self) -> float:
        """Length of a session that would show what the recorded one does not, s."""
        criteria = self.criteria.advice
        return max(criteria.session, criteria.longer * self.recorded.span)

    def slow(self, joint: int) -> float:
        """Speed below which a joint moves slowly, rad/s or m/s."""
        prismatic = self.model.robot.kinds[joint] == "prismatic"
        criteria = self.criteria.advice
        return criteria.slow_prismatic if prismatic else criteria.slow_revolute

    def pace(self, joint: int) -> float:
        """Speed, rad/s or m/s, that is advised as the highest of a joint."""
        limit = self.model.robot.joints[joint].velocity
        if np.isfinite(limit):
            return self.criteria.advice.limits_share * float(limit)
        usual = UNLIMITED[self.model.robot.kinds[joint]][1]
        return max(usual, self.criteria.advice.faster * float(self.recorded.speed[joint]))

    def reach(self, joint: int) -> tuple[float, float]:
        """Positions, rad or m, between which a joint is advised to move."""
        one = self.model.robot.joints[joint]
        if np.isfinite(one.lower) and np.isfinite(one.upper):
            middle, half = (one.lower + one.upper) / 2, (one.upper - one.lower) / 2
            half = self.criteria.advice.limits_share * half
            return float(middle - half), float(middle + half)
        usual = UNLIMITED[self.model.robot.kinds[joint]][0]
        lower, upper = float(self.recorded.lower[joint]), float(self.recorded.upper[joint])
        return (
            max(one.lower, min(lower, -usual)),
            min(one.upper, max(upper, usual)),
        )

    # --- columns -------------------------------------------------------------------------------

    def _of_effect(self, effect: Effect, motion: Motion) -> np.ndarray:
        if (effect, motion) not in self._effects:
            columns = effect.columns(self._ready(effect, motion))[::_EVERY]
            self._effects[effect, motion] = columns.reshape(-1, columns.shape[2])
        return self._effects[effect, motion]

    def _ready(self, effect: Effect, motion: Motion) -> Block:
        """A motion with what an effect needs of the model; shared by many."""
        key = (motion, self.model.shares_block(effect))
        if key not in self._blocks_ready:
            self._blocks_ready[key] = self.model.ready(effect, self._block(motion), self.values)
        return self._blocks_ready[key]

    # --- motions -------------------------------------------------------------------------------

    def _block(self, motion: Motion) -> Block:
        if motion not in self._blocks:
            name, joint = motion
            robot = self.model.robot
            speed = [self.pace(j) for j in range(robot.n)]
            (period, harmonics), seed = _WIDE, 1
            if name == "fast":
                (period, harmonics), seed = _FAST, 2
            if name == "slow":
                (period, harmonics), seed = _UNHURRIED, 3
                speed = [min(v, self.slow(j)) for j, v in enumerate(speed)]
            path = Fourier.random(robot, period, seed, harmonics, speed=speed)
            if joint is not None:
                moves = np.array([one == joint for one in robot.names])[:, None]
                path = replace(path, sine=path.sine * moves, cosine=path.cosine * moves)
            t = np.arange(_SAMPLES) * (period / _SAMPLES)
            q, v, a = path.at(t)
            late = self.longer * float(name == "late")
            loaded = name == "loaded"
            block = self.model.block(t + late, q, v, a, carries_payload=loaded)
            self._blocks[motion] = self.model.with_regressor(block)
        return self._blocks[motion]

    def _model_columns(self, trial: CandidateExperiment) -> np.ndarray:
        for motion in trial.motions:
            if motion not in self._columns:
                found = self.model.columns(self._block(motion), self.values)[::_EVERY]
                self._columns[motion] = found.reshape(-1, found.shape[2])
        columns = np.concatenate([self._columns[motion] for motion in trial.motions])
        return columns[:, self._counted()]

    def _counted(self) -> np.ndarray:
        """Which columns are the model's, indices."""
        counted = np.ones(self.model.size, dtype=bool)
        for label in self.excluded:
            if label in self.model:
                counted[self.model.slices[label]] = False
        return np.flatnonzero(counted)

    def _basis(self, trial: CandidateExperiment) -> np.ndarray:
        """Orthonormal basis of the model's columns, (rows, r)."""
        if trial not in self._bases:
            self._bases[trial] = _orthonormal(self._model_columns(trial))
        return self._bases[trial]


def _nonzero(columns: np.ndarray) -> np.ndarray:
    """Columns that do not vanish, of norm 1."""
    norms = np.linalg.norm(columns, axis=0)
    return columns[:, norms > 0] / norms[norms > 0]


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    basis, sizes, _ = np.linalg.svd(_nonzero(columns), full_matrices=False)
    return basis[:, sizes > _DEPENDENT * sizes.max(initial=0.0)]
