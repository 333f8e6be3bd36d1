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
from dynident.wiring.assignment import (
    MILLI,
    Assignment,
    Hypothesis,
    position_hypotheses,
    torque_hypotheses,
)
from dynident.wiring.described_torque import (
    DescribedScale,
    far_from_described,
    moves_as_described,
)
from dynident.wiring.gear_ratios import (
    motor_side_hypotheses,
    torque_scale_hypotheses,
    turns_too_far,
)
from dynident.wiring.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.wiring_rows import WiringRows

_NO_MORE = 1.01  # of the torque that a mend leaves, over what is left without: rounding
_LEAST_RATIO = 3.0  # of gears and units; below it is another torque constant
_OF_SIZE = ("torque_scale", "motor_side")
"""Faults that say of which size a torque is already."""
_SMALLER = ("degrees", "millimetres", "motor_side")
"""Faults whose mend makes a position smaller."""
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
        here = _Fits(model, rows, now)
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


class _Fits:
    """Fits of every plain hypothesis beside an assignment."""

    def __init__(self, model: Model, rows: WiringRows, now: Assignment) -> None:
        self.model, self.rows, self.now = model, rows, now
        self.regression = WiringRegression.of(model, rows.moved(now.change))
        self.start = self.regression.fit(now.torque_of, now.torque_scale)

    def all_plain(self, criteria: WiringCriteria) -> list[tuple[Hypothesis, TorqueFit]]:
        """Hypotheses with their fits, the plainest first."""
        own = torque_hypotheses(self.now)
        found = [(one, _fit(self.regression, one)) for one in own]
        kinds = self.model.robot.kinds
        revolute, prismatic = (
            tuple(i for i, kind in enumerate(kinds) if kind == one)
            for one in ("revolute", "prismatic")
        )
        for group in position_hypotheses(self.now, revolute, prismatic):
            motion = self.rows.moved(group[0].mended.change)
            regression = WiringRegression.of(self.model, motion)
            fits = [(one, _fit(regression, one)) for one in group]
            found += [
                (one, fit)
                for one, fit in fits
                if one.kind != "millimetres"
                or self._sized_as_described(one, regression, fit, criteria)
            ]
        scales = torque_scale_hypotheses(self.regression, self.now, self.start)
        return [*found, *(one for one in scales if _is_no_gain(one[0], self.model))]

    def but_excused(
        self, tried: list[tuple[Hypothesis, TorqueFit]], criteria: WiringCriteria
    ) -> list[tuple[Hypothesis, TorqueFit]]:
        """Leave out smaller positions that fit better only as something else does.

        Parameters
        ----------
        tried : hypotheses with their fits.
        criteria : by how much they must win, and within which share of a gain two are alike.
        """
        found = []
        for one, fit in tried:
            gain = fit.score - self.start.score
            wins = one.kind in _SMALLER and gain >= criteria.gain
            alike = (1.0 - criteria.tie) * gain
            if not (
                wins and (self._at_rest(one) >= alike or self._friction(one, criteria) >= alike)
            ):
                found.append((one, fit))
        return found

    def unit_of_slides(self, criteria: WiringCriteria) -> Hypothesis | None:
        """Lengths that are in mm by limits and forces alone, where a fit tells no scale."""
        kinds = enumerate(self.model.robot.kinds)
        slides = tuple(j for j, kind in kinds if kind == "prismatic" and self._far(j, criteria))
        if not slides:
            return None
        mended = self.now.positions_scaled(MILLI, *slides)
        one = Hypothesis(kind="millimetres", joints=slides, mended=mended)
        regression = WiringRegression.of(self.model, self.rows.moved(mended.change))
        sized = self._sized_as_described(one, regression, _fit(regression, one), criteria)
        return one if sized else None

    def lengths_in_metres(self, one: Assignment, criteria: WiringCriteria) -> Assignment:
        """An assignment with lengths that go too far taken for mm: they are told last."""
        kinds = enumerate(self.model.robot.kinds)
        slides = (j for j, kind in kinds if kind == "prismatic")
        far = [j for j in slides if turns_too_far(self.model, self.rows, one, j, criteria)]
        return one.positions_scaled(MILLI, *far) if far else one

    def _sized_as_described(
        self,
        one: Hypothesis,
        regression: WiringRegression,
        fit: TorqueFit,
        criteria: WiringCriteria,
    ) -> bool:
        """Whether limits or masses contradict lengths in m, and the masses none in mm.

        The scale of a length is that of a mass, which a fit makes up for: other screws fit alike.
        """
        model, joints = self.model, one.joints
        as_recorded = moves_as_described(model, self.regression, self.start.inertia, joints)
        mended = moves_as_described(model, regression, fit.inertia, joints)
        return mended and (any(self._far(j, criteria) for j in joints) or not as_recorded)

    def _far(self, joint: int, criteria: WiringCriteria) -> bool:
        return turns_too_far(self.model, self.rows, self.now, joint, criteria)

    def _at_rest(self, one: Hypothesis) -> float:
        """Gain of a position that stays where it is.

        Of a joint at rest the position is noise, and any scale that makes it smaller helps.
        """
        if len(one.joints) != 1:
            return -np.inf
        return self._gain(self.model, self.rows.moved(self.now.change).held(one.joints[0]))

    def _friction(self, one: Hypothesis, criteria: WiringCriteria) -> float:
        """Gain of the positions as they are, with the law of friction that smaller ones would have.

        Dry friction that reverses over a wide range of speeds makes viscous friction a curve: drag
        that the model lacks would be taken for degrees. Of a joint that turns farther than it can
        the position is too large anyhow.
        """
        wider = self.model
        for j in one.joints:
            if turns_too_far(self.model, self.rows, self.now, j, criteria):
                return -np.inf
            times = abs(float(self.now.position_scale[j] / one.mended.position_scale[j]))
            width = times * float(self.model.friction_widths[j])
            wider = wider.with_friction_width(self.model.robot.names[j], width)
        return self._gain(wider, self.rows.moved(self.now.change))

    def _gain(self, model: Model, rows: WiringRows) -> float:
        """By how much another motion, or another law of friction, fits better."""
        fitted = WiringRegression.of(model, rows).fit(self.now.torque_of, self.now.torque_scale)
        return fitted.score - self.start.score


def _is_no_gain(one: Hypothesis, model: Model) -> bool:
    """Whether a torque's scale is no drive gain: neither of a few times, nor in the model."""
    known = {effect.joint for effect in model.effects if effect.name == "drive_gain"}
    if any(model.robot.names[joint] in known for joint in one.joints):
        return False
    return max(one.ratios[0], 1.0 / one.ratios[0]) >= _LEAST_RATIO


def _settled(
    best: tuple[Hypothesis, TorqueFit] | None, here: _Fits, criteria: WiringCriteria
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
    best: tuple[Hypothesis, TorqueFit], tried: list[tuple[Hypothesis, TorqueFit]], here: _Fits
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


def _fit(regression: WiringRegression, one: Hypothesis) -> TorqueFit:
    return regression.fit(one.mended.torque_of, one.mended.torque_scale)


def _best(
    tried: Sequence[tuple[Hypothesis, TorqueFit]], here: _Fits, criteria: WiringCriteria
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
    gain = best[1].score - start.score
    more = np.mean(best[1].unexplained) > _NO_MORE * np.mean(start.unexplained)
    if best[0].kind == "torque_scale" and more:
        return False  # one joint fits better, and all together worse: any scale that does may come
    return gain >= criteria.gain and gain * rows.independent >= criteria.evidence
