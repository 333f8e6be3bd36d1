"""What is said of effects that something else than a single rival may be.

Rivals are compared one by one, as effects of the catalogue, on what the description says. What
several of them do together, or one column of them, is none of these.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.effects import Effect, catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of
from dynident.robot import Robot
from dynident.tables import listed

_FEW_WAVES = 1.5
"""Waves of a ripple over a joint's travel below which any smooth curve looks like it."""
_ARM = 0.5
"""m, by which a link's centre of mass may lie beside its axis; a description is no measure."""


def look_alike_notes(evidence: Evidence, fitted: EvidenceFit) -> tuple[str, ...]:
    """Return what else the effects that were added may be, in plain words.

    Parameters
    ----------
    evidence : the training recordings; its model is the one that was given.
    fitted : the final model.

    Returns
    -------
    A sentence for each doubt.
    """
    added = [one for one in fitted.model.effects if one not in evidence.model]
    return (
        *_constants(added, fitted),
        *_offsets_instead(added, evidence, fitted),
        *_slow_waves(added, evidence),
        *_hardly_weights(added, evidence, fitted),
        *_other_ends(fitted.model.robot),
    )


def _constants(added: list[Effect], fitted: EvidenceFit) -> Iterator[str]:
    """Offsets are one column of friction that differs between the directions."""
    for effect in added:
        other = f"asymmetric_friction@{effect.joint}"
        if effect.name == "torque_offset" and other not in fitted.model.slices:
            yield (
                f"{effect.title} may also be dry friction that is larger in one direction than in "
                "the other (dFc of asymmetric friction): the torque is the same but where the "
                "joint turns round, and hardly any motion tells them apart."
            )


def _offsets_instead(added: list[Effect], evidence: Evidence, fitted: EvidenceFit) -> Iterator[str]:
    """Effects of the whole robot in whose place offsets at several joints fit as well."""
    robot, offset = fitted.model.robot, catalogue()["torque_offset"]
    for effect in added:
        joints = [robot.names[j] for j in effect.acting_at(robot)]
        if effect.place != "robot" or effect.is_payload or len(joints) < 2:
            continue
        other = fitted.model - effect.label
        offsets = [offset(joint).on(robot) for joint in joints]
        other = other + tuple(one for one in offsets if one not in other)
        rival = in_metric_of(evidence, fit_evidence(evidence, other, fitted), fitted)
        if rival.error_signal - fitted.error_signal <= 2.0 * np.log(fitted.rows):
            yield (
                f"Torque offsets at {listed(joints)} together fit these recordings as well as "
                f"{effect.title}."
            )


def _slow_waves(added: list[Effect], evidence: Evidence) -> Iterator[str]:
    """Ripples of which a joint travels through so few that they are a curve over its position."""
    names = evidence.model.robot.names
    for effect in added:
        if effect.name != "torque_ripple":
            continue
        joint = names.index(str(effect.joint))
        q = np.concatenate([run.replicates[0].q[:, joint] for run in evidence.runs])
        waves = effect.shape[0] * float(np.ptp(q)) / (2.0 * np.pi)
        if waves < _FEW_WAVES:
            yield (
                f"{effect.joint} travels through {waves:.2g} waves of what is called "
                f"{effect.title}: of so few, any smooth curve over the position makes the same, as "
                "a balancer, a spring that is not linear, or a cable."
            )


def _hardly_weights(added: list[Effect], evidence: Evidence, fitted: EvidenceFit) -> Iterator[str]:
    """Unbalances beside a tilted base that are more than the weight of their link can make."""
    model, robot = fitted.model, fitted.model.robot
    for effect in added:
        if effect.name != "unbalance" or "base_tilt" not in model.slices:
            continue
        tilt = float(np.linalg.norm(fitted.values[model.slices["base_tilt"]]))
        mass = _carried(robot, robot.names.index(str(effect.joint)))
        weight = mass * float(np.linalg.norm(robot.gravity))
        if 0.0 < weight * tilt * _ARM < _largest(effect, evidence, fitted):
            yield (
                f"{effect.title} is hardly one: the weight of all that {effect.joint} turns would "
                f"have to act more than {_ARM:g} m farther beside the axis than described. A "
                "ripple of one cycle per revolution makes the same torque."
            )


def _carried(robot: Robot, joint: int) -> float:
    """Mass of a joint's link and of all that it carries, as described, kg."""
    moved = {joint}
    for number, one in enumerate(robot.joints):  # a parent comes before what it carries
        if one.parent in moved:
            moved.add(number)
    return float(sum(robot.theta[10 * one] for one in moved))


def _largest(effect: Effect, evidence: Evidence, fitted: EvidenceFit) -> float:
    """Largest torque of an effect at the first joint where it acts, N m."""
    values = fitted.values[fitted.model.slices[effect.label]]
    every = [
        signal[:, 0] @ values
        for run in range(len(evidence.runs))
        for signal in evidence.of(effect, run, fitted.model, fitted.values)
    ]
    return float(np.max(np.abs(np.concatenate(every))))


def _other_ends(robot: Robot) -> Iterator[str]:
    """On which of a branched robot's links no payload is sought."""
    others = [robot.bodies[one] for one in robot.ends if one != robot.tip]
    if others:
        tip = robot.bodies[robot.tip]
        yield f"A payload is modelled on {tip} alone, not on {listed(others, 'or')}."
