"""Whether a law changes with its signals as it says."""

from __future__ import annotations

import numpy as np
import pytest

import laws_hidden
from dynident.criteria import DEFAULTS
from dynident.diagnosis.proposals.law_changes import change_p_value
from dynident.effects import Law, LawEffect, law_effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.recording import Dataset
from laws_hidden import MODEL, NOISE, recordings, searched


def p_value(made, torque: str, shape: dict[str, float]) -> float:
    """Of a law at the elbow, with these shapes, in recordings."""
    ranges = tuple((name, x - 1.0, x + 1.0) for name, x in shape.items())
    law = law_effect(Law(name="one", torque=torque, shape=ranges))(
        "elbow", shape=(*shape.values(),)
    )
    model = MODEL + law
    evidence = Evidence(model, gather(Dataset(tuple(made))))
    (effect,) = (one for one in model.effects if isinstance(one, LawEffect))
    return change_p_value(evidence, fit_evidence(evidence, model), effect)


@pytest.mark.parametrize("runs", [1, 2])
@pytest.mark.parametrize("torque", ["c*v*q", "c*v*q*v[shoulder]"])
@pytest.mark.slow
def test_what_a_right_law_leaves_is_noise(
    torque: str, runs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of sixty none is below the level, though of few blocks too many are small."""
    monkeypatch.setattr(laws_hidden, "NOISE", 0.0)
    made, found = recordings({torque: 0.5})[:runs], []
    for seed in range(60):
        noise = NOISE * np.random.default_rng([seed, 7]).normal(size=(runs, *made[0].tau.shape))
        noisy = [one.replace(tau=one.tau + more) for one, more in zip(made, noise, strict=True)]
        found.append(p_value(noisy, torque, {}))
    assert min(found) > DEFAULTS.proposals.changes_level
    assert np.mean(np.array(found) < 0.1) < 0.4


def test_laws_of_what_is_predicted_are_not_asked() -> None:
    """The load is that of the model without them: what is left of it goes with the law as well."""
    assert p_value(recordings({"c*v*load": 0.05}), "c*v*load", {}) == 1.0


@pytest.mark.parametrize(
    ("hidden", "imitation", "shape"),
    [
        ("c*sign(v)*exp(1.2*q/1.0)", "sign(v)*(c1*sin(k*q) + c2*cos(k*q))", {"k": 1.2}),
        ("c*v*q/(0.5 + abs(v))", "c*sign(v)*q", {}),
        ("c*v*q*abs(q)", "c*v*q", {}),
    ],
)
def test_what_an_imitation_leaves_goes_with_its_signals(
    hidden: str, imitation: str, shape: dict[str, float]
) -> None:
    p = p_value(recordings({hidden: 1.0}), imitation, shape)
    assert p < DEFAULTS.proposals.changes_level


@pytest.mark.slow
def test_a_law_of_another_form_is_not_enough() -> None:
    search, fitted = searched(recordings({"c*v*q*abs(q)": 3.0}))
    found = next(search.found(fitted)).proposal
    assert not found.is_explanation
    assert "another form" in found.remark
