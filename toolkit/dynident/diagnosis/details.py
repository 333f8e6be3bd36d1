"""What a diagnosis consists of: candidates, steps, joints, the error, torques to be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from dynident.effects import Effect
from dynident.tables import points, two_percent

Status = Literal["material", "not_material", "absorbed"]
LARGE_AT_A_JOINT = 1.0 / 3.0
"""Share of a joint's own error that an effect which is large there takes away, at least."""
_MANY = 2.0
"""Standard errors within which a fall may be chance."""
_BEST = 3.0
"""The same of the joint at which it is largest: that is the best of several."""
IMPOSSIBLE = "makes the impossible"
"""Begins the remark on an effect whose fit has values that no robot has."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that was tried on the model as it was given.

    Attributes
    ----------
    effect : with the shape at which it does best.
    status : "material" (significant and relevant: it passes every gate), "not_material", or
        "absorbed" (not identifiable: the model's own parameters take its place in this data).
    p_value : of the hypothesis that it has no part, corrected for the number of candidates;
        None where it is not identifiable.
    test_gain : by how much the relative torque error on held-out data falls with it alone added
        and all but the widths of dry friction fitted anew; None where that was not tried.
    values : its parameters if it were added.
    remark : which gate it does not pass, or the experiment that would show it.
    """

    effect: Effect
    status: Status
    p_value: float | None
    test_gain: float | None
    values: tuple[float, ...] = ()
    remark: str = ""

    @property
    def finding(self) -> str:
        """The status in plain words: of what does not pass, the gate that it does not pass."""
        match self.status:
            case "material":
                return "significant and relevant"
            case "absorbed":
                return "not identifiable"
        return self.remark or "not significant"

    @property
    def finding_of_added(self) -> str:
        """The same of an effect that was added, though an earlier fit with it may be refused."""
        if self.finding.startswith(IMPOSSIBLE):
            return f"a first fit with it {self.finding}; the one that is taken does not; added"
        return f"{self.finding}; added"


@dataclass(frozen=True, kw_only=True)
class HidingFilter:
    """A low-pass of the positions that hides motion, which no torque can follow then.

    Attributes
    ----------
    cutoff_hz : that of the study.
    suited_hz : the one that suits the recordings.
    """

    cutoff_hz: float
    suited_hz: float

    @property
    def sentence(self) -> str:
        """What it may have done."""
        return (
            f"The low-pass of the positions ({self.cutoff_hz:.4g} Hz; {self.suited_hz:.3g} Hz "
            "suits these recordings) hides motion, and what is left may be no more than that."
        )

    @property
    def mend(self) -> str:
        """What to change in a study."""
        return f"leave position_cutoff_hz = {self.cutoff_hz:.4g} out of [filter]"


@dataclass(frozen=True, kw_only=True)
class JointFall:
    """What an effect does to the held-out error of one joint, over that joint's own torque.

    Attributes
    ----------
    joint : its name.
    before, after : norm of the residual over norm of the torque.
    standard_error : of the fall, as `Step.fall_standard_error`; None where it is not known.
    """

    joint: str
    before: float
    after: float
    standard_error: float | None = None

    @property
    def is_large(self) -> bool:
        """Whether it takes a good part of what that joint leaves, and not by chance."""
        fall = self.before - self.after
        return self._beyond(_BEST, fall) and fall >= LARGE_AT_A_JOINT * self.before

    @property
    def is_rise(self) -> bool:
        """Whether it rises instead, and not by chance."""
        return self._beyond(_MANY, self.after - self.before)

    @property
    def may_be_rise(self) -> bool:
        """Whether it rises by more than the standard error."""
        return self._beyond(1.0, self.after - self.before)

    def _beyond(self, many: float, change: float) -> bool:
        error = self.standard_error
        return error is not None and change > max(many * error, 0.0)

    @property
    def in_words(self) -> str:
        """As "joint6 from 15.00 % to 4.00 %"."""
        before, after = two_percent(self.before, self.after)
        return f"{self.joint} from {before} to {after}"


@dataclass(frozen=True, kw_only=True)
class Step:
    """One effect added, and what the test recordings say of it.

    Attributes
    ----------
    effect : the effect with its refined shape.
    values : its parameters in the joint fit that follows, (k,).
    test_error_before, test_error_after : relative torque error on the test recordings.
    indistinguishable : effects that are indistinguishable from it with this data.
    p_value : as in `Candidate`.
    advice : the experiment that would distinguish it from those; empty where there are none.
    fall_standard_error : of the fall from `test_error_before` to `test_error_after`, over blocks of
        time, see `dynident.diagnosis.search.paired_falls`; None where it is not known.
    at_joint : the joint whose own error falls by the largest part; None where none falls.
    """

    effect: Effect
    values: tuple[float, ...]
    test_error_before: float
    test_error_after: float
    indistinguishable: tuple[Effect, ...]
    p_value: float
    advice: str = ""
    fall_standard_error: float | None = None
    at_joint: JointFall | None = None

    @property
    def fall(self) -> float:
        """By how much the relative torque error on the test recordings falls."""
        return self.test_error_before - self.test_error_after

    @property
    def uncertain(self) -> bool:
        """Whether its fall is within two standard errors: blocks of time scatter as much.

        Over all joints a small one counts for little: what is large at its own joint is certain.
        """
        there = self.at_joint
        return self.uncertain_over_all and not (there is not None and there.is_large)

    @property
    def uncertain_over_all(self) -> bool:
        """The same of the error over all joints alone."""
        error = self.fall_standard_error
        return error is not None and self.fall <= _MANY * error

    @property
    def fall_in_words(self) -> str:
        """The fall in percentage points, with its standard error where that is known."""
        if self.fall_standard_error is None:
            return points(self.fall)
        doubt = ", uncertain" if self.uncertain else ""
        error = 100.0 * self.fall_standard_error
        # Two digits of the error, and of the fall as many decimals.
        decimals = 2 if error <= 0.0 else int(np.clip(1 - np.floor(np.log10(error)), 2, 4))
        return f"{100.0 * self.fall:.{decimals}f} \u00b1 {error:.{decimals}f}{doubt}"

    def details(self) -> dict[str, Any]:
        """The standard error of the fall, and the joint that gains most, as JSON has them."""
        error, joint = self.fall_standard_error, self.at_joint
        found: dict[str, Any] = {} if error is None else {"fall_standard_error": error}
        return found if joint is None else {**found, "at_joint": asdict(joint)}


@dataclass(frozen=True, kw_only=True)
class Withdrawn:
    """An effect that passed every gate on the training recordings, and was taken back.

    Attributes
    ----------
    effect : the effect.
    why : in words that follow its name.
    with_it : effects that the training recordings cannot tell from it, which were not tried in its
        place: the test recordings would have chosen among them, and then judged their choice.
    """

    effect: Effect
    why: str
    with_it: tuple[Effect, ...] = ()

    @property
    def sentence(self) -> str:
        """The effect, why it was taken back, and what was not tried in its place."""
        titles = " and ".join(one.title for one in self.with_it)
        verb = "is" if len(self.with_it) == 1 else "are"
        rest = f" Not tried in its place: {titles}, which {verb} indistinguishable from it."
        return f"Withdrawn: {self.effect.title}, which {self.why}.{rest if titles else ''}"

    @property
    def refusals(self) -> dict[str, str]:
        """Why it and those with it are not tried again, by label."""
        alike = f"indistinguishable from {self.effect.title}, which {self.why}"
        return {**{one.label: alike for one in self.with_it}, self.effect.label: self.why}

    def to_dict(self) -> dict[str, Any]:
        """The effect as JSON has it."""
        with_it = [place(one) for one in self.with_it]
        found = {**place(self.effect), "why": self.why}
        return {**found, "with_it": with_it} if with_it else found


@dataclass(frozen=True, kw_only=True)
class JointResult:
    """Errors at one joint, on the test recordings.

    Attributes
    ----------
    name, torque_unit : the joint; and N m or N, or the unit of the drives.
    error_before, error_after : norm of the residual over norm of the torque; NaN without torque.
    torque_rms : in that unit.
    noise_rms : likewise; None where the noise is unknown.
    ratio_before, ratio_after : systematic residual over noise (RNR); None likewise.
    """

    name: str
    torque_unit: str
    error_before: float
    error_after: float
    torque_rms: float
    noise_rms: float | None
    ratio_before: float | None
    ratio_after: float | None

    @property
    def noise_share(self) -> float | None:
        """The noise over the torque; None where either is unknown or there is no torque."""
        if self.noise_rms is None or not self.torque_rms > 0:
            return None
        return self.noise_rms / self.torque_rms


@dataclass(frozen=True, kw_only=True)
class TestError:
    """Relative torque error over all joints of the test recordings."""

    before: float
    after: float
    noise_floor: float | None


@dataclass(frozen=True, kw_only=True)
class Trace:
    """Measured and predicted torque of one joint in one test recording, (T,) each.

    Time in s, torque in `torque_unit`.
    """

    recording: str
    joint: str
    torque_unit: str
    t: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray


def named_together(steps: Sequence[Step], every: Sequence[Step] = ()) -> list[str]:
    """Name each step with everything that is indistinguishable from it: never one alone.

    What every joint has is named once, with its joints.

    Parameters
    ----------
    steps : that are named.
    every : all steps of the path, which are nobody's alternatives; by default the same.
    """
    added = {one.effect.label for one in (every or steps)}
    found = []
    for group in together(steps):
        first, joints = group[0].effect, [str(one.effect.joint) for one in group]
        title = first.title
        if len(group) > 1:
            title = f"{first.name.replace('_', ' ')} at {', '.join(joints[:-1])} and {joints[-1]}"
        others = [e.title for s in group for e in s.indistinguishable if e.label not in added]
        found.append(title + (f" (or {' or '.join(dict.fromkeys(others))})" if others else ""))
    return found


def together(steps: Sequence[Step]) -> list[list[Step]]:
    """Steps that are told as one, what every joint has; each of the others alone."""
    groups: dict[str, list[Step]] = {}
    for step in steps:
        one = step.effect.at_every_joint
        groups.setdefault(step.effect.name if one else step.effect.label, []).append(step)
    return list(groups.values())


def step_notes(steps: Sequence[Step]) -> tuple[str, ...]:
    """How a table of steps is to be read; empty where no standard error is known."""
    if all(one.fall_standard_error is None for one in steps):
        return ()
    uncertain = any(one.uncertain for one in steps)
    words = " Uncertain: a fall within two standard errors." if uncertain else ""
    return (
        "Fall \u00b1 its standard error over blocks of time, both errors on the same blocks. That "
        f"an effect is the best of many that were tried is not in it.{words}",
    )


def gain_notes(candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """What the gain in a table of candidates is, and that it is not what they stand in order of."""
    if all(one.test_gain is None for one in candidates):
        return ()
    untried = any(one.test_gain is None for one in candidates)
    return (
        "Gain: fall of the same held-out error with this effect alone added. p, finding and order "
        "are those of the search, on the training recordings, each joint weighted by its noise"
        f"{'; -: not fitted with the model' if untried else ''}.",
    )


def place(effect: Effect) -> dict[str, str | None]:
    """An effect as JSON names it."""
    return {"effect": effect.name, "joint": effect.joint, "source": effect.source}
