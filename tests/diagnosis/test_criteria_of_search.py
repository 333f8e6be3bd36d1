"""Other criteria give another answer, and the answer says so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dynident.criteria import Criteria
from dynident.diagnosis import Diagnosis, diagnose
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
PLAIN = Model(arm()) + "viscous_friction" + "coulomb_friction"


def found(criteria: Criteria) -> Diagnosis:
    """What is said of an arm whose model lacks a drag."""
    full = PLAIN + "quadratic_drag@shoulder"
    truth = true_values(full, **FRICTION, Fq__shoulder=0.4)
    made = tuple(
        synthetic(full, truth, seed, rate_hz=100.0, position_std=2e-5, torque_std=0.3)
        for seed in range(2)
    )
    return diagnose(PLAIN, Dataset(made), criteria=criteria, propose="never")


@pytest.mark.slow
def test_a_gate_that_nothing_passes_adds_nothing_and_is_reported() -> None:
    usual = found(Criteria())
    assert [step.effect.label for step in usual.steps] == ["quadratic_drag@shoulder"]
    assert "criteria" not in usual.to_dict()
    strict = Criteria.with_values({"gates": {"first_share": 1.0}})
    none = found(strict)
    assert none.steps == () and none.criteria == strict
    assert none.to_dict()["criteria"] == {"gates.first_share": 1.0}
    (note,) = [note for note in none.caveats if "Criteria of the study" in note]
    assert "gates.first_share = 1 (default 0.006)" in note and note in none.to_dict()["notes"]
    # The record of answers that were right is one of the default criteria.
    assert replace(usual, noise_source="replicates", criteria=strict).track_record is None
