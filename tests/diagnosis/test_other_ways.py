"""What the first round takes for one effect may be two others: a residual that remains tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from brief_search import BRIEF
from dynident.diagnosis import Diagnosis, procedure
from dynident.diagnosis.extension import extending, other_ways
from dynident.diagnosis.extension.stage import DiagnosisTask, Stage
from dynident.recording import Dataset
from slides import gantry, recorded
from synthetic import arm, synthetic, true_values

FRICTIONS = {"viscous_friction@x", "coulomb_friction@x"}
SPRING, ROTOR, OFFSET = "joint_spring@elbow", "rotor_inertia@elbow", "torque_offset@elbow"


def found(stiffness: float, preload: float, rotor: float) -> Diagnosis:
    """What an elbow with a preloaded spring (N m/rad, N m) and a rotor (kg m^2) is said to lack."""
    given = di.Model(arm())
    for kind in ("viscous_friction", "coulomb_friction"):
        given = given + di.effects_of(kind, given.robot)
    true = given + SPRING + ROTOR
    values = true_values(true)
    values[true.slices[SPRING]] = stiffness, preload
    values[true.slices[ROTOR]] = rotor
    runs = [synthetic(true, values, seed, rate_hz=250.0, torque_std=0.02) for seed in range(3)]
    train, test = Dataset(tuple(runs[:2])), Dataset(tuple(runs[2:]))
    return di.diagnose(given, train, test, propose="never", criteria=BRIEF)


@pytest.mark.slow
def test_a_spring_and_a_rotor_are_found_though_an_offset_comes_first() -> None:
    said = found(0.2, 0.4, 0.05)
    assert {step.effect.label for step in said.steps} == {SPRING, ROTOR}
    assert said.verdict == "explained"


@pytest.mark.slow
def test_what_two_ways_come_by_is_extended_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which friction is added first does not matter, and the same is missing beside both."""
    visited, ways, robot = [], [], gantry().robot
    given = di.Model(robot) + "viscous_friction@y" + "coulomb_friction@y"
    rank_stage = extending.rank_stage

    def ranked(stage: Stage, task: DiagnosisTask, worth: float = 0.0) -> Stage:
        visited.append(stage.visiting)
        return rank_stage(stage, task, worth)

    def told(doing: str) -> None:
        ways.extend([doing] if doing.startswith("going another way") else [])

    for room in (extending, other_ways):
        monkeypatch.setattr(room, "rank_stage", ranked)
    said = di.diagnose(given, jerked(), propose="never", criteria=BRIEF, progress=told)
    assert {step.effect.label for step in said.steps} == FRICTIONS
    assert said.verdict == "unexplained"
    assert ways[0] == "going another way than by viscous_friction@x"
    assert {"coulomb_friction@x"} in [one.effects for one in visited]
    assert sum(one.effects == FRICTIONS for one in visited) == 1


def jerked() -> Dataset:
    """The gantry with what no catalogue has: y's reversals push x as far as x has come."""
    every = []
    for one in recorded().recordings:
        v = np.gradient(one.q, one.t, axis=0)
        push = 6.0 * np.tanh(v[:, 1] / 0.05) * np.cos(8.0 * one.q[:, 0])
        every.append(replace(one, tau=one.tau + push[:, None] * [1.0, 0.0]))
    return Dataset(tuple(every))


@pytest.mark.slow
def test_two_are_found_where_neither_is_significant_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where few blocks of time tell it: here nothing is let pass in the first round."""

    def nothing_passes(stage: Stage, task: DiagnosisTask) -> Stage:
        (first,) = stage.rounds
        every = dict.fromkeys((one.effect.label for one in first.scores), "not significant")
        return replace(stage, rounds=(first.refusing(every),))

    monkeypatch.setattr(procedure, "extend", nothing_passes)
    said = found(0.3, 0.3, 0.05)
    assert {step.effect.label for step in said.steps} == {SPRING, ROTOR}
    assert said.verdict == "explained"
    assert all(step.p_value < 1e-3 for step in said.steps)


@pytest.mark.slow
def test_the_straight_way_leaves_a_residual(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(procedure, "by_other_ways", lambda start, extended, task: extended)
    said = found(0.2, 0.4, 0.05)
    assert said.verdict == "unexplained"
    assert OFFSET in {step.effect.label for step in said.steps}
