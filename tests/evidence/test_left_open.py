"""What data tell only together with others is as described, and no ground to refuse an effect."""

from __future__ import annotations

import numpy as np
import pytest

import carriage
from dynident.diagnosis.search.refusal import impossible_in, newly_impossible
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.fitting import fit
from dynident.recording import Dataset
from synthetic import synthetic, true_values

ROTOR, TILT = "rotor_inertia@slider", "base_tilt"


def found(
    rotor: float, *, tilt: float = 0.03, with_tilt: bool = True
) -> tuple[Evidence, EvidenceFit]:
    """A carriage with a rotor (kg) on a slope (rad), of which only mass and rotor together show."""
    given = carriage.model() + ROTOR
    true = given + TILT
    values = true_values(true, Fv__slider=1.0, Fc__slider=3.0, Ia__slider=rotor)
    values[true.names.index("base_tilt.ry")] = tilt
    run = synthetic(true, values, 0, rate_hz=250.0, torque_std=0.02)
    evidence = Evidence(given, gather(Dataset((run,))))
    return evidence, fit_evidence(evidence, true if with_tilt else given)


def test_a_tilted_base_feels_the_mass_that_is_described() -> None:
    _, fitted = found(1.5)
    place = fitted.model.names.index("base_tilt.ry")
    assert fitted.values[place] == pytest.approx(0.03, abs=4e-4)
    assert fitted.values[fitted.model.names.index("m.carriage")] + fitted.values[
        fitted.model.names.index("Ia@slider")
    ] == pytest.approx(carriage.MASS + 1.5, rel=5e-3)


@pytest.mark.parametrize("rotor", [-1.0, 1.5])
def test_a_share_of_a_sum_is_not_called_impossible(rotor: float) -> None:
    """A negative rotor is a mass that is described too large: the sum is a mass that can be."""
    evidence, fitted = found(rotor, tilt=0.0, with_tilt=False)
    own = fitted.model.names.index("Ia@slider")
    assert not fitted.alone[own] and fitted.alone[fitted.model.names.index("Fc@slider")]
    gates = evidence.criteria.gates
    assert impossible_in(evidence, fitted, gates) == ()
    assert newly_impossible(evidence, fitted, fitted) == ""
    estimate = fit(fitted.model, Dataset((evidence.runs[0].recording,)))
    np.testing.assert_array_equal(estimate.alone, fitted.alone)


def test_an_estimate_says_what_of_a_tilt_is_of_the_description() -> None:
    evidence, fitted = found(1.5)
    data = Dataset((evidence.runs[0].recording,))
    words = fit(fitted.model, data).words_of_sigma
    assert "The columns of base tilt are made of the bodies. Of m.carriage the data tell" in words
    without = fit(fitted.model - ROTOR, data).words_of_sigma
    assert "made of the bodies" not in without


def test_a_sum_that_cannot_be_is_still_impossible() -> None:
    evidence, fitted = found(-4.0, tilt=0.0, with_tilt=False)
    (one,) = impossible_in(evidence, fitted, evidence.criteria.gates)
    assert one.where == "inertia at slider"
