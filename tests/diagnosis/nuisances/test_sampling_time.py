"""A held command that is called measured, or the reverse, is told with the line that mends it."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import dynident as di
from brief_search import BRIEF
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

RATE_HZ = 100.0
Torque = Literal["measured", "held_command"]


def _model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def _recording(seed: int, truth: Torque, said: Torque) -> Recording:
    """Torque at the samples, or the mean of a command until the next one."""
    model = _model()
    values = true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.0, Fc__elbow=0.5)
    fine = synthetic(model, values, seed, rate_hz=10 * RATE_HZ, torque_std=0.0)
    tau = fine.tau[::10]
    if truth == "held_command":
        tau = np.concatenate([fine.tau[:-1].reshape(-1, 10, 2).mean(axis=1), tau[-1:]])
    tau = tau + 0.02 * np.random.default_rng(seed).normal(size=tau.shape)
    kept = {name: None for name in ("v", "a", "q_ref")}
    return fine.replace(t=fine.t[::10], q=fine.q[::10], tau=tau, torque=said, **kept)


@pytest.mark.slow
@pytest.mark.parametrize("said", ["measured", "held_command"])
@pytest.mark.parametrize("truth", ["measured", "held_command"])
def test_half_a_sample_is_told_where_it_is_misstated_and_only_there(
    truth: Torque, said: Torque
) -> None:
    each = [_recording(seed, truth, said) for seed in range(3)]
    train, test = Dataset(tuple(each[:2])), Dataset((each[2],))
    found = di.diagnose(_model(), train, test, propose="never", criteria=BRIEF)
    assert (found.sampled is None) == (truth == said)
    if found.sampled is not None:
        later = found.sampled.later_s
        assert later == pytest.approx((1 if truth == "held_command" else -1) * 5e-3, rel=0.2)
        assert f'torque = "{truth}"' in found.sentence
        assert found.to_dict()["notes"][-1] == found.sampled.sentence
