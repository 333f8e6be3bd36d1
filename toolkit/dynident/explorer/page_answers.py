"""What the page answers: pure functions of a study as it was read and of the state of a tab."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from dynident.evidence import ResidualMap
from dynident.evidence.held_out import HeldOutRun
from dynident.explorer.opened_study import OpenedStudy
from dynident.explorer.page_figures import map_picture, measured_and_predicted
from dynident.explorer.switched_fit import SwitchedFit
from dynident.explorer.tab_state import TabState
from dynident.fitting.estimate import Estimate
from dynident.reporting.content import seen
from dynident.tables import Table, number, percent

_WIDTH = 2.0
"""Half width of an interval, in standard deviations: no more is said of it, for what they hold
differs, and stands below."""


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """The model as given beside the model with what a tab has switched on."""

    opened: OpenedStudy
    before: SwitchedFit
    now: SwitchedFit

    @classmethod
    def of(cls, opened: OpenedStudy, state: TabState) -> Contrast:
        """Fit both, or remember the fits.

        Parameters
        ----------
        opened : the study.
        state : what is switched on.

        Raises
        ------
        DynidentError
            If the recordings cannot carry the model.
        """
        fits = opened.refitter
        chosen = [one.effect for one in opened.chosen(state.on)]
        return cls(opened=opened, before=fits.fit(), now=fits.fit(chosen))

    @property
    def sentence(self) -> str:
        """The error of all joints, before and now."""
        before, now, floor = self.before.judged.error, self.now.judged.error, self.now.judged.floor
        ends = f"; the noise alone makes {percent(floor)}" if floor is not None else ""
        if self.now is self.before:
            least = ends or "; the noise is unknown"
            return f"All joints: {percent(before)}{least}. Nothing is switched on yet."
        return f"All joints: {percent(before)} before, {percent(now)} now{ends}."

    @property
    def worst_joint(self) -> int:
        """The joint at which most is left over, in its own torque, by the model as given."""
        judged = self.before.judged
        errors = judged.joint_errors if judged.ratio is None else judged.ratio
        return int(np.nanargmax(np.nan_to_num(errors)))

    @property
    def maps(self) -> tuple[ResidualMap, ...]:
        """Residual maps of all joints."""
        return self.opened.refitter.maps(self.before, self.now)

    def torque(self, recording: int, joint: int) -> go.Figure:
        """Draw a recording at a joint.

        Parameters
        ----------
        recording : its number, in the order of the page.
        joint : column of the joint.
        """
        robot = self.before.model.robot
        judged = self.now.judged
        noise = None if judged.noise_std is None else float(judged.noise_std[joint])
        runs = _runs(self.before, self.opened)[recording], _runs(self.now, self.opened)[recording]
        return measured_and_predicted(runs, joint, robot.torque_units[joint], noise)


def _runs(fit: SwitchedFit, opened: OpenedStudy) -> tuple[HeldOutRun, ...]:
    """Every recording, those that are judged by first."""
    return (*fit.judged.runs, *(fit.fitted.runs if len(opened.study.test) else ()))


def map_answer(
    maps: Sequence[ResidualMap], joint: str, against: str | None
) -> tuple[list[str], str | None, list[str], go.Figure]:
    """Choose a residual map of a joint.

    Parameters
    ----------
    maps : of all joints.
    joint : the name of the one that is shown.
    against : the quantity that was chosen; None, or one that it has no map of, for the one that
        shows most.

    Returns
    -------
    The quantities that there are maps of, the chosen one, what is seen in any, and the picture.
    """
    here = [one for one in maps if one.joint == joint]
    names = [one.against for one in here]
    telling = [one.against for one in here if one.sentence]
    if against not in names:
        against = (telling or names or [None])[0]
    shown = [one for one in here if one.against == against]
    words = [f"Model as given, against {one.against}: {seen(one)}" for one in here if one.sentence]
    if not words and shown:
        words = [f"Model as given: {seen(shown[0])}"]
    return names, against, words, map_picture(shown[0]) if shown else go.Figure()


def value_table(estimate: Estimate, labels: Sequence[str], impossible: Sequence[str]) -> Table:
    """Return the parameters of some effects with intervals of two standard deviations.

    Parameters
    ----------
    estimate : of the model with them.
    labels : of the effects.
    impossible : what the fit says that no robot can have.
    """
    model, sigma, rows = estimate.model, estimate.sigma, []
    for effect in model.effects:
        if effect.label in labels:
            own = model.slices[effect.label]
            for i in range(own.start, own.stop):
                rows.append(
                    _row(model.names[i], float(estimate.values[i]), sigma[i], model.units[i])
                )
            for shape in estimate.shapes:
                if shape.name in model.shape_names[effect.label]:
                    rows.append(_row(shape.name, shape.value, shape.sigma, shape.unit))
    notes = [estimate.headline] if estimate.headline else []
    if impossible:
        notes.insert(0, f"Impossible: no robot can have {', '.join(impossible)}.")
    notes.append(estimate.sigma_words)
    notes += [one for one in estimate.notes if one.startswith("sigma takes the shapes")]
    columns = ("parameter", "value", "\u00b1 2 sigma", "unit")
    title = "Values of the effects that are switched on"
    return Table(title, columns, tuple(rows), tuple(one for one in notes if one))


def _row(name: str, value: float, sigma: float, unit: str) -> tuple[str, str, str, str]:
    if not np.isfinite(sigma):
        return name, number(value), "as the diagnosis found it", unit
    half, digits = _WIDTH * float(sigma), 4
    if half > 0 and value:  # as many digits as the width tells apart
        digits = int(np.clip(np.ceil(np.log10(abs(value) / half)) + 2, 2, 9))
    ends = f"{number(value - half, digits)} to {number(value + half, digits)}"
    return name, number(value, max(digits, 3)), ends, unit
