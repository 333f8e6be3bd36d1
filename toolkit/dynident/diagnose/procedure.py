"""The loop: compare, find what is missing, add it, fit again, compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.closed_loop import Controller
from dynident.diagnose.blunting import blunted
from dynident.diagnose.diagnosis import Diagnosis
from dynident.diagnose.disturbances import Contacts
from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.held_out import on_recordings
from dynident.diagnose.present import Present, fit_present, residuals
from dynident.diagnose.runs import flagged_run, gather
from dynident.diagnose.scoring import Score
from dynident.diagnose.search import (
    ALIKE,
    Ranking,
    candidates,
    indistinguishable,
    rank,
)
from dynident.diagnose.shaping import best_shape, reshaped
from dynident.diagnose.simulated import motion_of_loop
from dynident.diagnose.telling import Found, Search, told
from dynident.diagnose.verdict import RESOLUTION
from dynident.effects import Effect
from dynident.fit.estimate import Estimate
from dynident.model import Model
from dynident.recording import Dataset, numbered
from dynident.threads import single_threaded

MOST_EFFECTS = 8
"""Effects that are added at most; two for each joint where there are more joints."""

_REFITS = 4  # of shapes whose columns depend on the bodies
_GAINED = 0.02  # share of the systematic square that another refit must take away
_ANOTHER = 0.1  # of the torque that must be explained for a model to be another one
_FIRST_SHARE = 0.75  # of the largest drop that a simpler effect must reach, to be named first
_NEARLY = 0.85  # of the largest drop, from which a rival that is not linear is fitted to compare
_LEAST_KEPT = 0.1  # of the drop that an effect promises, that is left when all is fitted with it
_LEAST_FALL = 0.015  # of a joint's squared noise that an effect must take off the held-out residual


@single_threaded
def diagnose(
    model: Model | Estimate,
    train: Dataset,
    test: Dataset | None = None,
    *,
    controller: Controller | None = None,
    most: int | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find where a model fails and which physical effects it lacks.

    Parameters
    ----------
    model : the model as given (or an estimate of it: it is fitted anew, with instruments where
        the motion repeats).
    train : recordings to fit.
    test : recordings to judge by; without any, blocks of the training recordings are held out.
    controller : of the closed loop behind the recordings; where nothing repeats, the simulated
        loop gives the instruments.
    most : effects that are added at most; see `MOST_EFFECTS`.
    tell : told what is being done, for a progress display.

    Raises
    ------
    RecordingError
        If a recording is too short, or does not repeat with its period.
    """
    given = model.model if isinstance(model, Estimate) else model
    most = max(MOST_EFFECTS, 2 * given.robot.n) if most is None else most
    train, *others = numbered(train, *([] if test is None else [test]))
    test = others[0] if others else None
    tell("reading the motion")
    loop = motion_of_loop(given, train, controller, tell)
    store = ColumnStore(given, loop.runs or gather(train))
    held = ColumnStore(given, gather(test)) if test is not None and len(test) else None
    tell("evaluating every effect")
    everything = [v for effect in candidates(given) for v in effect.variants(given.robot)]
    store.prepare([*given.effects, *everything])
    start = blunted(store, _shaped(store, given))
    tell("looking for contacts")
    if held is not None:
        held.prepare(start.model.effects)
    contacts = Contacts.leave_out(store, held, start)
    if contacts.bumps:
        start = blunted(store, _shaped(store, given))
    rounds = [rank(store, start, 0, tell)]
    present, found = start, []
    while len(found) < most and not _resolved(store, present):
        chosen = _choose(store, present, rounds[-1])
        if chosen is None:
            break
        tell(f"adding {chosen.score.effect.label}")
        _carry(store, chosen.score)
        wider = blunted(store, _refitted(store, present.model + chosen.score.effect, present))
        if _breaks_its_promise(present, wider, chosen.score):
            break
        found.append(chosen)
        present = wider
        if _has_changed(store, start, present):
            store.look_again()
        if loop.renew(store, present):
            present = blunted(store, _refitted(store, present.model, present))
        rounds.append(rank(store, present, len(found), tell))
        found[-1] = _alternatives_only(chosen, rounds[-1])
    if held is not None:
        _decide_payload(held, present)
    kept = _without_superfluous(store, held, present, found, tell)
    if len(kept.found) < len(found):
        rounds.append(rank(store, kept.final, len(kept.found), tell))
    sure = contacts.confirmed(kept.final)
    if sure.bumps != contacts.bumps:
        start = fit_present(store, start.model, start)
        kept = replace(kept, final=fit_present(store, kept.final.model, kept.final))
    disturbances = sure.told(start)
    search = Search(
        store, start, kept.final, tuple(kept.found), tuple(rounds), disturbances, loop.notes
    )
    return told(search, train, test, held)


def _has_changed(store: ColumnStore, start: Present, present: Present) -> bool:
    """Whether effects have changed the predicted torque enough to look at candidates again."""
    before, now = (on_recordings(store, one) for one in (start, present))
    return now.error < before.error - _ANOTHER


def _resolved(store: ColumnStore, present: Present) -> bool:
    """Whether what is left is too small a share of the torque for the processing to resolve."""
    judged = on_recordings(store, present)
    return bool(np.all(judged.residual_rms <= RESOLUTION * judged.torque_rms))


def _choose(store: ColumnStore, present: Present, ranking: Ranking) -> Found | None:
    """The best material effect; or the simpler one in it, where that does most of the work."""
    material = ranking.material
    if not material:
        return None
    best = material[0]
    simpler = [
        s
        for s in material
        if s.effect.name in best.effect.stands_in_for
        and s.effect.joint == best.effect.joint
        and s.drop >= _FIRST_SHARE * best.drop
    ]
    if simpler:
        # The column that they share is the same whoever it belongs to: both are named.
        return Found(simpler[0], ranking.corrected(simpler[0]), (best.effect,))
    alike = {*indistinguishable(ranking, best), *_alike_once_fitted(store, present, ranking)}
    among = [s for s in material if s is best or s.effect in alike]
    as_good = [s for s in among if s.drop >= _FIRST_SHARE * best.drop]
    chosen = min(as_good, key=_size)  # the first of the simplest: they stand in order
    others = tuple(s.effect for s in among if s is not chosen)
    return Found(chosen, ranking.corrected(chosen), others)


def _alike_once_fitted(
    store: ColumnStore, present: Present, ranking: Ranking
) -> tuple[Effect, ...]:
    """Rivals of the best effect that explain the same once each is fitted together with the model.

    Before, columns that are not linear in their values are those of a first guess.
    """
    best, *others = ranking.material
    rivals = [
        s
        for s in others
        if s.effect.secant
        and "whole" not in s.effect.needs
        and s.losses is not None
        and s.drop >= _NEARLY * best.drop
    ]
    if not (best.effect.secant and "whole" not in best.effect.needs and rivals):
        return ()

    def explained(effect: Effect) -> float:
        return (
            present.error_signal - fit_present(store, present.model + effect, present).error_signal
        )

    most = explained(best.effect)
    return tuple(s.effect for s in rivals if explained(s.effect) >= (1.0 - ALIKE) * most)


def _breaks_its_promise(present: Present, wider: Present, one: Score) -> bool:
    """Whether a driven response does not explain in a model what it explained beside it.

    With it the bodies change, and with them the response, which may not follow.
    """
    if not ({"body", "whole"} <= one.effect.needs and present.noise_known):
        return False
    return present.error_signal - wider.error_signal < _LEAST_KEPT * one.drop


def _size(one: Score) -> int:
    """Number of parameters that an effect brings: of what is alike, the simplest is added."""
    return len(one.values) + len(one.effect.shape)


def _alternatives_only(one: Found, following: Ranking) -> Found:
    """Leave out effects that stay material beside the one added: they are more, not instead."""
    still = {s.effect.label for s in following.material}
    alternatives = tuple(
        e
        for e in one.indistinguishable
        if e.label not in still or one.score.effect.name in e.contains
    )
    return replace(one, indistinguishable=alternatives)


def _carry(store: ColumnStore, score: Score) -> None:
    """Mark the runs that carry the payload, once that is known."""
    if score.carriers is not None:
        store.runs = tuple(
            flagged_run(run, carries)
            for run, carries in zip(store.runs, score.carriers, strict=True)
        )


def _shaped(store: ColumnStore, model: Model) -> Present:
    """Fit a model as it was given, each shape parameter sought on its grid."""
    present = fit_present(store, model)
    for effect in present.model.effects:
        if effect.shape_parameters(model.robot):
            others = fit_present(store, present.model - effect, present)
            better = best_shape(store, others, effect)
            present = fit_present(store, present.model.with_shapes((better,)), present)
    return _refitted(store, present.model, present)


def _refitted(store: ColumnStore, model: Model, near: Present | None = None) -> Present:
    """Fit a model, each shape parameter refined with the others as they are.

    Responses that depend on the bodies are refined again with the bodies that come out, which were
    others while the effect was missing, until nothing is gained.
    """
    present = fit_present(store, model, near)
    shaped = [e.label for e in model.effects if e.shape_parameters(model.robot)]
    driven = [e.label for e in model.effects if {"body", "whole"} <= e.needs]
    for again in range(_REFITS if driven else 1):
        labels = shaped if again == 0 and len(shaped) > 1 else driven
        before = present
        for label in labels:
            effect = next(e for e in present.model.effects if e.label == label)
            others = fit_present(store, present.model - effect, present)
            better = reshaped(store, others, present, effect).effect
            trial = fit_present(store, present.model.with_shapes((better,)), present)
            if trial.error_signal < present.error_signal:
                present = trial
        if before.error_signal - present.error_signal < _GAINED * before.error_signal:
            break
    return present


@dataclass(frozen=True)
class _Kept:
    """What is left when superfluous effects are dropped."""

    final: Present
    found: list[Found]


def _without_superfluous(
    store: ColumnStore,
    held: ColumnStore | None,
    present: Present,
    found: list[Found],
    tell: Callable[[str], None],
) -> _Kept:
    """Drop every added effect that the others have made superfluous, or that helps nowhere else."""
    kept = list(found)
    for one in found:
        if _belongs(one.score.effect, kept):
            continue
        effect = next(e for e in present.model.effects if e.label == one.score.effect.label)
        rest = fit_present(store, present.model - effect, present)
        tell(f"doing without {effect.label}")
        needed = len(kept) == 1 or rank(store, rest, len(kept) - 1, only=(effect,)).material
        if not needed or not _helps(held, rest, present):
            kept.remove(one)
            present = rest
    return _Kept(present, kept)


def _helps(held: ColumnStore | None, without: Present, present: Present) -> bool:
    """Whether an effect lowers the residual of the test recordings at any joint.

    The whole of it, or what of it repeats: columns that carry noise may take the latter away and
    add to the former.
    """
    if held is None:
        return True  # its gain was cross-validated
    before, after = (on_recordings(held, one) for one in (without, present))
    falls = [before.residual_rms**2 - after.residual_rms**2]
    scale = after.residual_rms
    if after.noise_std is not None and after.ratio is not None:
        assert before.noise_std is not None and before.ratio is not None
        scale = before.noise_std
        falls.append((before.ratio * before.noise_std) ** 2 - (after.ratio * after.noise_std) ** 2)
    return any(bool(np.any(fall > _LEAST_FALL * scale**2)) for fall in falls)


def _belongs(effect: Effect, found: list[Found]) -> bool:
    """Whether an effect is part of another one: without it the other would bring it back."""
    others = (one.score.effect for one in found)
    return any(effect.name in o.contains and effect.joint == o.joint for o in others)


def _decide_payload(held: ColumnStore, present: Present) -> None:
    """Decide which test recordings carry a payload of known inertia, where the study is silent."""
    if not any("payload" in effect.needs for effect in present.model.effects):
        return
    stated = [run.recording.payload is not None for run in held.runs]
    sums = []
    for carries in (False, True):
        held.runs = tuple(
            run if said else flagged_run(run, carries)
            for run, said in zip(held.runs, stated, strict=True)
        )
        misfits = residuals(held, present.model, present.values)
        sums.append([float(np.sum(e**2)) for e in misfits])
    held.runs = tuple(
        run if said else flagged_run(run, with_load < without)
        for run, said, without, with_load in zip(held.runs, stated, *sums, strict=True)
    )
