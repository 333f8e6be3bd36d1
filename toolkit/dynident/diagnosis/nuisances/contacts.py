"""Contacts in a diagnosis: found, left out of everything else, reported as steps of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from dynident.criteria import ContactCriteria
from dynident.diagnosis.details import Candidate, Step
from dynident.diagnosis.nuisances.pulse_search import DisturbancePulse, find_contacts, without
from dynident.effects import Effect, catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import Run
from dynident.model import Model
from dynident.recording import Recording
from dynident.tables import number

_REACH = 2.0
"""Standard deviations of a pulse on either side, within which it is said to be."""


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """The clearest contact at a joint, with the held-out error before and after it is left out.

    Attributes
    ----------
    pulse : the contact.
    error_before, error_after : the held-out error.
    recording : where it is.
    more : other contacts at the same joint, in whichever recording; left out, too.
    """

    pulse: DisturbancePulse
    error_before: float
    error_after: float
    recording: Recording
    more: int = 0

    def sentence(self, model: Model) -> str:
        """Where the push is, on the clock of its recording, and how strong, in plain words."""
        pulse, robot = self.pulse, model.robot
        unit = robot.torque_units[robot.names.index(pulse.joint)]
        at, reach = pulse.time - self.recording.start, _REACH * pulse.width
        others = f", and {self.more} more pushes that are less clear" if self.more > 1 else ""
        others = ", and one more push that is less clear" if self.more == 1 else others
        return (
            f"Contact at {pulse.joint}: a push of {number(pulse.amplitude, 2)} {unit} in "
            f"{self.recording.where}, from t = {at - reach:.2f} to {at + reach:.2f} s{others}. "
            f"What is around {'them' if self.more else 'it'} is left out."
        )

    def effect(self, model: Model) -> Effect:
        """Return it as the effect of the catalogue that was found in repetitions."""
        kind = catalogue()["contact"]
        shape = (float(self.pulse.number), self.pulse.time, self.pulse.width)
        return kind(self.pulse.joint, None, shape).on(model.robot)

    def step(self, model: Model) -> Step:
        """Return it as a step of the diagnosis."""
        return Step(
            effect=self.effect(model),
            values=(self.pulse.amplitude,),
            test_error_before=self.error_before,
            test_error_after=self.error_after,
            indistinguishable=(),
            p_value=self.pulse.p_value,
        )


@dataclass(frozen=True)
class Contacts:
    """The contacts in the recordings of a diagnosis.

    Attributes
    ----------
    whole, whole_held : training and test runs with nothing left out.
    pulses, pulses_held : what was found in them.
    """

    whole: tuple[Run, ...]
    whole_held: tuple[Run, ...]
    pulses: tuple[DisturbancePulse, ...]
    pulses_held: tuple[DisturbancePulse, ...]

    @classmethod
    def find(cls, evidence: Evidence, held: Evidence | None, fitted: EvidenceFit) -> Contacts:
        """Find contacts in the recordings.

        Parameters
        ----------
        evidence, held : training and test recordings, nothing left out; `held` is None where there
            are none.
        fitted : the model as it fits the training recordings.

        Returns
        -------
        The pulses, and the recordings with nothing left out.
        """
        pulses = _resolved(evidence, fitted, find_contacts(evidence, fitted))
        if held is None:
            return cls(evidence.runs, (), pulses, ())
        pulses_held = _resolved(held, fitted, find_contacts(held, fitted))
        return cls(evidence.runs, held.runs, pulses, pulses_held)

    def left_out(self, evidence: Evidence) -> Evidence:
        """Return the training evidence without the instants of contacts."""
        return _without(evidence, self.whole, self.pulses)

    def left_out_of_test(self, held: Evidence | None) -> Evidence | None:
        """Return the test evidence without the instants of contacts."""
        return None if held is None else _without(held, self.whole_held, self.pulses_held)

    def confirmed(self, evidence: Evidence, held: Evidence | None, fitted: EvidenceFit) -> Contacts:
        """Return only the contacts that a better model still shows.

        What a poor model lacks is not quite the same in every repetition, as motions are not, and
        may look like a contact.

        Parameters
        ----------
        evidence, held : training and test recordings; what is left out of them does not matter.
        fitted : the better model.
        """
        criteria, pulses, pulses_held = evidence.criteria.contacts, (), ()
        if self.pulses:
            again = find_contacts(_without(evidence, self.whole, ()), fitted)
            pulses = _common(again, self.pulses, criteria.same_place)
        if held is not None and self.pulses_held:
            again = find_contacts(_without(held, self.whole_held, ()), fitted)
            pulses_held = _common(again, self.pulses_held, criteria.same_place)
        return replace(self, pulses=pulses, pulses_held=pulses_held)

    def disturbances(
        self, evidence: Evidence, held: Evidence | None, fitted: EvidenceFit
    ) -> tuple[Disturbance, ...]:
        """One disturbance a joint, the clearest, with the error before and after it is left out.

        Parameters
        ----------
        evidence, held : training and test recordings; errors are those of the latter, where there
            are any.
        fitted : the model that is judged.

        Returns
        -------
        One for each joint where a pulse was found, the clearest first. All pulses are left out at
        once: the first stands for what that changes, the others for no further change.
        """
        clearest: dict[str, list[DisturbancePulse]] = {}
        for pulse in sorted((*self.pulses, *self.pulses_held), key=lambda one: one.p_value):
            known = clearest.setdefault(pulse.joint, [])
            if not _common((pulse,), known, evidence.criteria.contacts.same_place):
                known.append(pulse)
        if not clearest:
            return ()
        judged, whole, pulses = evidence, self.whole, self.pulses
        if held is not None:
            judged, whole, pulses = held, self.whole_held, self.pulses_held
        before = on_recordings(_without(judged, whole, ()), fitted).error
        after = on_recordings(_without(judged, whole, pulses), fitted).error
        every = (run.recording for run in (*self.whole, *self.whole_held))
        recordings = {one.number: one for one in every}
        found = []
        for pulse, *others in clearest.values():
            one = Disturbance(
                pulse=pulse,
                error_before=before,
                error_after=after,
                recording=recordings[pulse.number],
                more=len(others),
            )
            found.append(one)
            before = after
        return tuple(found)


def _without(
    evidence: Evidence, whole: tuple[Run, ...], pulses: Sequence[DisturbancePulse]
) -> Evidence:
    """Evidence with the instants of these pulses, and of no others, left out."""
    return evidence.with_runs(_masked(evidence.runs, whole, pulses, evidence.criteria.contacts))


def _masked(
    runs: tuple[Run, ...],
    whole: tuple[Run, ...],
    pulses: Sequence[DisturbancePulse],
    criteria: ContactCriteria,
) -> tuple[Run, ...]:
    """Runs as they are now, with these pulses and no others left out."""
    found = []
    for r, (run, original) in enumerate(zip(runs, whole, strict=True)):
        again = replace(run, index=original.index, edges=original.edges, left_out=None)
        found.append(without(again, [pulse for pulse in pulses if pulse.run == r], criteria))
    return tuple(found)


def _resolved(
    evidence: Evidence, fitted: EvidenceFit, pulses: Sequence[DisturbancePulse]
) -> tuple[DisturbancePulse, ...]:
    """Pulses at joints whose residual is more than what differentiation and filters leave."""
    if not pulses:
        return ()
    judged = on_recordings(evidence, fitted)
    names = fitted.model.robot.names
    matters = judged.residual_rms > evidence.criteria.verdict.resolution * judged.torque_rms
    return tuple(pulse for pulse in pulses if matters[names.index(pulse.joint)])


def _common(
    pulses: Sequence[DisturbancePulse], others: Sequence[DisturbancePulse], reach: float
) -> tuple[DisturbancePulse, ...]:
    """Pulses that are among others too, at about the same time."""
    return tuple(
        one
        for one in pulses
        if any(
            (one.number, one.joint, one.repetition) == (two.number, two.joint, two.repetition)
            and abs(one.time - two.time) <= reach * (one.width + two.width)
            for two in others
        )
    )


def contact_candidates(
    model: Model, evidence: Evidence, found: tuple[Disturbance, ...]
) -> tuple[Candidate, ...]:
    """Return what is to be said of contacts at every joint.

    Parameters
    ----------
    model : the one that was given.
    evidence : the recordings; contacts are sought where a motion repeats.
    found : as `Contacts.disturbances` returns them.
    """
    repeats = any(run.kind == "repeated" for run in evidence.runs)
    by_joint = {one.pulse.joint: one for one in found}
    candidates = []
    for effect in catalogue()["contact"].candidates(model.robot):
        effect = effect.on(model.robot)
        one = by_joint.get(str(effect.joint))
        if one is not None:
            candidates.append(
                Candidate(
                    effect=one.effect(model),
                    status="material",
                    p_value=one.pulse.p_value,
                    test_gain=one.error_before - one.error_after,
                    values=(one.pulse.amplitude,),
                )
            )
        elif repeats:
            candidates.append(
                Candidate(
                    effect=effect,
                    status="not_material",
                    p_value=1.0,
                    test_gain=None,
                    remark="no burst differs from one repetition to another",
                )
            )
        else:
            candidates.append(
                Candidate(
                    effect=effect,
                    status="absorbed",
                    p_value=None,
                    test_gain=None,
                    remark=effect.advice,
                )
            )
    return tuple(candidates)
