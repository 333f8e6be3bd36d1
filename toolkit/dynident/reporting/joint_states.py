"""Which joints of a diagnosis are in order, and which are to be looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from dynident.diagnosis.details import JointResult
from dynident.diagnosis.result import Diagnosis
from dynident.tables import number

MOST_OPEN = 1
"""Joints whose residual maps are shown without asking."""

_NOISE_ALONE = "nothing is left but noise"

State = Literal["fine", "repaired", "failing", "unknown"]


@dataclass(frozen=True)
class JointState:
    """How a joint does.

    Attributes
    ----------
    joint : its errors.
    state : "fine", "repaired" (by an effect added), "failing", or "unknown" without a noise floor.
    words : the same as a clause.
    badness : larger is to be looked at sooner.
    """

    joint: JointResult
    state: State
    words: str
    badness: tuple[int, float]


def states(diagnosis: Diagnosis) -> tuple[JointState, ...]:
    """Every joint, the worst first."""
    found = (_state(diagnosis, joint) for joint in diagnosis.joints)
    return tuple(sorted(found, key=lambda one: one.badness, reverse=True))


def opened(diagnosis: Diagnosis) -> frozenset[str]:
    """Joints whose maps are shown without asking: the worst one."""
    order = states(diagnosis)
    bad = [one for one in order if one.state not in ("fine", "unknown")] or list(order[:1])
    return frozenset(one.joint.name for one in bad[:MOST_OPEN])


def _state(diagnosis: Diagnosis, joint: JointResult) -> JointState:
    named = any(step.effect.joint == joint.name for step in diagnosis.steps)
    before, after = joint.ratio_before, joint.ratio_after
    if joint.name in diagnosis.following_motion:
        words = "what is left follows the motion: it is not all noise"
        return JointState(joint, "failing", words, (2, joint.error_after))
    if diagnosis.only_bursts and joint.name in diagnosis.bursts:
        words = "a few bursts hold most of what is left: it is hardly noise"
        return JointState(joint, "failing", words, (2, joint.error_after))
    if joint.error_after != joint.error_after:
        words = "none of its rows tells anything: it stands, or has no torque"
        return JointState(joint, "unknown", words, (0, 0.0))
    if before is None or after is None:
        words = "an effect was added here" if named else "the noise is unknown"
        return JointState(joint, "unknown", words, (named, joint.error_before))
    # By the measure of the verdict: else a page would contradict itself.
    beyond, open_still = diagnosis.criteria.verdict.within_noise, diagnosis.verdict == "unexplained"
    if after > beyond and open_still:
        words = f"what is left is {number(after, 2)} times the noise"
        return JointState(joint, "failing", words, (2, after))
    if diagnosis.steps and (named or before > beyond):
        words = f"from {number(before, 2)} times the noise down to it"
        return JointState(joint, "repaired", words, (1, before))
    # Where the verdict is that nothing is missing, a large ratio is one of few samples.
    words = "nothing beyond the noise shows on held-out data" if open_still else _NOISE_ALONE
    return JointState(joint, "fine", words, (0, before))
