"""A model fitted to the evidence, where columns depend on the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.effects import catalogue
from dynident.evidence import evidence_fit
from dynident.evidence.columns.joint_columns import WhiteColumns
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of
from dynident.evidence.noise_model import flat_noise
from dynident.evidence.runs import gather
from dynident.fitting.fixed_point import FixedPoint
from problem_scripts import PROBLEMS


def test_load_and_elasticity_settle_together_from_a_robot_without_bodies() -> None:
    """At first there is no load and no body: columns of both are rounding errors."""
    study = di.load(PROBLEMS / "hidden_effect" / "study.toml")
    known = catalogue()
    load = known["load_friction"]("elbow")
    bends = known["joint_elasticity"]("shoulder", None, (20.0, 0.1, 0.3))
    evidence = Evidence(
        study.model, gather(replace(study.train, recordings=study.train.recordings[:2]))
    )
    alone = [fit_evidence(evidence, study.model + one) for one in (load, bends)]
    both = fit_evidence(evidence, study.model + load + bends)
    mu, c = both.values[-2:]
    sigma = np.sqrt(np.diag(both.covariance)[-2:])
    assert mu == pytest.approx(alone[0].values[-1], abs=3 * sigma[0])
    assert c == pytest.approx(alone[1].values[-1], abs=3 * sigma[1])
    assert both.error_total <= 1.01 * min(one.error_total for one in alone)


def test_a_gap_that_is_held_is_no_change(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its column says another gap than that at which it was taken, in each round the same."""
    changes = []

    class Watched(FixedPoint):
        def following(self, model: di.Model, at: np.ndarray, found: np.ndarray) -> np.ndarray:
            changes.append((found - at)[model.slices["backlash@shoulder"]])
            return super().following(model, at, found)

    monkeypatch.setattr(evidence_fit, "FixedPoint", Watched)
    study = di.load(PROBLEMS / "hidden_effect" / "study.toml")
    known = catalogue()
    gap = known["backlash"]("shoulder", None, (20.0, 0.1, 0.3)).at((0.01,))
    evidence = Evidence(
        study.model, gather(replace(study.train, recordings=study.train.recordings[:1]))
    )
    fitted = fit_evidence(evidence, study.model + gap + known["load_friction"]("elbow"))
    assert fitted.settled and fitted.values[-2] != pytest.approx(0.01, rel=0.1)
    assert changes and not np.any(changes)


def test_what_changes_at_one_joint_leaves_the_columns_of_the_others() -> None:
    """Of a wider model, columns where nothing changed are not evaluated, nor whitened, again."""
    study = di.load(PROBLEMS / "hidden_effect" / "study.toml")
    runs = gather(replace(study.train, recordings=study.train.recordings[:1]))
    evidence = Evidence(study.model, runs)
    fitted = fit_evidence(evidence, study.model)
    model = study.model + catalogue()["load_friction"]("elbow")
    wider, anew = (
        fit_evidence(one, model, fitted) for one in (evidence, Evidence(study.model, runs))
    )
    same = [
        all(a is b for a, b in zip(one.parts[0][0], two.parts[0][0], strict=False))
        for one, two in _joints(fitted, wider)
    ]
    assert same == [True, False]  # shoulder, elbow
    flat = replace(fitted, noise=tuple(flat_noise(1.0) for _ in fitted.noise))
    plain = in_metric_of(evidence, flat, flat)
    wide = in_metric_of(evidence, replace(wider, white=plain.white), flat)
    assert [one.rows is two.rows for one, two in _joints(plain, wide)] == [True, False]
    np.testing.assert_allclose(wider.values, anew.values, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(wider.moments.signal, anew.moments.signal, rtol=1e-9, atol=1e-9)


def test_rows_that_no_longer_count_are_whitened_again() -> None:
    study = di.load(PROBLEMS / "hidden_effect" / "study.toml")
    runs = gather(replace(study.train, recordings=study.train.recordings[:1]))
    evidence = Evidence(study.model, runs)
    fitted = fit_evidence(evidence, study.model)
    sticks = np.zeros(runs[0].replicates[0].tau.shape, dtype=bool)
    sticks[: len(sticks) // 4] = True
    fewer = evidence.with_runs((replace(runs[0], uncertain=sticks),))
    beside = fit_evidence(fewer, study.model, fitted)
    anew = fit_evidence(Evidence(study.model, fewer.runs), study.model, fitted)
    np.testing.assert_allclose(beside.values, anew.values, rtol=1e-9, atol=1e-12)
    assert np.abs(beside.values - fitted.values).max() > 1e-6


def _joints(one: EvidenceFit, two: EvidenceFit) -> list[tuple[WhiteColumns, WhiteColumns]]:
    """White columns of two fits in their first run, joint by joint."""
    return list(zip(one.white[0], two.white[0], strict=True))
