"""Joints that load each other: stated by the study, or alike in both directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.diagnosis import Diagnosis
from dynident.diagnosis.advice.coupled_pairs import alike_notes, stated_pairs
from dynident.diagnosis.advice.geometry_doubt import with_geometry_doubt
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset, Provenance
from reporting.fabricated import diagnosis, effect, fitted, motion
from synthetic import synthetic, true_values

THERE, BACK = ("elbow", "shoulder"), ("shoulder", "elbow")


def coupled(there: float, back: float, joints: tuple = (THERE, BACK)) -> Diagnosis:
    """What a robot with viscous couplings of these sizes is found to have."""
    found = diagnosis(("shoulder", "elbow"), samples=100)
    added = [effect("joint_coupling", *place) for place in joints]
    model = Model(found.after.model.robot)
    for one in added:
        model += one
    block = model.block(*motion(model.robot, 1, 400))
    truth = np.zeros(model.size)
    for one, size in zip(added, (there, back), strict=False):
        truth[model.slices[one.label]] = (size, 0.0, 0.0, 0.0)
    tau = model.columns(block) @ truth + 0.05 * np.random.default_rng(1).normal(size=block.q.shape)
    steps = tuple(replace(found.steps[0], effect=one) for one in added)
    return replace(found, steps=steps, after=fitted(model, tau, block))


@pytest.mark.parametrize(("size", "turns"), [(0.5, "sum"), (-0.5, "difference")])
def test_alike_in_both_directions_is_a_part_that_turns_with_both(size: float, turns: str) -> None:
    (note,) = alike_notes(coupled(size, size))
    assert note.startswith("elbow and shoulder may load each other alike: cv ")
    assert "cc" not in note
    assert f"the {turns} of both" in note


def test_of_friction_alone_or_what_is_not_known_nothing_is_said() -> None:
    found = coupled(0.5, 0.5)
    dry = coupled(0.0, 0.0)
    values = np.array(dry.after.values)
    values[[dry.after.names.index(f"cc@{a}:{b}") for a, b in (THERE, BACK)]] = 0.5
    assert alike_notes(replace(dry, after=replace(dry.after, values=values))) == ()
    known = np.array(found.after.covariance)
    known[found.after.model.slices["joint_coupling@elbow:shoulder"]] = 0.0
    assert alike_notes(replace(found, after=replace(found.after, covariance=known))) == ()


def test_of_other_sizes_or_of_one_direction_nothing_is_said() -> None:
    assert alike_notes(coupled(0.5, 0.1)) == ()
    assert alike_notes(coupled(0.5, -0.5)) == ()
    assert alike_notes(coupled(0.5, 0.0, (THERE,))) == ()


WRIST = "motor[1]/32 - motor[0]/45"


@pytest.mark.parametrize(
    ("elbow", "shoulder", "stated"),
    [
        (WRIST, "motor[0]/45", True),
        (WRIST, "other[0]/45", False),
        ("(m[0] - m[1])/2", "(m[0] + m[1])/2", True),
        ("m2 - m1", "m1", True),
        ("motor-left", "motor-right", False),
        ("joint 2 (rad)", "joint 1 (rad)", False),
    ],
)
def test_a_study_that_states_a_coupled_motor_is_not_asked_about_it(
    elbow: str, shoulder: str, stated: bool
) -> None:
    model = Model(diagnosis(("shoulder", "elbow"), samples=100).after.model.robot)
    columns = (("q.shoulder", shoulder, 1.0), ("q.elbow", elbow, 1.0), ("tau.elbow", "x", 1.0))
    one = synthetic(model, true_values(model), 0).replace(provenance=Provenance(columns=columns))
    assert stated_pairs([one]) == ({frozenset(("shoulder", "elbow"))} if stated else set())
    found = replace(coupled(0.5, 0.1), verdict="unexplained", residual_dependence=())
    runs = gather(Dataset((one,)))
    doubts = [note for note in with_geometry_doubt(found, runs).notes if "coupled_motors" in note]
    assert bool(doubts) != stated
