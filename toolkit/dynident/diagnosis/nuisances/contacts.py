"""Contacts in a diagnosis: found, left out of everything else, and told as steps of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from dynident.criteria import ContactCriteria
from dynident.diagnosis.nuisances.pulse_search import DisturbancePulse, find_contacts, without
from dynident.diagnosis.result import Candidate, Step
from dynident.effects import Effect, catalogue
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import Run
from dynident.model import Model


@dataclass(frozen=True)
class Disturbance:
    """A contact, with the held-out error before and after it is left out."""

    pulse: DisturbancePulse
    error_before: float
    error_after: float

    def effect(self, model: Model) -> Effect:
        """Return it as the effect of the catalogue that was found in repetitions."""
        kind = catalogue()["contact"]
        shape = (float(self.pulse.number), self.pulse.time, self.pulse.width)
        return kind(self.pulse.joint, None, shape).on(model.robot)

    def step(self, model: Model) -> Step:
        """Return it as a step of the diagnosis."""
        values = (self.pulse.amplitude,)
        return Step(
            self.effect(model), values, self.error_before, self.error_after, (), self.pulse.p_value
        )


@dataclass(frozen=True)
class Contacts:
    """The contacts in the recordings of a diagnosis.

    Attributes
    ----------
    evidence, held : training and test recordings; `held` is None where there are none.
    whole, whole_held : their runs with nothing left out.
    bumps, bumps_held : what was found in them.
    """

    evidence: Evidence
    held: Evidence | None
    whole: tuple[Run, ...]
    whole_held: tuple[Run, ...]
    pulses: tuple[DisturbancePulse, ...]
    pulses_held: tuple[DisturbancePulse, ...]

    @classmethod
    def leave_out(cls, evidence: Evidence, held: Evidence | None, fitted: EvidenceFit) -> Contacts:
        """Find contacts in the recordings and leave their instants out of both.

        Parameters
        ----------
        evidence, held : their runs are replaced.
        present : the model as it fits the training recordings.
        """
        whole, whole_held = evidence.runs, held.runs if held is not None else ()
        pulses = _resolved(evidence, fitted, find_contacts(evidence, fitted))
        pulses_held = (
            _resolved(held, fitted, find_contacts(held, fitted)) if held is not None else ()
        )
        found = cls(evidence, held, whole, whole_held, pulses, pulses_held)
        found._leave(pulses, pulses_held)
        return found

    def confirmed(self, fitted: EvidenceFit) -> Contacts:
        """Keep the contacts that a better model still shows, and leave only these out.

        What a poor model lacks is not quite the same in every repetition, as motions are not, and
        may look like a contact.
        """
        if not (self.pulses or self.pulses_held):
            return self
        self._leave((), ())
        again = find_contacts(self.evidence, fitted) if self.pulses else ()
        again_held = ()
        if self.held is not None and self.pulses_held:
            again_held = find_contacts(self.held, fitted)
        pulses, pulses_held = (
            _common(new, old, self.evidence.criteria.contacts.same_place)
            for new, old in ((again, self.pulses), (again_held, self.pulses_held))
        )
        self._leave(pulses, pulses_held)
        return replace(self, pulses=pulses, pulses_held=pulses_held)

    def told(self, fitted: EvidenceFit) -> tuple[Disturbance, ...]:
        """One disturbance a joint, the clearest, with the error before and after it is left out."""
        judged = self.held or self.evidence
        clearest: dict[str, DisturbancePulse] = {}
        for pulse in sorted((*self.pulses, *self.pulses_held), key=lambda one: one.p_value):
            clearest.setdefault(pulse.joint, pulse)
        if not clearest:
            return ()
        self._leave((), ())
        before = on_recordings(judged, fitted).error
        self._leave(self.pulses, self.pulses_held)
        after = on_recordings(judged, fitted).error
        told = []
        for pulse in clearest.values():
            told.append(Disturbance(pulse, before, after))
            before = after
        return tuple(told)

    def _leave(
        self, pulses: Sequence[DisturbancePulse], pulses_held: Sequence[DisturbancePulse]
    ) -> None:
        criteria = self.evidence.criteria.contacts
        self.evidence.runs = _masked(self.evidence.runs, self.whole, pulses, criteria)
        if self.held is not None:
            self.held.runs = _masked(self.held.runs, self.whole_held, pulses_held, criteria)


def _masked(
    runs: tuple[Run, ...],
    whole: tuple[Run, ...],
    pulses: Sequence[DisturbancePulse],
    criteria: ContactCriteria,
) -> tuple[Run, ...]:
    """Runs as they are now, with these bumps and no others left out."""
    found = []
    for r, (run, original) in enumerate(zip(runs, whole, strict=True)):
        again = replace(run, index=original.index, edges=original.edges, left_out=None)
        found.append(without(again, [pulse for pulse in pulses if pulse.run == r], criteria))
    return tuple(found)


def _resolved(
    evidence: Evidence, fitted: EvidenceFit, pulses: Sequence[DisturbancePulse]
) -> tuple[DisturbancePulse, ...]:
    """Bumps at joints whose residual is more than what differentiation and filters leave."""
    if not pulses:
        return ()
    judged = on_recordings(evidence, fitted)
    names = fitted.model.robot.names
    matters = judged.residual_rms > evidence.criteria.verdict.resolution * judged.torque_rms
    return tuple(pulse for pulse in pulses if matters[names.index(pulse.joint)])


def _common(
    pulses: Sequence[DisturbancePulse], others: Sequence[DisturbancePulse], reach: float
) -> tuple[DisturbancePulse, ...]:
    """Bumps that are among others too, at about the same time."""
    return tuple(
        one
        for one in pulses
        if any(
            (one.run, one.joint, one.repetition) == (two.run, two.joint, two.repetition)
            and abs(one.time - two.time) <= reach * (one.width + two.width)
            for two in others
        )
    )


def contact_candidates(
    model: Model, evidence: Evidence, found: tuple[Disturbance, ...]
) -> tuple[Candidate, ...]:
    """Return what is to be said of contacts at every joint."""
    repeats = any(run.kind == "repeated" for run in evidence.runs)
    by_joint = {one.pulse.joint: one for one in found}
    candidates = []
    for effect in catalogue()["contact"].candidates(model.robot):
        effect = effect.on(model.robot)
        one = by_joint.get(str(effect.joint))
        if one is not None:
            gain = one.error_before - one.error_after
            candidates.append(
                Candidate(
                    one.effect(model), "material", one.pulse.p_value, gain, (one.pulse.amplitude,)
                )
            )
        elif repeats:
            remark = "no burst differs from one repetition to another"
            candidates.append(Candidate(effect, "not_material", 1.0, 0.0, (), remark))
        else:
            candidates.append(Candidate(effect, "absorbed", None, 0.0, (), effect.advice))
    return tuple(candidates)
