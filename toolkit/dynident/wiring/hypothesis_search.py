"""The search for the assignment of columns to joints that the robot's equations of motion want.

Every hypothesis is a single fault. The one whose fit is the most likely by far, with inertias and
frictions that are possible, is accepted; then further faults are looked for beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.model import Model
from dynident.wiring.assignment import Assignment, Hypothesis
from dynident.wiring.described_torque import DescribedScale, far_from_described
from dynident.wiring.gear_ratios import motor_side_hypotheses, turns_too_far
from dynident.wiring.hypothesis_fits import HypothesisFits
from dynident.wiring.regressions.wiring_regression import TorqueFit
from dynident.wiring.regressions.wiring_rows import WiringRows

_NO_MORE = 1.01  # of the torque that a mend leaves, over what is left without: rounding
_OF_SIZE = ("torque_scale", "motor_side")
"""Faults that say of which size a torque is already."""
_ALIKE = 0.8
"""Share of the best gain with which scales of other joints stay in question."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Accepted:
    """A hypothesis that wins by far, with the fits before and after it."""

    hypothesis: Hypothesis
    before: TorqueFit
    after: TorqueFit


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchResult:
    """Faults that were accepted, and the fit without them.

    Attributes
    ----------
    accepted : in the order in which they were found.
    assignment : without these faults.
    fit : of it.
    """

    accepted: tuple[Accepted, ...]
    assignment: Assignment
    fit: TorqueFit


def search(model: Model, rows: WiringRows, criteria: WiringCriteria) -> SearchResult:
    """Accept faults one after the other, until none wins by far.

    Parameters
    ----------
    model : of which the robot and the width of friction count.
    rows : a few hundred, of all recordings.
    criteria : by how much a hypothesis must win, and how many faults are looked for.

    Returns
    -------
    The faults, with the assignment and the fit that are left.
    """
    now = Assignment.as_recorded(model.robot.n)
    accepted: list[Accepted] = []
    while True:
        here = HypothesisFits(model, rows, now)
        if len(accepted) == criteria.most_faults:
            break
        tried = here.but_excused(here.all_plain(criteria), criteria)
        best = _best(tried, here, criteria)
        if not _settled(best, here, criteria):
            gears = motor_side_hypotheses(model, rows, now, here.start, criteria)
            tried = here.but_excused([*_but_degrees_of_all(tried, gears), *gears], criteria)
            best = _best(tried, here, criteria)
        if best is None or not _wins(best, here.start, rows, criteria):
            break
        best = _nearest_described(best, tried, here)
        accepted.append(Accepted(hypothesis=best[0], before=here.start, after=best[1]))
        now = best[0].mended
    if lengths := here.unit_of_slides(criteria):
        accepted.append(Accepted(hypothesis=lengths, before=here.start, after=here.start))
        now = lengths.mended
    if not any(one.hypothesis.kind in _OF_SIZE for one in accepted):
        unit = DescribedScale.of(model, rows, now, criteria).hypothesis(now, criteria)
        if unit is not None:
            accepted.append(Accepted(hypothesis=unit, before=here.start, after=here.start))
            now = unit.mended
    return SearchResult(accepted=tuple(accepted), assignment=now, fit=here.start)


def _settled(
    best: tuple[Hypothesis, TorqueFit] | None, here: HypothesisFits, criteria: WiringCriteria
) -> bool:
    """Whether a plain hypothesis leaves nothing that gears would explain.

    Degrees look like a gear of 57 at one joint, but not at all.
    """
    if best is None or not _wins(best, here.start, here.rows, criteria):
        return False
    one, _ = best
    if one.kind == "degrees" and len(one.joints) == 1:
        return False
    joints = range(here.model.robot.n)
    mended = here.lengths_in_metres(one.mended, criteria)
    if any(turns_too_far(here.model, here.rows, mended, j, criteria) for j in joints):
        return False
    if one.kind != "degrees":
        return True
    far = [turns_too_far(here.model, here.rows, here.now, j, criteria) for j in one.joints]
    if any(far) and not all(far):
        return False  # where all are called degrees for the sake of one
    return DescribedScale.of(here.model, here.rows, mended, criteria).confirmed(criteria)


def _but_degrees_of_all(
    tried: list[tuple[Hypothesis, TorqueFit]], gears: list[tuple[Hypothesis, TorqueFit]]
) -> list[tuple[Hypothesis, TorqueFit]]:
    """Leave degrees of all joints out where gears of all fit better: 57 is no unusual ratio."""
    several = [fit.score for one, fit in gears if len(one.joints) > 1]
    return [
        (one, fit)
        for one, fit in tried
        if not (
            one.kind == "degrees"
            and len(one.joints) > 1
            and max(several, default=-np.inf) > fit.score
        )
    ]


def _nearest_described(
    best: tuple[Hypothesis, TorqueFit],
    tried: list[tuple[Hypothesis, TorqueFit]],
    here: HypothesisFits,
) -> tuple[Hypothesis, TorqueFit]:
    """Of scales that fit alike, the one with inertias as described: all others, or this one?"""
    if best[0].kind != "torque_scale":
        return best
    alike = [
        one
        for one in tried
        if one[0].kind == "torque_scale"
        and one[1].score - here.start.score > _ALIKE * (best[1].score - here.start.score)
    ]
    return min(alike, key=lambda x: far_from_described(here.model, here.regression, x[1].inertia))


def _best(
    tried: Sequence[tuple[Hypothesis, TorqueFit]], here: HypothesisFits, criteria: WiringCriteria
) -> tuple[Hypothesis, TorqueFit] | None:
    """The most likely hypothesis; among those that are as likely as it, the plainest.

    By less than a share of the gain and, where the most likely has no ratio that was sought, than
    what it takes to win.
    """
    if not tried:
        return None
    gains = np.array([fit.score - here.start.score for _, fit in tried])
    within = criteria.tie * max(float(gains.max()), 0.0)
    if not tried[int(gains.argmax())][0].ratios:
        within = min(within, criteria.evidence / here.rows.independent)
    return tried[int(np.argmax(gains >= gains.max() - within))]


def _wins(
    best: tuple[Hypothesis, TorqueFit],
    start: TorqueFit,
    rows: WiringRows,
    criteria: WiringCriteria,
) -> bool:
    more = np.mean(best[1].unexplained) > _NO_MORE * np.mean(start.unexplained)
    if best[0].kind == "torque_scale" and more:
        return False  # one joint fits better, and all together worse: any scale that does may come
    return is_better_by_far(best[1], start, rows, criteria)


def is_better_by_far(
    after: TorqueFit, before: TorqueFit, rows: WiringRows, criteria: WiringCriteria
) -> bool:
    """Whether a fit is so much more likely that what it supposes is accepted.

    Parameters
    ----------
    after, before : the fits.
    rows : of which they are.
    criteria : by how much it must win, per row and over all independent rows.

    Returns
    -------
    True if it is.
    """
    gain = after.score - before.score
    return gain >= criteria.gain and gain * rows.independent >= criteria.evidence


def mends(after: TorqueFit, before: TorqueFit, rows: WiringRows, criteria: WiringCriteria) -> bool:
    """Whether a fit is better by far and leaves less: more than that values became possible.

    Parameters
    ----------
    after, before, rows, criteria : as for `is_better_by_far`.

    Returns
    -------
    True if it is.
    """
    return after.misfit < before.misfit and is_better_by_far(after, before, rows, criteria)
