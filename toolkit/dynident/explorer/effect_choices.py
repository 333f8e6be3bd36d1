"""What a diagnosis offers to switch on: effects in groups, with what it says of each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from dynident.diagnosis.details import Candidate, Step
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect, Law
from dynident.study import Study
from dynident.tables import p_value, percent

Group = Literal["added", "proposed", "passing", "others"]

MOST_OTHERS = 20
"""Effects that pass no gate and are offered all the same."""


@dataclass(frozen=True, kw_only=True)
class EffectChoice:
    """An effect with a switch.

    Attributes
    ----------
    effect : with the shape that was found.
    group : "added" by the diagnosis, "proposed" as a law, "passing" every gate beside them, or
        one of the "others".
    words : what the diagnosis says of it.
    refusal : why it cannot be switched on; empty where it can.
    laws : formulas that the study does not have, to be written with it.
    """

    effect: Effect
    group: Group
    words: str
    refusal: str = ""
    laws: tuple[Law, ...] = ()

    @property
    def label(self) -> str:
        """As it stands in a study."""
        return self.effect.label


def effect_choices(diagnosis: Diagnosis, study: Study) -> tuple[EffectChoice, ...]:
    """Return every effect that a diagnosis offers, best first, each once.

    Parameters
    ----------
    diagnosis : of the study.
    study : says which effects are in the model, and which recordings carry a payload.
    """
    found: dict[str, EffectChoice] = {}
    for one in _in_order(diagnosis, study):
        if one.effect not in study.model:
            found.setdefault(one.label, one)
    others = [label for label, one in found.items() if one.group == "others"]
    dropped = set(others[MOST_OTHERS:])
    return tuple(one for label, one in found.items() if label not in dropped)


def _in_order(diagnosis: Diagnosis, study: Study) -> Iterator[EffectChoice]:
    for step in diagnosis.steps:
        yield EffectChoice(
            effect=step.effect,
            group="added",
            words=_of_step(step),
            refusal=_refusal(step.effect, study),
        )
    for proposal in diagnosis.proposals:
        yield _of_proposal(proposal)
    for group in ("passing", "others"):
        for one in diagnosis.candidates:
            if (one.status == "material") == (group == "passing"):
                yield EffectChoice(
                    effect=one.effect,
                    group=group,
                    words=_of_candidate(one),
                    refusal=_refusal(one.effect, study, one),
                )


def _of_step(step: Step) -> str:
    before, after = percent(step.test_error_before), percent(step.test_error_after)
    said = [f"The diagnosis added it: held-out error {before} to {after}."]
    if step.indistinguishable:
        titles = ", ".join(one.title for one in step.indistinguishable)
        said.append(f"These recordings cannot tell it from {titles}.")
    if step.advice:
        said.append(f"To tell them apart: {step.advice}.")
    return " ".join(said)


def _of_proposal(proposal: Proposal) -> EffectChoice:
    effect = proposal.effect
    return EffectChoice(
        effect=effect, group="proposed", words=proposal.sentence, laws=(effect.made_of,)
    )


def _of_candidate(one: Candidate) -> str:
    p = "" if one.p_value is None else f", p {p_value(one.p_value)}"
    finding = one.finding[:1].upper() + one.finding[1:]
    return f"Alone, on the model as given: {finding}{p}."


def _refusal(effect: Effect, study: Study, candidate: Candidate | None = None) -> str:
    """Say why an effect cannot be switched on, if it cannot."""
    if effect.found_by == "repetition":
        return "It happened once, and is left out of the recordings: no effect of the model."
    recordings = (study.train + study.test).recordings
    if effect.is_payload and not any(one.payload for one in recordings):
        return "Set payload = true in the [[recordings]] that carry it."
    if candidate is not None and candidate.status == "absorbed":
        return candidate.remark or "The model's own parameters take its place in this data."
    return ""
