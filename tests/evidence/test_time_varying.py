"""Columns that depend on the time in the session, beside columns that repeat."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynident.diagnosis.search.scoring import candidate_moments, score
from dynident.effects import Effect, catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.evidence.time_varying import time_varying_variants
from dynident.model import Model
from dynident.recording import Dataset
from study_files import recording, true_model


@cache
def fitted(seed: int) -> tuple[Evidence, EvidenceFit]:
    evidence = Evidence(true_model(), gather(Dataset((recording(seed),))))
    return evidence, fit_evidence(evidence, evidence.model)


def at_shoulder(name: str, model: Model) -> Effect:
    effects = catalogue()[name].candidates(model.robot)
    return next(e.on(model.robot) for e in effects if e.label == f"{name}@shoulder")


@pytest.mark.parametrize("unknown", [(), (90, 91, 97, 150)])
def test_a_ramp_is_its_own_instrument_under_noise_of_any_colour(unknown: tuple[int, ...]) -> None:
    """Whatever the motion, the next repetition's ramp at this one's time is this one's ramp.

    Also after rows whose dry friction nothing tells.
    """
    evidence, found = fitted(0)
    assert len(found.noise[0].colour) > 1
    (run,) = evidence.runs
    uncertain = ~run.certain_rows
    uncertain[list(unknown), 0] = True
    evidence = evidence.with_runs((replace(run, uncertain=uncertain),))
    ramp = at_shoulder("torque_drift", evidence.model)
    columns = evidence.of(ramp, 0, evidence.model, None)[0][:, 0]
    (stack,) = evidence.stacks
    white = stack.unfolded(stack.whitened([[[columns]]], 0, found.noise[0]))
    made = time_varying_variants(evidence, [ramp], stack, 0, found.noise[0], ([[columns]], white))
    np.testing.assert_allclose(made.instruments, white, rtol=1e-6)


@pytest.mark.parametrize("seed", [0, 1001, 1017, 1041])
def test_a_torque_that_does_not_drift_is_not_said_to(seed: int) -> None:
    evidence, found = fitted(seed)
    ramp = at_shoulder("torque_drift", evidence.model)
    ((beside, own),) = candidate_moments(evidence, found, [ramp])
    one = score(found, ramp, beside, own, 1)
    # Two repetitions 8 s apart, of 375 rows of 0.02 N m: what the eye sees.
    assert abs(one.values[0]) < 1e-3
    assert one.p_value > 1e-3
