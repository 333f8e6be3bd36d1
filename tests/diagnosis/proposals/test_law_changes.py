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


def test_what_a_right_law_leaves_is_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of forty none is below the level; of few blocks, p values are a few times too small."""
    monkeypatch.setattr(laws_hidden, "NOISE", 0.0)
    made, found = recordings({"c*v*q[shoulder]": 0.5}), []
    for seed in range(40):
        noise = NOISE * np.random.default_rng([seed, 7]).normal(size=(3, *made[0].tau.shape))
        noisy = [one.replace(tau=one.tau + more) for one, more in zip(made, noise, strict=True)]
        found.append(p_value(noisy, "c*v*q[shoulder]", {}))
    assert min(found) > DEFAULTS.proposals.changes
    assert np.median(found) > 0.1


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
    assert p < 0.01 * DEFAULTS.proposals.changes


def test_a_law_of_another_form_is_not_enough() -> None:
    search, fitted = searched(recordings({"c*v*q*abs(q)": 3.0}))
    found = next(search.found(fitted)).proposal
    assert not found.is_explanation
    assert "another form" in found.remark
