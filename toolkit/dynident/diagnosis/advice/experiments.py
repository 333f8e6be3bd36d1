"""Which experiment would show an effect, or distinguish effects: in words, with numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.advice.candidate_experiments import (
    CandidateExperiment,
    CandidateExperiments,
    Recorded,
)
from dynident.effects import Effect
from dynident.errors import DynidentError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.tables import percent

DESIGNED = "record the motion that was designed"
"""How advice begins that is a designed recording."""
NO_MOTION = "no motion of"
"""How advice begins that names no recording, as there is none."""
_ROUNDING = 1e-6
"""Share of an effect's torque below which what another leaves of it is nothing."""


@dataclass(frozen=True, eq=False)
class Adviser:
    """Advice for one robot and what has been recorded of it.

    Attributes
    ----------
    trials : experiments that could be made.
    """

    trials: CandidateExperiments

    @classmethod
    def of(cls, evidence: Evidence, fitted: EvidenceFit) -> Adviser:
        """Return the adviser for a model as it fits the recordings of the evidence."""
        recorded = Recorded.of(evidence)
        return cls(
            CandidateExperiments(
                model=fitted.model,
                values=fitted.values,
                recorded=recorded,
                criteria=evidence.criteria,
            )
        )

    def revealing(self, effect: Effect) -> str:
        """Say which experiment would show an effect that the recordings do not show.

        One sentence without a full stop. Where the effect's torque is a part of the model's at
        every motion, it says that no experiment does.
        """
        if effect.shown_by == "repetition" or effect.needs_recording:
            # What depends on the past is no part of a model that sees the instant only.
            return self._by_kind(effect)
        try:
            least = self.trials.criteria.gates.not_identifiable
            not_identifiable = self.trials.left(effect) < least
        except DynidentError:
            return effect.advice
        if not not_identifiable:
            return self._by_kind(effect)
        part = " and ".join(self.trials.absorbing(effect))
        why = f"its torque cannot be told from that of {part}" if part else "it makes no torque"
        return f"{NO_MOTION} this robot shows {effect.title}: {why}"

    def separating(self, effects: Sequence[Effect], values: Sequence[float]) -> str:
        """Say which experiment would distinguish effects.

        The one in which the torque of the first is furthest from what any other, together with the
        model, can make of it.

        Parameters
        ----------
        effects : the one that was added, and those that explain the recordings as well.
        values : parameters of the first.

        Returns
        -------
        One sentence without a full stop; empty for fewer than two effects.
        """
        first, *others = effects
        others = [one for one in others if one.label != first.label]
        trials = self.trials.without((first, *others))
        same, hardly, apart = [], [], []
        for other in others:
            most = self._most_left(trials, first, values, other)
            told = hardly if most > _ROUNDING else same
            told = apart if most > self.trials.criteria.advice.clearly else told
            told.append(other)
        sentences = []
        if apart:
            best = self._best_trial(trials, first, values, apart)
            # Where no one experiment is good for all, the first pair has its own.
            best = best or self._best_trial(trials, first, values, apart[:1])
            assert best is not None
            sentences.append(self._in_words(first, best))
        if hardly:
            least = percent(self.trials.criteria.advice.clearly, 0)
            sentences.append(
                f"usual motions leave less than {least} of {first.title} beside {_either(hardly)}, "
                "a designed one may leave more"
            )
        if same:
            sentences.append(f"{NO_MOTION} this robot tells {first.title} from {_either(same)}")
        return "; ".join(sentences)

    # --- telling apart -------------------------------------------------------------------------

    def _best_trial(
        self,
        trials: CandidateExperiments,
        first: Effect,
        values: Sequence[float],
        others: Sequence[Effect],
    ) -> _Separation | None:
        criteria = self.trials.criteria.advice
        tried = self._tried(trials, first, values, others)
        found = [one for one in tried if one.size > criteria.clearly * one.torque]
        most = max((one.size for one in found), default=0.0)
        return next((one for one in found if one.size >= criteria.nearly * most), None)

    def _most_left(
        self,
        trials: CandidateExperiments,
        first: Effect,
        values: Sequence[float],
        other: Effect,
    ) -> float:
        """Share of the first effect's torque that the other leaves, in the best experiment."""
        tried = self._tried(trials, first, values, [other])
        return max((one.size / one.torque for one in tried), default=0.0)

    def _tried(
        self,
        trials: CandidateExperiments,
        first: Effect,
        values: Sequence[float],
        others: Sequence[Effect],
    ) -> list[_Separation]:
        """What the nearest of others leaves of an effect in each experiment in which it acts."""
        found = []
        for trial in self._candidates((first, *others)):
            try:
                pairs = [trials.difference(first, values, one, trial) for one in others]
            except DynidentError:
                continue
            torque, rest = min(pairs, key=lambda pair: float(np.linalg.norm(pair[1])))
            size, left = float(np.linalg.norm(torque)), float(np.linalg.norm(rest))
            if size > 0:
                worst = int(np.argmax(rest))
                found.append(_Separation(trial, left, size, worst, float(rest[worst])))
        return found

    def _candidates(self, effects: Sequence[Effect]) -> list[CandidateExperiment]:
        """Experiments in which effects may differ, the simpler ones first."""
        kinds = {effect.shown_by for effect in effects}
        alone = {name for effect in effects for name in (effect.joint, effect.source) if name}
        if len(self.trials.model.robot.names) == 1:
            alone = set()
        return [
            *(CandidateExperiment("alone", name) for name in sorted(alone)),
            *(CandidateExperiment(kind) for kind in ("slow", "wide", "fast")),
            *(CandidateExperiment(kind) for kind in ("session", "payload") if kind in kinds),
        ]

    def _in_words(self, first: Effect, best: _Separation) -> str:
        robot = self.trials.model.robot
        j = self._index(first.joint) if first.joint else best.joint
        unit = robot.torque_units[best.joint]
        there = f": there they differ by {best.rms:.2g} {unit} (rms) at {robot.names[best.joint]}"
        return self._trial_in_words(best.trial, j, first) + there

    def _trial_in_words(self, trial: CandidateExperiment, j: int, first: Effect) -> str:
        names, unit = self.trials.model.robot.names, self._unit(j)
        if trial.kind == "alone":
            k = self._index(trial.joint)
            still = "the other joints" if k == j else names[j]
            return f"move {names[k]} with {still} still, {self._up_to(k)}"
        if trial.kind == "fast":
            accelerate = f"beyond {self._faster(j):.2g} {unit}/s^2"
            return f"move all joints with {names[j]} {self._up_to(j)} and accelerating {accelerate}"
        if trial.kind == "slow":
            slow = f"{self.trials.slow(j):g} {unit}/s"
            return f"move all joints slowly, {names[j]} below {slow}, to and fro"
        if trial.kind in ("session", "payload"):
            return self._by_kind(first, trial.kind)
        return f"move all joints at once, {names[j]} {self._from_to(j)}, {self._up_to(j)}"

    # --- what shows one ------------------------------------------------------------------------

    def _by_kind(self, effect: Effect, kind: str | None = None) -> str:
        trials, kind = self.trials, kind or effect.shown_by
        if kind == "payload":
            return "record the same motion with the payload and without, and say which is which"
        if kind == "session":
            later, before = trials.longer / 60, trials.recorded.span / 60
            return (
                f"repeat one recording at the start of a session and {later:.0f} min later "
                f"(recorded: {before:.2g} min)"
            )
        if kind == "repetition":
            return f"record several periods of one motion of {effect.joint or 'all joints'}"
        if effect.joint is None:
            return self._of_all(kind, effect)
        j = self._index(effect.joint)
        name, unit, recorded = effect.joint, self._unit(j), trials.recorded
        if kind == "source alone" and effect.source:
            k = self._index(effect.source)
            return f"move {effect.source} with {name} still, {self._up_to(k)}"
        if kind == "slow":
            slow = f"{trials.slow(j):g} {unit}/s"
            return f"sweep {name} slowly, below {slow}, {self._from_to(j)} and back"
        if kind == "reversals":
            return f"let {name} change direction many times, {self._up_to(j)}"
        if kind == "tiny reversals":
            return f"move {name} to and fro by less than {self._tiny(j)}"
        if kind == "position range":
            return f"move {name} slowly {self._from_to(j)}, the other joints in several poses"
        if kind == "acceleration":
            return (
                f"accelerate {name} beyond {self._faster(j):.2g} {unit}/s^2 (recorded: up to "
                f"{recorded.acceleration[j]:.2g}), the other joints moving too"
            )
        if kind == "load":
            most = recorded.torque[j]
            return (
                f"move {name} slowly in both directions under loads of either sign beyond "
                f"{most:.2g} {trials.model.robot.torque_units[j]} (recorded: up to that), the "
                "other joints in several poses"
            )
        return f"move {name} in both directions {self._up_to(j)}"

    def _of_all(self, kind: str, effect: Effect) -> str:
        robot, recorded = self.trials.model.robot, self.trials.recorded
        if kind == "position range":
            gains = [
                (self.trials.reach(j)[1] - self.trials.reach(j)[0])
                / max(recorded.upper[j] - recorded.lower[j], 1e-9)
                for j in range(robot.n)
            ]
            j = int(np.argmax(gains))
            return f"move all joints slowly through many poses, {robot.names[j]} {self._from_to(j)}"
        if kind == "acceleration":
            each = ", ".join(
                f"{name} {self._faster(j):.2g} {self._unit(j)}/s^2"
                for j, name in enumerate(robot.names)
            )
            return f"move all joints faster, accelerating beyond: {each}"
        return effect.advice

    def _faster(self, j: int) -> float:
        """An acceleration above the recorded one, rad/s^2 or m/s^2."""
        return self.trials.criteria.advice.faster * float(self.trials.recorded.acceleration[j])

    def _tiny(self, j: int) -> str:
        """A motion to and fro that is tiny, with its unit."""
        criteria = self.trials.criteria.advice
        if self.trials.model.robot.kinds[j] == "prismatic":
            return f"{1000 * criteria.tiny_prismatic:g} mm"
        return f"{criteria.tiny_revolute:g} rad"

    def _up_to(self, j: int) -> str:
        """A speed above the recorded one where the joint can go faster."""
        pace, before = self.trials.pace(j), float(self.trials.recorded.speed[j])
        unit = self._unit(j)
        if pace > self.trials.criteria.advice.more * before:
            return f"at speeds up to {pace:.2g} {unit}/s (recorded: up to {before:.2g})"
        return f"at speeds from very slow up to {before:.2g} {unit}/s"

    def _from_to(self, j: int) -> str:
        recorded, unit = self.trials.recorded, self._unit(j)
        low, high = self.trials.reach(j)
        before = recorded.upper[j] - recorded.lower[j]
        if high - low > self.trials.criteria.advice.more * before:
            was = f"{recorded.lower[j]:.2g} to {recorded.upper[j]:.2g}"
            return f"from {low:.2g} to {high:.2g} {unit} (recorded: {was})"
        return f"from {recorded.lower[j]:.2g} to {recorded.upper[j]:.2g} {unit}"

    def _index(self, joint: str | None) -> int:
        return self.trials.model.robot.names.index(str(joint))

    def _unit(self, j: int) -> str:
        return "m" if self.trials.model.robot.kinds[j] == "prismatic" else "rad"


@dataclass(frozen=True)
class _Separation:
    """An experiment that tells effects apart: how far, of what torque, and where most, N m or N."""

    trial: CandidateExperiment
    size: float
    torque: float
    joint: int
    rms: float


def _either(effects: Sequence[Effect]) -> str:
    return " or ".join(one.title for one in effects)
