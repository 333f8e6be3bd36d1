"""What data cannot show is told once for all joints that it is the same of."""

from __future__ import annotations

from collections.abc import Sequence

import dynident as di
from chains import chain
from dynident.diagnosis.details import Candidate, Status
from dynident.diagnosis.effect_groups import hidden_effects
from dynident.robot import Robot


def candidates(
    robot: Robot, labels: Sequence[str], remark: str, status: Status = "absorbed"
) -> list[Candidate]:
    return [
        Candidate(
            effect=effect,
            status=status,
            p_value=None,
            test_gain=None,
            values=(),
            remark=remark.format(effect.joint),
        )
        for label in labels
        for effect in di.effects_of(label, robot)
    ]


def test_one_reason_is_told_once():
    robot = chain(12)
    first, second, *_, last = robot.names
    every = [f"contact@{name}" for name in robot.names]
    found = hidden_effects(candidates(robot, every, "repeat one motion of {}"), robot.n)
    assert [(one.title, one.remark) for one in found] == [
        ("contact at all 12 joints", "repeat one motion of each of these joints")
    ]
    some = candidates(robot, every[:2] + every[-1:], "move {}, not others")
    (one,) = hidden_effects(some, robot.n)
    assert one.title == f"contact at {first}, {second} and {last}"
    assert one.remark == "move each of these joints, not others"


def test_what_differs_is_told_apart():
    robot = chain(12)
    first, second = robot.names[:2]
    kinds = candidates(robot, [f"contact@{first}", f"joint_zero@{first}"], "repeat {}")
    reasons = candidates(robot, [f"joint_zero@{second}"], "its torque is that of my.link2")
    shown = candidates(robot, [f"contact@{second}"], "repeat {}", status="material")
    alone = candidates(robot, ["base_tilt"], "turn the base")
    found = hidden_effects([*kinds, *reasons, *shown, *alone], robot.n)
    assert [(one.title, one.remark) for one in found] == [
        (f"contact at {first}", f"repeat {first}"),
        (f"joint zero at {first}", f"repeat {first}"),
        (f"joint zero at {second}", "its torque is that of my.link2"),
        (alone[0].effect.title, "turn the base"),
    ]
