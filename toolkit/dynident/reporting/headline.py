"""The verdict as a reader meets it first: a short sentence, with the mark and title that fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from dynident.diagnosis.answer import Rest
from dynident.diagnosis.effect_groups import in_words
from dynident.diagnosis.leading_effects import LeadingEffects
from dynident.diagnosis.result import Diagnosis
from dynident.reporting.content import step_groups
from dynident.tables import listed, percent, two_percent

Mark = Literal["\u2713", "!", "?"]
"""Nothing is left but noise; something is to be mended or remains; it cannot be said."""

_COLOURS: dict[Mark, str] = {"\u2713": "nothing_missing", "!": "unexplained", "?": "unknown"}
_MORE: dict[Rest, str] = {
    "within the noise": "",
    "smaller than the noise": ", though not nothing",
    "larger than the noise": ", and may be what the steps of the encoders leave",
}
"""What is to be said beside the size of what remains."""
_MOST_NAMED = 2
"""Effects that the sentence names."""
_NOT_KNOWN = "The noise is unknown, so more may be missing."


@dataclass(frozen=True)
class Headline:
    """How the page opens.

    Attributes
    ----------
    mark : the icon before the sentence.
    title : of the page, after the robot's name.
    sentence : the verdict in at most some thirty words; `Diagnosis.sentence` has all of it.
    """

    mark: Mark
    title: str
    sentence: str

    @property
    def colour(self) -> str:
        """Class of the page by which it has its colour."""
        return _COLOURS[self.mark]


def headline(diagnosis: Diagnosis) -> Headline:
    """Return the verdict of a diagnosis in short."""
    if diagnosis.wiring:
        return Headline("!", "study to mend", "The recordings and the study contradict each other.")
    if diagnosis.impossible:
        values = ", ".join(diagnosis.impossible[:2])
        more = len(diagnosis.impossible) - 2
        rest = f" and {more} more" if more > 0 else ""
        said = f"No robot can have what the fit says: {values}{rest}."
        return _with_doubt(Headline("!", "impossible values", said), diagnosis)
    found = _with_doubt(_of_verdict(diagnosis), diagnosis)
    if diagnosis.sampled is not None:
        found = _doubted(found, "The torque is of another moment than the study says.")
    if diagnosis.hiding_filter is not None:
        found = _doubted(found, "The low-pass of the positions hides motion: settle that first.")
    if diagnosis.reversals_left_out:
        where = listed(list(diagnosis.reversals_left_out))
        found = _doubted(found, f"The reversals of {where} are left out: see the notes.")
    if diagnosis.not_judged_in_words:
        said = " ".join([found.sentence, *diagnosis.not_judged_in_words])
        found = replace(found, sentence=said)
    if diagnosis.bursts:
        where = listed(list(diagnosis.bursts))
        said = f"At {where} a few bursts hold most of what is left: see the notes."
        found = _doubted(found, said)
    if diagnosis.drifting:
        where = listed(list(diagnosis.drifting))
        found = _doubted(found, f"What drifts at {where} counts as noise: see the notes.")
    if diagnosis.limit is None:
        return found
    said = f"{found.sentence} {diagnosis.limit_in_words}."
    return Headline(found.mark, found.title, said)


def _doubted(found: Headline, said: str) -> Headline:
    """A headline with a sentence more, that nobody takes for a clean bill of health."""
    mark = "?" if found.mark == "\u2713" else found.mark
    return replace(found, mark=mark, sentence=f"{found.sentence} {said}")


def _with_doubt(found: Headline, diagnosis: Diagnosis) -> Headline:
    """A headline that asks first whether positions are those of the joints."""
    if diagnosis.too_fast is None:
        return found
    joint = diagnosis.too_fast.joint
    mark = "?" if found.mark == "\u2713" else found.mark
    first = f"{joint} is too fast for its limit: settle that first."
    return replace(found, mark=mark, sentence=f"{first} {found.sentence}")


def _of_verdict(diagnosis: Diagnosis) -> Headline:
    known = diagnosis.noise_source != "unknown"
    if not diagnosis.steps:
        return _nothing_added(diagnosis, known)
    found, title, stopped = _found(diagnosis), _title(diagnosis), diagnosis.limit is not None
    if diagnosis.following_motion:
        said = f"{found}, and what is left {_followed(diagnosis)}."
        return Headline("!", f"{title}, a residual remains", said)
    if diagnosis.training_only:
        said = f"{found}, and {_in_training(diagnosis)}."
        return Headline("!", f"{title}, a residual in training", said)
    if not known:
        more = diagnosis.verdict == "unexplained" and not stopped
        more = " More effects are significant." if more else ""
        return Headline("?", f"{title}, noise unknown", f"{found}.{more} {_NOT_KNOWN}")
    if diagnosis.verdict == "unexplained":
        none = "" if stopped else " unexplained"
        said = f"{found}, and a residual beyond the noise remains{none}.{_instead(diagnosis)}"
        return Headline("!", f"{title}, a residual remains", said)
    remains = f"what remains is {diagnosis.rest}{_MORE[diagnosis.rest]}"
    return Headline("\u2713", title, f"{found}; {remains}.")


def _instead(diagnosis: Diagnosis) -> str:
    """That a law is proposed in the place of effects that were added; empty where none is."""
    proposals = [one for one in diagnosis.proposals if one.instead_of]
    if not proposals:
        return ""
    after = percent(proposals[0].test_error_after)
    return f" A law in the place of {listed(list(proposals[0].instead_of))} takes it to {after}."


def _title(diagnosis: Diagnosis) -> str:
    """How many effects were found, and how many of them carry most of the fall."""
    count, found = len(diagnosis.steps), LeadingEffects.of(diagnosis.steps)
    if count == 1:
        return "one effect found"
    main = len(found.leading + found.local)
    if not found.smaller:
        return f"{count} effects found"
    return f"{in_words(main)} main effect{'s' if main > 1 else ''} found"


def _followed(diagnosis: Diagnosis) -> str:
    joints = " and ".join(diagnosis.following_motion)
    return f"at {joints} follows the motion: it is not all noise"


def _in_training(diagnosis: Diagnosis) -> str:
    joints = " and ".join(diagnosis.training_only)
    return (
        f"the training recordings leave more than their noise at {joints}, which the held-out "
        "recordings do not show"
    )


def _nothing_added(diagnosis: Diagnosis, known: bool) -> Headline:
    if diagnosis.following_motion:
        said = f"No effect of the catalogue is of use, and what is left {_followed(diagnosis)}."
        return Headline("!", "a residual remains", said)
    if diagnosis.training_only:
        said = f"No effect of the catalogue is of use, and {_in_training(diagnosis)}."
        return Headline("!", "a residual in training", said)
    if diagnosis.only_bursts:
        said = "No effect of the catalogue is of use, and what is left is hardly noise."
        return Headline("!", "a residual remains", said)
    if diagnosis.verdict == "unexplained":
        if known:
            none = ", and no effect of the catalogue explains it"
            if diagnosis.only_withdrawn:
                none = ", and what training recordings call for was withdrawn"
            said = f"A residual beyond the noise remains{none if diagnosis.limit is None else ''}."
            return Headline("!", "a residual remains", said)
        said = f"Effects are significant, and none was added. {_NOT_KNOWN}"
        return Headline("?", "nothing added, noise unknown", said)
    if known:
        rest = diagnosis.rest
        if rest != "within the noise":
            said = f"What remains is {rest}{_MORE[rest]}."
            return Headline("?", "no missing effect is found", said)
        if diagnosis.withdrawn:
            said = f"Held-out data confirm nothing that is missing, and what remains is {rest}."
            return Headline("?", "no missing effect is confirmed", said)
        if diagnosis.only_reversals_left:
            said = f"Away from reversals nothing is missing, and what remains is {rest}."
            return Headline("?", "nothing is missing away from reversals", said)
        said = f"Nothing is missing: what remains is {rest}."
        return Headline("\u2713", "nothing is missing", said)
    error = percent(diagnosis.test_error.after)
    none = "No effect of the catalogue was found to be of use"
    said = f"{none}, and the torque error is {error}. {_NOT_KNOWN}"
    return Headline("?", "nothing found, noise unknown", said)


def _found(diagnosis: Diagnosis) -> str:
    """The effects added, and what they do to the error."""
    error = diagnosis.test_error
    if all(step.effect.found_by == "repetition" for step in diagnosis.steps):
        # What happened once is no part of the errors.
        names = _capitalised(listed([step.effect.title for step in diagnosis.steps]))
        were, it = ("was", "it") if len(diagnosis.steps) == 1 else ("were", "them")
        return f"{names} {were} found, and beside {it} the torque error is {percent(error.after)}"
    before, after = two_percent(error.before, error.after)
    effects = LeadingEffects.of(diagnosis.steps)
    own, local = effects.own_joint_in_words(error, diagnosis.joints), effects.local_in_words
    local = local and f"; {local}"
    if own and error.after >= error.before:
        added = f"{_added(diagnosis)} the torque error of {own}"
        return f"{added}, and that of all joints from {before} to {after}{local}"
    own = own and f", that of {own}"
    return f"{_added(diagnosis)} the torque error from {before} to {after}{own}{local}"


def _added(diagnosis: Diagnosis) -> str:
    groups, found = step_groups(diagnosis), LeadingEffects.of(diagnosis.steps)
    count = len(diagnosis.steps)
    if found.local or found.smaller:
        main, names = len(found.leading), " and ".join(found.names)
        named = _capitalised(names) if main <= _MOST_NAMED else f"{main} effects"
        verb = "carries" if main == 1 else "carry"
        return f"{named} {verb} {found.carried} by which {count} effects take"
    if len(groups) != 1:
        return f"{count} effects take"
    only = groups[0]
    others = " or ".join(dict.fromkeys(one.title for one in only.others))
    name = _capitalised(only.title)
    return f"{name} (or {others}) takes" if others else f"{name} takes"


def _capitalised(words: str) -> str:
    return f"{words[0].upper()}{words[1:]}"
