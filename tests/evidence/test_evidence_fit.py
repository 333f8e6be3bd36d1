"""A model fitted to the evidence, where columns depend on the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.effects import catalogue
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
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
