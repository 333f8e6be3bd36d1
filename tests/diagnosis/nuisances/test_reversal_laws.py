"""Dry friction by another law than the model's is no finding; what is more than that stays one."""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from brief_search import BRIEF
from dynident.diagnosis.nuisances.reversal_laws import (
    _best_law,
    laws_of_the_rest,
    laws_that_do_as_well,
)
from dynident.diagnosis.search.ranking import rank
from dynident.effects import effects_of
from dynident.effects.friction.stribeck_friction import StribeckFriction
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence, signal_by_joint
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.reporting.headline import headline
from synthetic import arm, smooth_motion, true_values

RATE_HZ = 500.0
PERIOD_S = 8.0
WIDTH = 0.05
"""rad/s, of the law in the model and of the true one."""
COULOMB = 2.0
"""N m, at the elbow."""


def given() -> Model:
    robot, names = arm(), ("viscous_friction", "coulomb_friction")
    return Model(robot, tuple(e for name in names for e in effects_of(name, robot)), WIDTH)


def record(seed: int, lead: float, stribeck: float = 0.0) -> Recording:
    """Dry friction of the elbow along a straight line, `lead` seconds before the elbow reverses."""
    model, rng = given(), np.random.default_rng([seed, 6])
    t, q, v, a = smooth_motion(2, seed, RATE_HZ, 3 * PERIOD_S, PERIOD_S)
    values = true_values(model, Fv__shoulder=1.0, Fv__elbow=0.6, Fc__shoulder=3.0)
    tau = model.torque(model.block(t, q, v, a), values)
    ahead = np.clip((v[:, 1] + lead * a[:, 1]) / WIDTH, -1.0, 1.0)
    falling = np.tanh(v[:, 1] / WIDTH) * np.exp(-((v[:, 1] / 0.2) ** 2))
    tau[:, 1] += COULOMB * ahead + stribeck * falling
    return Recording(
        t,
        q + 1e-5 * rng.normal(size=q.shape),
        tau + 0.05 * rng.normal(size=tau.shape),
        model.robot.names,
        period=PERIOD_S,
        name=f"{seed}",
    )


def dataset(*seeds: int, lead: float, stribeck: float = 0.0) -> Dataset:
    return Dataset(tuple(record(seed, lead, stribeck) for seed in seeds))


@pytest.mark.parametrize("lead", [6e-3, -6e-3])
def test_the_law_that_made_the_data_explains_more_than_an_effect_that_stands_in(
    lead: float,
) -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=lead)))
    fitted = fit_evidence(evidence, evidence.model)
    stands_in = StribeckFriction("elbow").on(evidence.model.robot)
    (one,) = rank(evidence, fitted, 0, only=(stands_in,)).scores
    (law,) = laws_that_do_as_well(evidence, fitted, one, 0)
    assert law.joint == "elbow"
    assert law.drop > one.drop
    ahead = re.search(r"([\d.]+) ms", law.words)
    assert ahead is not None
    assert float(ahead[1]) == pytest.approx(6.0, rel=0.2)
    assert ("before the joint" if lead > 0 else "after the joint") in law.words


@pytest.mark.parametrize(("shares", "named"), [(0.5, False), (2.0, True)])
def test_what_an_effect_explains_more_than_the_law_must_be_worth_an_effect(
    shares: float, named: bool
) -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=6e-3)))
    fitted = fit_evidence(evidence, evidence.model)
    stands_in = StribeckFriction("elbow").on(evidence.model.robot)
    (one,) = rank(evidence, fitted, 0, only=(stands_in,)).scores
    (law,) = laws_that_do_as_well(evidence, fitted, one, 0)
    least = evidence.criteria.gates.first_share * fitted.error_total
    better = replace(one, penalised=law.drop + shares * least)
    assert (laws_that_do_as_well(evidence, fitted, better, 0) == ()) == named


def test_a_law_that_explains_a_small_part_of_an_effect_does_not_stand_in_for_it() -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=6e-3)))
    fitted = fit_evidence(evidence, evidence.model)
    stands_in = StribeckFriction("elbow").on(evidence.model.robot)
    (one,) = rank(evidence, fitted, 0, only=(stands_in,)).scores
    (law,) = laws_that_do_as_well(evidence, fitted, one, 0)
    # Whatever the share of the residual is that an effect has to explain.
    gates = replace(evidence.criteria.gates, first_share=1.0)
    careful = Evidence(given(), evidence.runs, criteria=replace(evidence.criteria, gates=gates))
    far_better = replace(one, penalised=3.0 * law.drop)
    assert laws_that_do_as_well(careful, fitted, far_better, 0) == ()


@pytest.mark.parametrize("part", [0.25, 0.5])
def test_a_law_is_sought_where_what_is_left_is_not_to_be_told_from_noise(
    part: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The square that is left is known to its noise only: a law may explain several times it."""
    monkeypatch.setattr(sys.modules[__name__], "COULOMB", 0.04)
    evidence = Evidence(given(), gather(dataset(0, 1, lead=6e-3)))
    fitted = fit_evidence(evidence, evidence.model)
    stands_in = StribeckFriction("elbow").on(evidence.model.robot)
    (one,) = rank(evidence, fitted, 0, only=(stands_in,)).scores
    law = _best_law(evidence, fitted, "elbow")
    assert law.drop > 4.0 * signal_by_joint(evidence, fitted)[1]
    (found,) = laws_that_do_as_well(evidence, fitted, replace(one, penalised=part * law.drop), 0)
    assert found is law


def test_what_is_left_at_the_joints_is_all_that_is_left() -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=6e-3)))
    fitted = fit_evidence(evidence, evidence.model)
    left = signal_by_joint(evidence, fitted)
    assert left.sum() == pytest.approx(fitted.error_signal, rel=1e-12)
    assert left[1] > 10.0 * abs(left[0])


@pytest.mark.parametrize(("lead", "excused"), [(6e-3, ["elbow"]), (0.0, ["elbow"]), (-6e-3, [])])
def test_what_no_effect_explains_is_excused_unless_friction_lags(
    lead: float, excused: list[str]
) -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=lead)))
    laws = laws_of_the_rest(evidence, fit_evidence(evidence, evidence.model))
    assert [law.joint for law in laws] == excused


def test_friction_that_falls_with_speed_is_more_than_any_law_of_dry_friction() -> None:
    evidence = Evidence(given(), gather(dataset(0, 1, lead=6e-3, stribeck=1.0)))
    fitted = fit_evidence(evidence, evidence.model)
    missing = StribeckFriction("elbow").on(evidence.model.robot)
    (one,) = rank(evidence, fitted, 0, only=(missing,)).scores
    assert laws_that_do_as_well(evidence, fitted, one, 0) == ()


@pytest.mark.slow
@pytest.mark.parametrize(("stribeck", "found"), [(0.0, []), (1.0, ["stribeck_friction@elbow"])])
def test_a_robot_whose_friction_leads_lacks_what_it_lacks_beside(
    stribeck: float, found: list[str]
) -> None:
    train = dataset(0, 1, lead=6e-3, stribeck=stribeck)
    said = di.diagnose(given(), train, dataset(7, lead=6e-3, stribeck=stribeck))
    assert [step.effect.label for step in said.steps] == found
    assert said.verdict == ("explained" if found else "nothing_missing")
    if not found:
        assert 0.1 < said.reversals_left_out["elbow"] < 0.5
        assert "Away from the reversals of elbow nothing is missing" in said.sentence
        assert headline(said).mark == "?"
        assert any("another law" in note for note in said.notes)


@pytest.mark.slow
def test_friction_that_lags_is_never_nothing() -> None:
    """It has a memory: neither a rival's name nor rows left out make that go away."""
    train, test = dataset(0, 1, lead=-6e-3), dataset(7, lead=-6e-3)
    said = di.diagnose(given(), train, test, propose="never", criteria=BRIEF)
    assert said.verdict == "unexplained" or said.steps
    assert not said.reversals_left_out


@pytest.mark.slow
def test_a_study_that_asks_for_every_row_keeps_it() -> None:
    # Fewer rows of each second tell the same: without "keep" a quarter of the elbow's is left out.
    every = di.Filter(position_cutoff_hz=40.0, rate_hz=125.0, ends="keep")
    train = replace(dataset(0, 1, lead=6e-3), filter=every)
    said = di.diagnose(given(), train, most=1, propose="never", criteria=BRIEF)
    assert not said.reversals_left_out
