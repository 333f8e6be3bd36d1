"""A small version of `benchmarks/hidden_effects.py`: effects hidden in a closed loop in Drake."""

from __future__ import annotations

import pytest

import hidden_effects
from dynident.diagnosis import diagnose
from dynident.effects import catalogue
from hidden_effects import FOREIGN, Case, robot_case, run_case


@pytest.fixture(autouse=True)
def fewer_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """One without and one with the payload to fit, and as many to judge by."""
    monkeypatch.setattr(hidden_effects, "RUNS", 2)


@pytest.mark.slow
def test_a_healthy_robot_gets_no_effect() -> None:
    outcome = run_case(Case(None, None, None, 0.0, 5003))
    assert (outcome.verdict, outcome.first) == ("nothing_missing", None)


@pytest.mark.parametrize(
    ("effect", "joint", "source"),
    [
        ("stribeck_friction", "elbow", None),
        ("payload", None, None),
        ("joint_coupling", "shoulder", "elbow"),
        ("torque_ripple", "elbow", None),
    ],
)
@pytest.mark.slow
def test_a_hidden_effect_is_suggested_first(effect: str, joint, source) -> None:
    outcome = run_case(Case(effect, joint, source, 3.0, 31))
    assert outcome.ratio >= 1.0
    assert outcome.right
    assert outcome.verdict == "explained"
    assert outcome.error_after < outcome.error_before
    assert outcome.over_floor <= 1.15


@pytest.mark.slow
def test_an_effect_in_no_catalogue_is_called_unknown() -> None:
    assert FOREIGN not in catalogue()
    model, train, test = robot_case(Case(FOREIGN, "elbow", None, 10.0, 4001))
    assert diagnose(model, train, test, propose="never").verdict == "unexplained"
