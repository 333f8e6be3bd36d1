"""Long recordings: part by part, from files that are mapped, and the same answer."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from dynident.errors import FitError
from dynident.fitting import Estimate, fit, sample
from dynident.fitting.sampling import BLOCK
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording, differentiate
from synthetic import arm, synthetic, true_values

SETTINGS = [None, Filter(), Filter(position_cutoff_hz=40.0, ends="keep")]


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


@pytest.fixture(scope="module")
def long(model: Model) -> Recording:
    """Several blocks of samples."""
    truth = true_values(model, Fv__shoulder=0.5, Fv__elbow=0.2)
    found = synthetic(model, truth, 4, rate_hz=1000.0, duration=40.0, torque_std=0.3, period=None)
    assert found.samples > 4 * BLOCK
    return found


@pytest.mark.parametrize("torque", ["measured", "held_command"])
@pytest.mark.parametrize("settings", SETTINGS, ids=["default", "none", "ends"])
def test_rows_in_parts_are_those_of_the_whole(model, long, settings, torque) -> None:
    sampled = sample(long.replace(torque=torque), settings)
    blocks = list(sampled.rows(model))
    assert len(blocks) > 3
    motion = sampled.motion
    whole = model.columns(model.block(motion.t, motion.q, motion.v, motion.a))
    columns, tau = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    want = sampled.filtered(whole)
    np.testing.assert_allclose(columns, want, atol=1e-9 * np.abs(want).max())
    np.testing.assert_allclose(tau, sampled.filtered(motion.tau), atol=1e-9)
    np.testing.assert_allclose(sampled.v, sampled.filtered(motion.v), atol=1e-9)
    left = np.concatenate([one for one, _ in sampled.residuals(model, model.given_values())])
    np.testing.assert_allclose(left, tau - columns @ model.given_values(), atol=1e-8)


def test_a_part_of_a_motion_is_that_of_the_whole(long: Recording) -> None:
    sampled = sample(long, None)
    whole = differentiate(long, sampled.parallel.filter)
    for rows in (slice(0, 50), slice(7000, 7100), slice(whole.samples - 3, whole.samples)):
        part = sampled.source.part(rows)
        np.testing.assert_allclose(part.a, whole.a[rows], atol=1e-9 * np.abs(whole.a).max())
        np.testing.assert_array_equal(part.t, whole.t[rows])


def test_mapped_files_are_fitted_as_they_lie(model, long, tmp_path: Path) -> None:
    for name in ("t", "q", "tau"):
        np.save(tmp_path / f"{name}.npy", getattr(long, name))
    t, q, tau = (np.load(tmp_path / f"{name}.npy", mmap_mode="r") for name in ("t", "q", "tau"))
    mapped = Recording(t, q, tau, long.joints)
    assert np.shares_memory(mapped.q, q) and np.shares_memory(mapped.tau, tau)
    one, other = fit(model, Dataset((mapped,))), fit(model, Dataset((long,)))
    np.testing.assert_array_equal(one.values, other.values)
    np.testing.assert_array_equal(one.covariance, other.covariance)


@pytest.mark.slow
def test_a_longer_recording_takes_no_more_memory(model: Model, long: Recording) -> None:
    double = Recording(
        np.arange(2 * long.samples) / 1000.0,
        np.concatenate([long.q, long.q[::-1]]),
        np.concatenate([long.tau, long.tau[::-1]]),
        long.joints,
    )
    peaks = []
    for one in (long, double):
        data = Dataset((one,))
        fit(model, data)
        tracemalloc.start()
        fit(model, data)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


def test_rows_that_all_count_take_no_memory(long: Recording) -> None:
    counting = sample(long, None).counting
    assert counting.shape == (sample(long, None).count, 2) and counting.all()
    assert counting.strides == (0, 0)
    stopped = long.replace(stops=(np.array([[3.0, 4.0]]), np.zeros((0, 2))))
    some, t = sample(stopped, None).counting, sample(stopped, None).t
    np.testing.assert_array_equal(some[:, 0], (t < 3.0) | (t > 4.0))
    assert some[:, 1].all()


def test_memory_that_does_not_suffice_is_told_in_one_line(model: Model, long: Recording) -> None:
    class Greedy:
        name: ClassVar[str] = "greedy"

        def fit(self, model: Model, dataset: Dataset) -> Estimate:
            raise MemoryError

    with pytest.raises(FitError, match=r"out of memory\. use fewer or shorter recordings"):
        fit(model, long, Greedy())


def test_joints_of_a_mapped_file_stay_in_it(long: Recording, tmp_path: Path) -> None:
    q = np.column_stack([long.q, 2 * long.q])
    np.save(tmp_path / "q.npy", q)
    mapped = np.load(tmp_path / "q.npy", mmap_mode="r")
    recording = Recording(long.t, mapped, mapped, ("a", "b", "c", "d"))
    for joints, shared in (("bd", True), ("c", True), ("da", False), ("abd", False)):
        chosen = recording.select(tuple(joints))
        np.testing.assert_array_equal(chosen.q, q[:, ["abcd".index(one) for one in joints]])
        assert np.shares_memory(chosen.q, mapped) == shared
