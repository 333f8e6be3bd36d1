"""A second look, with many more shapes, where the first one leaves a residual unexplained.

A response in a gap fits where its shape is nearly the true one and nowhere else: the few shapes of
the first look may all miss it. What tells it then is that the value found is the one at which its
column was taken, which no accident brings about.
"""

from __future__ import annotations

from collections.abc import Callable

from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.held_out import on_recordings
from dynident.diagnose.present import Present
from dynident.diagnose.scoring import Score, candidate_moments, impossible, score
from dynident.diagnose.search import Ranking, candidates, judged, quiet_joints
from dynident.diagnose.verdict import within_noise
from dynident.effects import Effect

_LEAST = 0.1  # of the systematic square that the best of all shapes must explain, to be refined


def second_look(
    store: ColumnStore,
    start: Present,
    last: Present,
    first: Ranking,
    tell: Callable[[str], None] = lambda _: None,
) -> Ranking | None:
    """Return the first ranking with an effect at its head that it had missed; None for none.

    Parameters
    ----------
    store, start : the evidence, and the model before anything was added.
    last : the model with all that was added.
    first : the ranking on `start`.
    """
    if not start.noise_known or within_noise(on_recordings(store, last)):
        return None
    quiet = quiet_joints(store, start)
    found, tests = [], first.tests
    for effect in candidates(start.model):
        shapes = list(effect.dense_variants(start.model.robot))
        if not shapes or effect.joint in quiet:
            continue
        tell(f"{effect.label}, a second look")
        tests += len(shapes)
        found.append(_best(store, start, shapes))
    best = max(filter(None, found), key=lambda one: one.settled_drop, default=None)
    if best is None or best.settled_drop < _LEAST * start.error_signal:
        return None
    best, refusal = judged(store, start, best, tests)
    if refusal:
        return None
    rest = [
        (one, why)
        for one, why in zip(first.scores, first.refusals, strict=True)
        if one.effect.label != best.effect.label
    ]
    return Ranking((best, *(one for one, _ in rest)), tests, ("", *(why for _, why in rest)))


def _best(store: ColumnStore, present: Present, shapes: list[Effect]) -> Score | None:
    """The score of the shape that explains most at its own value; None where none is possible."""
    parts = candidate_moments(store, present, shapes)
    for shape in shapes:
        store.forget(shape)
    scores = [
        score(present, shape, *part, grid=len(shapes))
        for shape, part in zip(shapes, parts, strict=True)
    ]
    possible = [one for one in scores if not impossible(one, present.model)]
    return max(possible, key=lambda one: one.settled_drop, default=None)
