"""The order of a ranking: by what is explained, and never by rounding."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from dynident.criteria import Criteria
from dynident.diagnosis.search import ranking
from dynident.diagnosis.search.ranking import best_first, rank
from dynident.diagnosis.search.scores.score import Score
from dynident.effects import effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

PLAIN = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    truth = true_values(PLAIN, **FRICTION)
    made = tuple(
        synthetic(PLAIN, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(2)
    )
    return Evidence(PLAIN, gather(Dataset(made)))


def test_of_effects_that_do_the_same_the_first_one_asked_for_is_first(evidence: Evidence) -> None:
    """The gain of one drive of two is that of the other, inverted, but for the bodies' scale."""
    fitted = fit_evidence(evidence, PLAIN)
    for labels in permutations(("drive_gain@shoulder", "drive_gain@elbow")):
        only = tuple(e for label in labels for e in effects_of(label, PLAIN.robot))
        scores = rank(evidence, fitted, 0, only=only).scores
        assert tuple(one.effect.label for one in scores) == labels
        assert scores[0].penalised == pytest.approx(scores[1].penalised, abs=1e-6)


def test_effects_without_hope_take_no_place_of_those_that_are_cross_validated(
    evidence: Evidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What falls most by chance may be significant nowhere, and is no rival."""
    one = replace(evidence, criteria=Criteria.with_values({"search": {"contenders": 1}}))
    fitted = fit_evidence(one, Model(arm()) + "viscous_friction")
    own = ranking._score_variants

    def by_chance(*known, **named) -> Iterator[Score]:
        for found in own(*known, **named):
            hopeless = found.effect.name in ("torque_drift", "thermal_friction")
            yield replace(found, penalised=1e9, p_value=1.0) if hopeless else found

    usual = rank(one, fitted, 0).scores
    best = next(found for found in usual if found.gains is not None)
    monkeypatch.setattr(ranking, "_score_variants", by_chance)
    scores = rank(one, fitted, 0).scores
    assert scores[0].effect == best.effect
    assert sum(found.penalised == 1e9 and found.gains is None for found in scores) == 4
    assert [found.effect for found in scores if found.gains is not None] == [best.effect]


def test_what_differs_by_more_than_rounding_stands_in_its_order() -> None:
    values = [1.0, 3.0, 2.0 + 1e-9, -np.inf, 2.0, 3.0 + 1e-9, -np.inf]
    assert best_first(values, 1e-6) == [1, 5, 2, 4, 0, 3, 6]
    assert best_first(values, 0.0) == [5, 1, 2, 4, 0, 3, 6]
    assert best_first([], 1e-6) == []
