"""Fits of every plain hypothesis beside an assignment of columns to joints."""

from __future__ import annotations

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
from dynident.wiring.described_torque import moves_as_described
from dynident.wiring.gear_ratios import torque_scale_hypotheses, turns_too_far
from dynident.wiring.regressions.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows

_LEAST_RATIO = 3.0  # of gears and units; below it is another torque constant
_SMALLER = ("degrees", "millimetres", "motor_side")
"""Faults whose mend makes a position smaller."""


class HypothesisFits:
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


def _fit(regression: WiringRegression, one: Hypothesis) -> TorqueFit:
    return regression.fit(one.mended.torque_of, one.mended.torque_scale)
