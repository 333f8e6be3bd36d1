"""What a diagnosis asks its reader to do."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dynident.diagnosis.advice.experiments import DESIGNED, NO_MOTION
from dynident.diagnosis.advice.open_groups import open_groups
from dynident.diagnosis.details import Step
from dynident.diagnosis.effect_groups import grouped_title, in_words
from dynident.diagnosis.leading_effects import LeadingEffects
from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect
from dynident.fitting.reversals.standing_joints import width_advice
from dynident.reporting.headline import headline
from dynident.reporting.joint_states import states
from dynident.tables import listed, percent, points
from dynident.wiring import Fault

_MOST_NAMED = 3
"""Effects that a sentence lists; the picture and the command name more of them."""
_LITTLE = 0.25
"""Part of the error, below which its fall is said to leave most of it."""
_DESIGN = "dynident explain STUDY --design next"
"""Designs the recording that tells all apart that a diagnosis left open."""
THIS_REPORT = "dynident explain STUDY --report report.html"
"""Command that writes the report, which its reader has already."""
FIRST = 3
"""Steps that are shown at once: who reads more has time to unfold them."""


@dataclass(frozen=True)
class Advice:
    """One thing to do: a sentence, what it rests on or leads to, and commands to type."""

    what: str
    why: str = ""
    commands: tuple[str, ...] = ()


def next_steps(diagnosis: Diagnosis) -> tuple[Advice, ...]:
    """What to do, the most useful first."""
    if diagnosis.wiring:
        return tuple(_to_mend(fault) for fault in diagnosis.wiring)
    # Friction and inertia have taken up a wrong moment: whatever is added comes after that.
    instead, besides = _to_try(diagnosis)
    first = [*_to_settle(diagnosis), *_to_unhide(diagnosis), *_to_time(diagnosis)]
    found = [*first, *instead, *_to_add(diagnosis)]
    if diagnosis.limit is not None and diagnosis.too_fast is None:
        what = "Allow the search more additions (--most)."
        found.append(Advice(what, f"{diagnosis.limit_in_words}."))
    elif diagnosis.verdict == "unexplained" and (
        diagnosis.noise_source != "unknown" or diagnosis.following_motion or diagnosis.only_bursts
    ):
        found.append(_unexplained(diagnosis))
    if diagnosis.noise_source == "unknown":
        found.append(_to_repeat(diagnosis))
    found += [*_to_separate(diagnosis), *besides, *_to_add_after(diagnosis)]
    if diagnosis.noise_source == "given":
        found.append(_to_repeat(diagnosis))
    not_identifiable = [c for c in diagnosis.candidates if c.status == "absorbed"]
    if not found:
        found.append(_all_is_well(diagnosis))
    if not_identifiable:
        many = len(not_identifiable) > 1
        what = (
            f"If you suspect one of the {len(not_identifiable)} effects"
            if many
            else "If you suspect the effect"
        )
        found.append(
            Advice(
                f"{what} that this data cannot show, record the motion named for it, if any is.",
                "They are listed, each with its experiment or why none shows it, under \u201cWhat "
                "this data cannot show\u201d.",
            )
        )
    return tuple(found)


def _all_is_well(diagnosis: Diagnosis) -> Advice:
    """What to do where nothing is to be added; reversals may be left out."""
    widths = _with_widths(diagnosis) if diagnosis.friction_widths else ""
    if diagnosis.reversals_left_out:
        where = listed(list(diagnosis.reversals_left_out))
        what = (
            f"Nothing of the catalogue is to be added.{widths} Do not trust the model at the "
            f"reversals of {where}: record them at several accelerations, which tell one law of "
            "dry friction from another."
        )
        return Advice(what, "Away from them what is left of the torque is noise.")
    what = "Nothing is to be added" + (f".{widths}" if widths else ": use the model as it is.")
    why = "What is left of the torque is noise, and no physics could take it away."
    return Advice(what, why)


def of_study(advice: Sequence[Advice], study: Path | str) -> tuple[Advice, ...]:
    """Return advice whose commands name a study's file, as they are typed."""
    name = shlex.quote(str(study))
    return tuple(
        replace(one, commands=tuple(c.replace("STUDY", name, 1) for c in one.commands))
        for one in advice
    )


def in_short(diagnosis: Diagnosis, study: Path) -> tuple[str, ...]:
    """Return the verdict and the first thing to do, a paragraph each: the end of a long text.

    Parameters
    ----------
    diagnosis : of the study.
    study : its file, as commands name it.
    """
    first, *_ = next_steps(diagnosis)
    return f"In short: {headline(diagnosis).sentence}", _typed("Next", first, study)


def then_record(diagnosis: Diagnosis, study: Path) -> tuple[str, ...]:
    """Return what follows it where a motion may tell effects that were added from others.

    Parameters
    ----------
    diagnosis, study : as for `in_short`.
    """
    first, groups = next_steps(diagnosis)[0], _told_by_motions(diagnosis)
    if not groups or _DESIGN in first.commands:
        return ()
    titles, rivals = [effect.title for effect, *_ in groups], groups[0][1:]
    each = f"it from {_either(rivals)}" if len(groups) == 1 else "each from what does the same"
    what = f"Before you believe in {_few_of(titles)}, record a motion that tells {each}."
    return (_typed("Then", Advice(what, commands=(_DESIGN,)), study),)


def _typed(when: str, advice: Advice, study: Path) -> str:
    """Advice as a paragraph of text, its commands below it."""
    (one,) = of_study([advice], study)
    return "\n".join([f"{when}: {one.what}", *(f"    {typed}" for typed in one.commands)])


def _to_mend(fault: Fault) -> Advice:
    what = f"Mend the study: {fault.what}. {fault.where}."
    return Advice(what, f"{fault.evidence[0].upper()}{fault.evidence[1:]}.", fault.mend)


def _to_settle(diagnosis: Diagnosis) -> list[Advice]:
    """That positions may be another's: no torque mends that, and many take it up."""
    if diagnosis.too_fast is None:
        return []
    what = (
        f"Settle first whether q.{diagnosis.too_fast.joint} is the position of that joint; how "
        "positions of motors are written: docs/howto/coupled_motors.md."
    )
    why = f"{diagnosis.too_fast.sentence} What is added before that may take up the wrong motion."
    return [Advice(what, why)]


def _to_unhide(diagnosis: Diagnosis) -> list[Advice]:
    """That the filter hides motion: what is left may be that, and effects may take it up."""
    hiding = diagnosis.hiding_filter
    if hiding is None:
        return []
    what = f"{hiding.mend[0].upper()}{hiding.mend[1:]}, and ask again."
    return [Advice(what, hiding.sentence, ("dynident explain STUDY",))]


def _to_time(diagnosis: Diagnosis) -> list[Advice]:
    """That the study says when the torque acts, where it says another moment."""
    if diagnosis.sampled is None:
        return []
    what = f"Try {diagnosis.sampled.mend} in the study."
    return [Advice(what, diagnosis.sampled.sentence, ("dynident explain STUDY",))]


def _to_add(diagnosis: Diagnosis) -> list[Advice]:
    """What carries the fall first, by how much it does; what is small beside it after that."""
    steps = _addable(diagnosis)
    if not steps or diagnosis.impossible:
        return []
    error = diagnosis.test_error
    found = LeadingEffects.of(steps)
    first = sorted(found.leading + found.local, key=lambda group: -sum(s.fall for s in group))
    names, labels = _added(first, len(diagnosis.joints))
    share, all_of_it = "", "That"
    if found.local or found.smaller:
        by = listed(found.names) if found.local else "this"
        there = found.local and f", and {found.local_in_words}"
        share = f"By {by} the error falls {found.carried}{there or ''}. "
        all_of_it = "All that was added"
    brings = f"{all_of_it} brings the error from {percent(error.before)}"
    floor = (
        ""
        if error.noise_floor is None
        else f"; noise alone would make {percent(error.noise_floor)}"
    )
    own = found.own_joint_in_words(error, diagnosis.joints)
    why = f"{share}{brings} to {percent(error.after)}{own and f', that of {own}'}{floor}."
    unclear = diagnosis.verdict == "unexplained" or diagnosis.noise_source == "unknown"
    if unclear and not own and error.before - error.after < _LITTLE * error.before:
        why += " Most of the error stays."
    if all(step.uncertain for group in first for step in group):
        asked = " ".join(f"--with {shlex.quote(label)}" for label in labels)
        it = "them" if labels[1:] else "it"
        what = f"Before you add {names}, hold out another recording, and see if the error falls."
        why += f" The fall with {it} is within two standard errors, and may be chance."
        return [Advice(what, why, (f"dynident compare STUDY {asked}",))]
    commands = (f"dynident add STUDY {shlex.join(labels)}", "dynident fit STUDY")
    what = f"Add {names} to the model, and fit it.{_untold(first)}{_with_widths(diagnosis)}"
    if any(step.effect.is_payload for group in first for step in group):
        what += (
            " Where the study does not say yet which recordings carry the payload, write payload = "
            "true or false into each of [[recordings]] first."
        )
    return [Advice(what, why, commands)]


def _untold(groups: Sequence[Sequence[Step]]) -> str:
    """What may be there instead of effects to add; empty where each is told from all others."""
    each = [
        f"{step.effect.title} from {_either(step.indistinguishable)}"
        for group in groups
        for step in group
        if step.indistinguishable
    ]
    return f" These data do not tell {_few_of(each)}." if each else ""


def _with_widths(diagnosis: Diagnosis) -> str:
    """What the study has to say first for its fits to be those of the diagnosis."""
    if not diagnosis.friction_widths:
        return ""
    return f" First {width_advice(diagnosis.friction_widths)}"


def _addable(diagnosis: Diagnosis) -> list[Step]:
    """What the study can take up: no event of one recording, and no gain that is fitted anyway.

    Nothing before it is settled whose positions these are, and nothing in whose place a law is
    proposed.
    """
    if diagnosis.too_fast is not None:
        return []
    superfluous = diagnosis.proposals[0].instead_of if diagnosis.proposals else ()
    fitted = set() if diagnosis.drives is None else set(diagnosis.drives.joints)
    return [
        step
        for step in diagnosis.steps
        if step.effect.found_by != "repetition"
        and step.effect.label not in superfluous
        and not (step.effect.name == "drive_gain" and step.effect.joint in fitted)
    ]


def _to_add_after(diagnosis: Diagnosis) -> list[Advice]:
    """What is small beside the effects that carry the fall."""
    steps = _addable(diagnosis)
    smaller = LeadingEffects.of(steps).smaller if steps else ()
    smaller = [group for group in smaller if sum(step.fall for step in group) > 0.0]
    certain = [group for group in smaller if not all(step.uncertain for step in group)]
    chance = [group for group in smaller if all(step.uncertain for step in group)]
    found = []
    if certain:
        names, labels = _added(certain, len(diagnosis.joints))
        why = f"Small beside what comes first: {_points_of(certain)} points of the fall."
        command = f"dynident add STUDY {shlex.join(labels)}"
        found.append(Advice(f"Then add {names}.", why, (command,)))
    if chance:
        names, labels = _added(chance, len(diagnosis.joints))
        them, fall = ("them", "The fall with each") if labels[1:] else ("it", "Its fall")
        what = f"Leave {names} out until another recording confirms {them}."
        why = f"{fall} is within two standard errors, and may be chance."
        found.append(Advice(what, why))
    return found


def _points_of(groups: Sequence[Sequence[Step]]) -> str:
    return points(sum(step.fall for group in groups for step in group))


def _added(groups: Sequence[Sequence[Step]], joints: int) -> tuple[str, list[str]]:
    """Effects in words, no more of them than a sentence lists, and the labels of all."""
    labels = [step.effect.label for group in groups for step in group]
    titles = [grouped_title([step.effect for step in group], joints) for group in groups]
    return _few_of(titles), labels


def _few_of(titles: list[str]) -> str:
    """No more of them than a sentence lists."""
    more = len(titles) - _MOST_NAMED
    return listed(titles[:_MOST_NAMED] + ([f"{in_words(more)} more"] if more > 0 else []))


def _to_separate(diagnosis: Diagnosis) -> list[Advice]:
    """Which recording tells effects that were added from those that do as well; one for all."""
    designed = [effect.label for effect, *_ in _told_by_motions(diagnosis)][:1]
    return [
        Advice(
            f"Before you believe in {step.effect.title}, record a motion that tells it from "
            f"{_either(step.indistinguishable)}.",
            f"With this data they do the same. {_experiments(step)}",
            (_DESIGN,) if step.effect.label in designed else (),
        )
        for step in diagnosis.steps
        if step.indistinguishable
    ]


def _told_by_motions(diagnosis: Diagnosis) -> list[tuple[Effect, ...]]:
    """Effects that were added, each with what a motion that is yet to be designed may tell it from.

    None where nothing is designed before the study is mended.
    """
    if diagnosis.wiring or diagnosis.impossible or diagnosis.too_fast is not None:
        return []
    advice = {step.effect.label: step.advice for step in diagnosis.steps}
    settled = (DESIGNED, NO_MOTION)
    groups = open_groups(diagnosis)
    return [one for one in groups if not advice[one[0].label].startswith(settled)]


def _to_try(diagnosis: Diagnosis) -> tuple[list[Advice], list[Advice]]:
    """Proposed laws, of which a robot knows nothing yet: in the place of effects, and besides."""
    instead, besides = [], []
    proposals = diagnosis.proposals if diagnosis.too_fast is None else ()
    for number, one in enumerate(proposals, 1):
        what = f"Ask yourself whether {one.effect.joint} can have the torque {one.torque}"
        why = (
            "It was found among many terms and fits: a mechanism that makes it is what would make "
            "it a finding. So would another recording, of which it takes as much."
        )
        command = f"dynident add STUDY --proposal {number}"
        if not one.instead_of or instead:
            besides.append(Advice(f"{what}.", why, (command,)))
            continue
        what = (
            f"Do not add {listed(list(one.instead_of))} yet. {what}: with it instead the error "
            f"falls from {percent(one.test_error_before)} to {percent(one.test_error_after)}."
        )
        instead.append(Advice(what, why, (command,)))
    return instead, besides


def _either(effects: tuple[Effect, ...]) -> str:
    return " and from ".join(effect.title for effect in effects)


def _experiments(step: Step) -> str:
    """The experiment that tells them apart; else each effect's own, once, with what it shows."""
    advice = getattr(step, "advice", "")
    if advice:
        return f"{advice[0].upper()}{advice[1:].rstrip('.')}."
    shows: dict[str, list[str]] = {}
    for effect in (step.effect, *step.indistinguishable):
        shows.setdefault(effect.advice, []).append(effect.title)
    return " ".join(f"To see {' or '.join(titles)}: {advice}." for advice, titles in shows.items())


def _unexplained(diagnosis: Diagnosis) -> Advice:
    if diagnosis.training_only:
        where = listed(list(diagnosis.training_only))
        return Advice(
            f"Hold out a recording with the motion that shows what is left at {where}.",
            "The pictures are of the held-out recordings, which do not show it. The notes say in "
            "which training recording it is largest, and when.",
        )
    worst = [one.joint.name for one in states(diagnosis) if one.state == "failing"]
    worst = worst or list(diagnosis.following_motion or diagnosis.bursts)
    where = listed(worst[:3]) or "the joints"
    explained = "that no effect of the catalogue explains"
    if diagnosis.only_withdrawn:
        explained = "that no effect explains which helps on held-out data, too"
    return Advice(
        f"Look at the pictures of {where} in the report: something is left there {explained}.",
        "The shape in the pictures is what is known of it. Rule out the simple causes first: a "
        "wrong unit or scale of a column, a clock that jitters, a filter that cuts too low, a "
        "cable, a hand on the robot.",
        (THIS_REPORT,),
    )


def _to_repeat(diagnosis: Diagnosis) -> Advice:
    what = "Record a motion that repeats: the same period, twice or more, without a pause."
    why = (
        "What repeats is the model's fault, what does not is noise: only that tells how much of "
        "the error can be taken away."
    )
    if diagnosis.noise_source == "given":
        why = f"The noise is so far only what the study states. {why}"
    if diagnosis.too_fast is not None or not all(
        one.is_of_an_instant for one in diagnosis.before.model.effects
    ):
        return Advice(what, why)
    why += " `design` makes one within the limits that the description states, or usual ones."
    return Advice(what, why, ("dynident design STUDY --out next",))
