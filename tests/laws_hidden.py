"""Recordings of an arm with a law that its model lacks, as the search for laws takes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dynident.criteria import Criteria
from dynident.diagnosis.proposals.law_search import LawSearch
from dynident.diagnosis.search.path import Path, judged_on
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.selection import AddedEffect
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.effects import Law, law_effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, smooth_motion, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
PERIOD, NOISE = 8.0, 0.1

Motion = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def apart(seed: int) -> Motion:
    """Each joint in its own way."""
    return smooth_motion(2, seed, 100.0, 2 * PERIOD, PERIOD)


def together(seed: int) -> Motion:
    """Both joints alike: what is of one is of the other too."""
    t, *motion = smooth_motion(1, seed, 100.0, 2 * PERIOD, PERIOD)
    q, v, a = (np.tile(one, (1, 2)) for one in motion)
    return t, q, v, a


def with_law(model: Model, torque: str, joint: str = "elbow") -> Model:
    """The model with a law; each is named after the number of effects before it."""
    law = Law(name=f"law{len(model.effects)}", torque=torque)
    return model + law_effect(law)(joint).on(model.robot)


def recordings(
    torques: dict[str, float],
    motion: Callable[[int], Motion] = apart,
    spring: float = 0.0,
) -> list[Recording]:
    """Three recordings in which laws act at the elbow, each with one coefficient c.

    Of the catalogue a spring (N m/rad) may act there, too.
    """
    full, values = MODEL + "joint_spring@elbow", FRICTION | {"k__elbow": spring}
    for torque, value in torques.items():
        values[f"law{len(full.effects)}.c__elbow"] = value
        full = with_law(full, torque)
    truth = true_values(full, **values)
    found = []
    for seed in range(3):
        t, q, v, a = motion(seed)
        noise = NOISE * np.random.default_rng([seed, 1]).normal(size=q.shape)
        tau = full.torque(full.block(t, q, v, a), truth) + noise
        names = full.robot.names
        found.append(Recording(t, q, tau, names, period=PERIOD, name=f"run {seed}"))
    return found


def searched(made: list[Recording], model: Model = MODEL) -> tuple[LawSearch, EvidenceFit]:
    """The search on all recordings but the last, which is held out; and the fit of the model."""
    criteria = Criteria()
    train, test = Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:]))
    evidence, held = (
        Evidence(model, gather(some, criteria.noise), criteria=criteria) for some in (train, test)
    )
    return LawSearch(evidence=evidence, held=held, train=train), fit_evidence(evidence, model)


def path(search: LawSearch, start: EvidenceFit, *labels: str) -> Path:
    """The way from a model by effects of the catalogue, right or wrong, one after the other."""
    stages, found = [start], []
    for label in labels:
        wider = refitted(search.evidence, stages[-1].model + label, stages[-1])
        effect = next(one for one in wider.model.effects if one.label == label)
        score = Score(effect=effect, payload_recordings=None, not_identifiable=False)
        stages.append(wider)
        found.append(AddedEffect(score=score, p_value=0.0, indistinguishable=()))
    judged = tuple(judged_on(search.evidence, search.held, one) for one in stages)
    return Path(found=tuple(found), stages=tuple(stages), judged=judged)
