"""What the errors of a simulated loop mean: whose fault they are, and whether it can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dynident.tables import percent

if TYPE_CHECKING:
    from dynident.validation.loop_validation import Validation

ORIENTATION = (
    "For orientation: a two-link robot that was identified well came within 0.5 % of the position, "
    "5 % of the velocity and 10 % of the acceleration, all filtered; the EMPS benchmark is "
    "published with 0.014 %, 0.23 %, 8.6 % and 5.8 % of the force."
)
"""Janot et al., instrumental variables for a SCARA robot; and the benchmark's own figures."""

_SAME_AS_NOISE = 1.5
"""A difference up to so many times the noise may be the noise."""
_FURTHER = 1.2
"""Distances from the measurement, noise taken out, whose ratio is below this are about equal."""
_BEYOND_NOISE = 3.0
_MATERIAL = 0.01
"""Torque error over its noise, and over the torque, above which something is missing."""
_LAW_HOLDS = 0.2
_LAW_NOISE = 3.0
"""Relative error, and multiple of the noise, up to which the stated control law may have run."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """Joints by what is the matter with them, (n,) bool each.

    Attributes
    ----------
    unlike : the control law's torque for the recorded positions is not the recorded torque.
    foreign : it is not by far: by more than a share of the terms that the law adds up. Where
        these nearly cancel (a law without reference velocity), 1 % of a gain may be 20 % of the
        torque; that alone accuses no controller.
    lost : the simulated position is further from the measured one than the reference.
    untold : it is neither further nor nearer, or both distances may be noise.
    lacking : the simulated torque is off by more than noise, and materially.
    """

    unlike: np.ndarray
    foreign: np.ndarray
    lost: np.ndarray
    untold: np.ndarray
    lacking: np.ndarray


def judge(found: Validation) -> Judgement:
    """Return what is the matter with each joint of simulated loops."""
    own, reference = found.errors.joints, found.without_model.joints
    noise = found.noise.joints[3] if found.noise is not None else np.zeros(len(found.joints))
    unlike = reference[3] > np.maximum(_LAW_HOLDS, _LAW_NOISE * noise)
    terms = np.fmax(found.law_terms, 1.0)
    encoder = found.position_noise
    # Measured less simulated, and measured less reference: both hold the encoder's noise.
    far, near = (np.sqrt(np.fmax(x[0] ** 2 - encoder**2, 0.0)) for x in (own, reference))
    beyond = own[0] > _SAME_AS_NOISE * encoder
    lost = beyond & (far > _FURTHER * near)
    excess = np.sqrt(np.fmax(own[3] ** 2 - noise**2, 0.0))
    return Judgement(
        unlike=unlike,
        foreign=unlike & (reference[3] > _LAW_HOLDS * terms),
        lost=lost,
        untold=~lost & ~(far < near),
        lacking=(noise > 0) & (own[3] > _BEYOND_NOISE * noise) & (excess > _MATERIAL),
    )


def sentence(found: Validation) -> str:
    """The verdict in plain words."""
    if not found.runs:
        return "No loop could be simulated."
    said = found.judgement
    match found.verdict:
        case "other_controller":
            return (
                f"At {_names(found, said.foreign)} the stated controller is not the one that "
                "ran, or torque or reference are not what they are said to be."
            )
        case "no_nearer":
            cause = "the model is poor"
            if (said.lost & said.unlike).any():
                cause += ", or controller or torque are not quite what they are said to be"
            return (
                f"At {_names(found, said.lost)} the simulated loop is no nearer to the "
                f"measurement than the reference: {cause}."
            )
    off = f"its torque is {percent(found.errors.of('torque'))} off."
    if said.untold.any():
        return (
            f"At {_names(found, said.untold)} it cannot be told whether the simulated loop is "
            "nearer to the measurement than the reference: they are about equally near, or within "
            f"the noise; {off}"
        )
    return (
        "At every joint the simulated loop is nearer to the measurement than the reference is; "
        + off
    )


def notes(found: Validation) -> tuple[str, ...]:
    """The sentence, and what it rests on, in plain words."""
    lines = [sentence(found)]
    for j in range(len(found.joints) if found.runs else 0):
        lines += [f"{found.joints[j]}: {one}" for one in _of_joint(found, j)]
    return (*lines, *((ORIENTATION,) if found.runs else ()), *found.remarks)


def _of_joint(found: Validation, j: int) -> list[str]:
    said, lines = found.judgement, []
    law = percent(float(found.without_model.joints[3, j]), 1)
    if said.foreign[j]:
        lines.append(
            "the stated control law, fed with the recorded positions, does not give the recorded "
            f"torque ({law} off): check gains, rate_hz, delay_s, limit, and the units of torque "
            "and reference."
        )
    elif said.lost[j]:
        own, reference = (e.joints[0, j] for e in (found.errors, found.without_model))
        line = (
            f"the simulated position is {percent(own, 3)} off the measured one, the reference "
            f"{percent(reference, 3)}."
        )
        if not said.unlike[j]:
            line += (
                f" The stated control law gives the recorded torque ({law} off): the model does "
                "not respond as the robot does."
            )
        lines.append(line)
    if said.unlike[j] and not said.foreign[j]:
        share = percent(float(found.without_model.joints[3, j] / found.law_terms[j]), 1)
        lines.append(
            f"the stated control law misses the recorded torque by {law} of it. The law's terms "
            f"nearly cancel, and that is {share} of them: a gain that is a little off may be "
            "behind it, or a torque in another unit."
        )
    if found.saturated[j] > 0:
        lines.append(
            f"the simulated command is at its limit for {percent(float(found.saturated[j]), 1)} "
            "of the samples; there the torque says nothing of the model."
        )
    if said.lacking[j] and found.noise is not None:
        off = found.errors.joints[3, j]
        lines.append(
            f"the torque of the simulated loop is {percent(float(off), 1)} off, "
            f"{off / found.noise.joints[3, j]:.3g} times the noise: the model lacks "
            "something (`dynident diagnose` looks for what), or the stated loop is not quite the "
            "recorded one."
        )
    return lines


def _names(found: Validation, which: np.ndarray) -> str:
    return ", ".join(found.joints[j] for j in np.flatnonzero(which))
