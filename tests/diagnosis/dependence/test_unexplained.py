"""A whole diagnosis of a law that no catalogue has: what is left is asked what it depends on."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dynident import diagnose
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.dependence.residual_dependence import dependence_sentences
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.reporting.html import page
from synthetic import arm, synthetic, true_values

pytestmark = pytest.mark.slow  # a whole diagnosis

MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def with_cable(recording: Recording) -> Recording:
    """Viscous friction at the elbow that changes with its position, and may drive."""
    v = np.gradient(recording.q[:, 1], recording.t)
    tau = np.array(recording.tau)
    tau[:, 1] += 3.0 * v * np.cos(3.0 * recording.q[:, 1])
    return recording.replace(tau=tau)


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    truth = true_values(MODEL, **FRICTION)
    runs = tuple(
        with_cable(synthetic(MODEL, truth, seed, rate_hz=250.0, torque_std=0.1))
        for seed in range(4)
    )
    return diagnose(MODEL, Dataset(runs[:3]), Dataset(runs[3:]), most=0)


def test_the_law_is_found_in_position_and_velocity_of_its_joint(found: Diagnosis) -> None:
    assert found.verdict == "unexplained" and found.noise_source == "replicates"
    elbow = next(one for one in found.residual_dependence if one.joint == "elbow")
    assert elbow.whole == "systematic" and elbow.shares is not None
    share = elbow.shares.by["position and velocity"]
    assert share.told and share.value > 0.6
    assert not any(elbow.shares.by[name].told for name in ("other joints", "time"))


def test_it_stands_beside_the_verdict_and_in_json(found: Diagnosis) -> None:
    parts = found.tables()
    at = parts.index(found.sentence)
    sentences = dependence_sentences(found.residual_dependence)
    assert sentences and parts[at + 1 : at + 1 + len(sentences)] == sentences
    said = json.loads(json.dumps(found.to_dict(), allow_nan=False))["residual_dependence"]
    assert [one["joint"] for one in said] == [one.joint for one in found.residual_dependence]
    for one in said:
        assert set(one) == {"joint", "of", "blocks", "inputs", "rest", "why"}
        assert one["of"] == "systematic" and one["blocks"] >= 8 and one["why"] is None
        for share in one["inputs"]:
            assert set(share) == {"name", "share", "standard_error", "distinguishable"}
        assert set(one["rest"]) == {"share", "standard_error"}


def test_the_report_has_it_beside_the_verdict(found: Diagnosis) -> None:
    html = page(found)
    at = html.index("What is left, and what it depends on")
    assert dependence_sentences(found.residual_dependence)[0] in html
    assert html.index("</header>") < at < html.index('id="next"')


def test_where_nothing_is_missing_nothing_is_asked() -> None:
    truth = true_values(MODEL, **FRICTION)
    runs = tuple(synthetic(MODEL, truth, seed, rate_hz=250.0, torque_std=0.1) for seed in range(2))
    healthy = diagnose(MODEL, Dataset(runs[:1]), Dataset(runs[1:]), most=0)
    assert healthy.residual_dependence == ()
    assert "residual_dependence" not in healthy.to_dict()


def test_where_laws_are_asked_for_it_is_looked_for_whatever_the_verdict() -> None:
    """Nothing repeats, so that the noise is unknown: of everything that is left."""
    truth = true_values(MODEL, **FRICTION)
    runs = tuple(
        with_cable(synthetic(MODEL, truth, seed, rate_hz=100.0, torque_std=0.1, period=None))
        for seed in range(4)
    )
    found = diagnose(MODEL, Dataset(runs[:3]), Dataset(runs[3:]), most=0, propose="always")
    assert found.noise_source == "unknown"
    elbow = next(one for one in found.residual_dependence if one.joint == "elbow")
    assert elbow.whole == "all" and "position and velocity" in elbow.told
