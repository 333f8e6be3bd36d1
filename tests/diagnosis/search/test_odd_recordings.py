"""Answers on recordings that are not as most are."""

from __future__ import annotations

import numpy as np
import pytest

from dynident import diagnose as find
from dynident import fit
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording, usable
from dynident.wiring import check_wiring
from synthetic import arm, synthetic, true_values

FULL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def loaded(seed: int, payload: bool | None) -> Recording:
    model = FULL + "payload"
    values = {"payload.mass": 1.0, "payload.mx": 0.2, "payload.Izz": 0.05}
    truth = true_values(model, **FRICTION, **values)
    made = synthetic(
        model,
        truth,
        seed,
        rate_hz=250.0,
        period=None,
        payload=payload,
        position_std=2e-6,
        torque_std=0.1,
    )
    return made


@pytest.mark.slow
def test_what_a_plane_arm_cannot_tell_of_a_load_is_no_reason_to_refuse_it() -> None:
    """Out of the plane a load has moments that no torque shows: they are rounding errors."""
    train = Dataset(tuple(loaded(s, bool(s % 2)) for s in range(4)))
    found = find(FULL, train)
    assert [one.effect.label for one in found.steps] == ["payload"]
    assert not found.withdrawn


def test_a_pause_in_every_repetition_is_a_part_of_it() -> None:
    t = np.arange(5000) / 250.0
    inside = (t % 10.0 > 3.0) & (t % 10.0 < 7.0)
    q = np.where(inside, 1.0 - np.cos(np.pi * (t % 10.0 - 3.0) / 2.0), 0.0)[:, None]
    recording = Recording(t, q, q + 1.0, ("a",), period=10.0)
    assert usable(recording).left_out == ()


def test_a_passband_that_is_narrow_beside_the_sampling_rate() -> None:
    made = synthetic(FULL, true_values(FULL, **FRICTION), 0, rate_hz=5000.0, torque_std=0.1)
    slow = Filter(position_cutoff_hz=20.0, cutoff_hz=2.0, rate_hz=20.0)
    found = fit(FULL, Dataset((made,), slow))
    assert np.all(np.isfinite(found.sigma)) and np.all(found.sigma > 0)


def test_two_recordings_of_one_motion_through_coarse_encoders_are_two() -> None:
    rng = np.random.default_rng(0)
    truth = true_values(FULL, **FRICTION)

    def coarse(seed: int) -> Recording:
        made = synthetic(FULL, truth, 0, rate_hz=250.0, period=None)
        step = 2 * np.pi / 1024
        tau = np.round((made.tau + 0.05 * rng.standard_normal(made.tau.shape)) / 0.5) * 0.5
        return made.replace(q=np.round(made.q / step) * step, tau=tau, name=f"run {seed}")

    train, test = Dataset((coarse(0),)), Dataset((coarse(1),))
    assert not [one for one in check_wiring(FULL, train, test) if one.kind == "same_data"]
    (fault,) = (one for one in check_wiring(FULL, train, train) if one.kind == "same_data")
    assert "run 0" in fault.what
