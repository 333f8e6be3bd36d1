"""The words of the report, each defined once, for a reader who has never heard them."""

from __future__ import annotations

from dataclasses import dataclass

from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect
from dynident.inertia.parameters import MEANINGS, PARAMETERS

_SHOWS: dict[str, str] = {
    "velocity": "Friction shows here.",
    "position": "Gravity, springs and whatever depends on the position show here.",
    "acceleration": "Inertia shows here.",
    "load": "Load is the torque predicted: a wrong gain of the drive shows here.",
    "time": "Warming up, drifting and single disturbance pulses show here.",
    "cycles per revolution": "What comes back several times in each turn, as teeth and magnets do, "
    "shows here as a narrow peak.",
    "cycles per metre": "What comes back at equal distances, as the poles of a linear motor and "
    "the turns of a screw do, shows here as a narrow peak, up to 60 of them over the travel.",
}

_CONCEPTS: dict[str, str] = {
    "95 % interval": "where the true value lies in 19 of 20 such studies, if the model lacks "
    "nothing; the note below the table says what these intervals hold.",
    "fall": "of a step: by how many percentage points the torque error on held-out data falls when "
    "the effect is added to those before it; with its standard error over blocks of time. It is "
    "uncertain where it is within two of these.",
    "gain": "of a candidate: by how many percentage points the same error falls when it is added "
    "alone to the model, and all but the widths of dry friction is fitted anew. What two "
    "candidates share is in the gain of both: gains do not add up.",
    "held out": "not used by the fit that is judged: test recordings; without any, each block of "
    "time of the recordings, predicted by a fit to all others.",
    "noise floor": "the torque error that noise alone would make; no model can get below it.",
    "p": "how probable it is that an effect which has no part explains so much of the training "
    "recordings, all candidates counted.",
    "residual": "measured less predicted torque.",
    "significant and relevant": "of an effect: too large for chance, large enough to matter, and "
    "of use on blocks of time of the training recordings that were held out in turn.",
    "systematic / noise": "the part of the residual that repeats over the part that does not, root "
    "mean squares; below 0.3 it does not matter.",
    "torque error": "size (root mean square) of the residual over the size of the torque.",
}


@dataclass(frozen=True)
class GlossaryEntry:
    """An entry of the glossary: its anchor in the page, the word, what it means."""

    anchor: str
    word: str
    meaning: str


def meaning(effect: Effect) -> str:
    """What an effect is, as a clause in plain words."""
    return effect.meaning or f"it shows as {effect.sign_of}"


def use_of(against: str) -> str:
    """What a residual map against this quantity is looked at for; empty where that is not known."""
    return _SHOWS.get(against, "")


def glossary(diagnosis: Diagnosis) -> tuple[GlossaryEntry, ...]:
    """Return the effects, symbols and other words of a report, in alphabetical order.

    Effects are those that are named as an answer, symbols those of the final model.
    """
    named = [e for step in diagnosis.steps for e in (step.effect, *step.indistinguishable)]
    words = {one.name.replace("_", " "): f"{meaning(one)}." for one in named}
    terms = {**_CONCEPTS, **words, **_symbols(diagnosis)}
    order = sorted(terms, key=str.lower)
    return tuple(GlossaryEntry(f"term-{k}", word, terms[word]) for k, word in enumerate(order))


def _symbols(diagnosis: Diagnosis) -> dict[str, str]:
    """What each symbol of the final model stands for; one that several effects use, for each."""
    model = diagnosis.after.model
    found: dict[str, dict[str, str]] = {}
    for name in model.base.names:
        symbol = name.partition(".")[0]
        if symbol in PARAMETERS:
            words = f"{MEANINGS[PARAMETERS.index(symbol)]}, in the frame of the joint"
            found.setdefault(symbol, {})["rigid body"] = words
    for effect in model.effects:
        kind = effect.name.replace("_", " ")
        both = (*effect.parameters(model.robot), *effect.shape_parameters(model.robot))
        for one in both:
            words = f"{one.means or 'a parameter of it'}, in {one.unit}"
            found.setdefault(one.name, {})[kind] = words
    return {
        symbol: "; ".join(f"{words} ({kind})" for kind, words in uses.items()) + "."
        for symbol, uses in found.items()
    }
