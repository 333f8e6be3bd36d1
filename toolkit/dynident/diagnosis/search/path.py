"""The path from the model as given to the final one: the order of its steps, and those taken back.

In: the model with all effects that the search added. Out: the path of models, along which the
held-out error falls from step to step, and what was withdrawn, as held-out recordings are predicted
worse with it.

A search adds at each step what explains most. The shapes that it tries of a response with backlash,
or of a spring, may all miss the true one, and what resembles it is added first: a delay, say. The
response follows, gets its shape, and may then explain by itself more than what stands before it. It
is named first then, as it would have been had its shape been known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import groupby, pairwise
from operator import sub

from dynident.diagnosis.details import Withdrawn
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.search.paired_falls import (
    fall_standard_error,
    joint_fall,
    largest_fall,
)
from dynident.diagnosis.search.refusal import newly_impossible
from dynident.diagnosis.search.selection import AddedEffect
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import HeldOut, on_held_out, on_recordings, with_noise_of
from dynident.tables import two_percent

_Group = tuple[AddedEffect, ...]


@dataclass(frozen=True, kw_only=True)
class Path:
    """From the model as given to the final one, an effect a step.

    Attributes
    ----------
    found : the effects, in the order of the steps.
    stages : the fits before any step and after each of them.
    judged : held-out errors of the same; they fall from step to step, over all joints or, within
        the standard error of that, at one.
    withdrawn : effects that were taken back.
    looks : times that held-out data have judged a path: more than once where the search has gone on
        after something was withdrawn.
    """

    found: tuple[AddedEffect, ...]
    stages: tuple[EvidenceFit, ...]
    judged: tuple[HeldOut, ...]
    withdrawn: tuple[Withdrawn, ...] = ()
    looks: int = 1

    @property
    def final(self) -> EvidenceFit:
        """The fit of the model with all effects that are kept."""
        return self.stages[-1]

    @property
    def notes(self) -> tuple[str, ...]:
        """What repeated looks make of the held-out error, in plain words."""
        if self.looks < 2 or not self.found:
            return ()
        return (
            f"Held-out data judged {self.looks} sets of effects, as others were sought after some "
            "were withdrawn: the error on them may be a little too low.",
        )


def path_of(
    evidence: Evidence,
    held: Evidence | None,
    start: EvidenceFit,
    fitted: EvidenceFit,
    found: tuple[AddedEffect, ...],
    progress: Callable[[str], None],
) -> Path:
    """Return the steps along which the held-out error falls; the others are withdrawn.

    Over all joints, or at one by far with no more than chance at the others; and not where the
    joint of an effect gets worse.

    A step with which it rises, or the values become impossible, is tried last, where another effect
    may be what it needs; if that does not help, the effect is withdrawn and all else fitted anew.

    Parameters
    ----------
    evidence, held : training and test recordings; without the latter blocks of time are held out.
    start, fitted : the model as given, and with all effects.
    found : these effects, in the order in which they were added.
    progress : is called with what is being done.

    Returns
    -------
    Fits and held-out errors along the path, and what was withdrawn.
    """
    withdrawn: tuple[Withdrawn, ...] = ()
    late: set[str] = set()
    known: dict[tuple[str, ...], tuple[EvidenceFit, HeldOut]] = {}
    while True:
        along = _judged_stages(evidence, held, (start, fitted), found, known)
        stages, judged = tuple(fit for fit, _ in along), tuple(errors for _, errors in along)
        impossible = [newly_impossible(evidence, *fits) for fits in pairwise(stages)]
        together = evidence.criteria.search.set_block
        worse = [
            _why(held, one.score.effect, errors, evidence.model.robot.names, together)
            for one, errors in zip(found, pairwise(judged), strict=True)
        ]
        reasons = [one or other for one, other in zip(impossible, worse, strict=True)]
        wrong = next((k for k, why in enumerate(reasons) if why), None)
        if wrong is None:
            return Path(found=found, stages=stages, judged=judged, withdrawn=withdrawn)
        one = found[wrong]
        label = one.score.effect.label
        others = (*found[:wrong], *found[wrong + 1 :])
        left = tuple(o for o in others if label not in o.score.effect.requires)
        if wrong < len(found) - 1 and label not in late:
            late.add(label)
            found = (*others, one)
            continue
        progress(f"withdrawing {label}")
        alike = () if impossible[wrong] else one.alternatives_to(fitted.model)
        taken_back = Withdrawn(effect=one.score.effect, why=reasons[wrong], with_it=alike)
        why = f"makes no torque without {label}"
        with_it = (Withdrawn(effect=o.score.effect, why=why) for o in others if o not in left)
        withdrawn = (*withdrawn, taken_back, *with_it)
        found = left
        known = {(): known[()]}
        rest = start
        if found:
            kept = {*(o.score.effect.label for o in found), *(e.label for e in start.model.effects)}
            gone = [e for e in fitted.model.effects if e.label not in kept]
            rest = fit_evidence(evidence, reduce(sub, gone, fitted.model), fitted)
        fitted = with_friction_width(evidence, rest) if found else start


def _why(
    held: Evidence | None,
    effect: Effect,
    errors: tuple[HeldOut, HeldOut],
    names: Sequence[str],
    together: int,
) -> str:
    """Why a step is taken back; empty where held-out data do not speak against it.

    The torque of a wrist is nothing beside that of a shoulder, whose own error moves by chance: a
    rise over all joints of less than its standard error counts for nothing beside a large fall at
    one joint. And what lies at a joint must not make that joint worse: by little more than chance
    it may only where another one gains by far.
    """
    before, after = errors
    where = "the test recordings" if held else "held-out blocks of time"

    def falls_far() -> bool:
        there = largest_fall(names, before, after, together)
        return there is not None and there.is_large

    if after.error > before.error:
        chance = fall_standard_error(before, after, together)
        if chance is None or after.error - before.error > chance or not falls_far():
            low, high = two_percent(before.error, after.error)
            return f"raises the error on {where} from {low} to {high}"
    if effect.joint in names:
        own = joint_fall(names, names.index(effect.joint), before, after, together)
        if own.is_rise or (own.may_be_rise and not falls_far()):
            low, high = two_percent(own.before, own.after)
            return f"raises the error of {own.joint} on {where} from {low} to {high}"
    return ""


def _judged_stages(
    evidence: Evidence,
    held: Evidence | None,
    ends: tuple[EvidenceFit, EvidenceFit],
    found: tuple[AddedEffect, ...],
    known: dict[tuple[str, ...], tuple[EvidenceFit, HeldOut]],
) -> tuple[tuple[EvidenceFit, HeldOut], ...]:
    """Fit and judge the models along a path, each with the friction widths that it calls for.

    An effect that another width stood in for must not be credited with what that width spoiled, nor
    the next one with what it mends.

    Parameters
    ----------
    evidence, held : as in `path_of`.
    ends : the fits of the first model and the last.
    found : the effects between them.
    known : what earlier orders of the same effects had in common with this one, which grows.
    """
    start, fitted = ends
    labels = tuple(one.score.effect.label for one in found)
    for many in range(len(labels) + 1):
        so_far = labels[:many]
        if so_far in known:
            continue
        if many == 0:
            stage = start
        elif many == len(labels):
            stage = fitted
        else:
            before = known[so_far[:-1]][0]
            wider = before.model + fitted.model.effect(so_far[-1])
            shapes = wider.with_shapes(fitted.model.effects)
            stage = with_friction_width(evidence, fit_evidence(evidence, shapes, before))
        known[so_far] = stage, judged_on(evidence, held, stage)
    return tuple(known[labels[:many]] for many in range(len(labels) + 1))


def judged_on(evidence: Evidence, held: Evidence | None, stage: EvidenceFit) -> HeldOut:
    """Return the errors of a fit on test recordings, or on held-out blocks where there are none.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings.
    stage : the fit.
    """
    judged = on_held_out(evidence, held, stage)
    if held is None or judged.noise_std is not None or not stage.noise_known:
        return judged
    return with_noise_of(judged, on_recordings(evidence, stage), evidence.criteria.noise)


def responses_in_place(
    evidence: Evidence, start: EvidenceFit, final: EvidenceFit, found: _Group
) -> _Group:
    """Return the effects in order, responses before what would explain clearly less there.

    Clearly: less than `SearchCriteria.simpler_share` of what the response explains on the training
    recordings, as in a choice among candidates. All else keeps its order, and what was added at
    several joints at once stays together.

    Parameters
    ----------
    evidence : the training recordings.
    start, final : the model as given, and with all effects, whose shapes are taken.
    found : these effects, in the order in which they were added.
    """

    def misfit(groups: Sequence[_Group]) -> float:
        labels = (one.score.effect.label for group in groups for one in group)
        effects = tuple(map(final.model.effect, labels))
        if not effects:
            return start.misfit(start)
        wider = (start.model + effects).with_shapes(final.model.effects)
        return with_friction_width(evidence, fit_evidence(evidence, wider, start)).misfit(start)

    order: list[_Group] = []
    for _, together in groupby(found, key=lambda one: one.with_it or one.score.effect.label):
        group, place = tuple(together), len(order)
        if any(one.score.effect.is_dynamic_response for one in group):
            place = _place(order, group, misfit, evidence.criteria.search.simpler_share)
        order.insert(place, group)
    return tuple(one for group in order for one in group)


def _place(
    order: list[_Group], group: _Group, misfit: Callable[[Sequence[_Group]], float], least: float
) -> int:
    """Where a group comes: before the first that explains less than a share of what it does."""
    for place, other in enumerate(order):
        before = misfit(order[:place])
        fall, others_fall = (before - misfit((*order[:place], one)) for one in (group, other))
        if fall > 0.0 and others_fall < least * fall:
            return place
    return len(order)
