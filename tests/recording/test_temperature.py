"""Temperatures and numbers: of joints with a sensor, in files, on new clocks, in parts."""

import warnings

import numpy as np
import pytest

from dynident.errors import DynidentWarning, RecordingError
from dynident.recording import SUFFIXES, Column, Dataset, numbered, read, uniform, write

NAN = float("nan")


@pytest.fixture
def warm(arm):
    """The elbow has a sensor, the shoulder has none."""
    rising = 60.0 - 35.0 * np.exp(-arm.t / 2.0)
    return arm.replace(temperature=np.column_stack([np.full(arm.samples, NAN), rising]))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_files_keep_what_is_recorded_and_nothing_else(warm, tmp_path, suffix):
    again = read(write(warm, tmp_path / f"run{suffix}"), warm.joints)
    np.testing.assert_array_equal(again.temperature, warm.temperature)
    bare = write(warm.replace(temperature=None), tmp_path / f"bare{suffix}")
    assert read(bare, warm.joints).temperature is None
    assert read(bare.with_name(f"run{suffix}"), ["shoulder"]).temperature is None


def test_columns_can_have_other_names(warm, tmp_path):
    path = tmp_path / "run.npz"
    t = np.arange(9) * 1e-3
    np.savez(path, **{"t": t, "q.a": t, "tau.a": t, "motor": 300.0 + t})  # pyright: ignore
    recording = read(path, ["a"], {"temperature.a": Column("motor", 0.1)})
    assert recording.temperature is not None
    np.testing.assert_allclose(recording.temperature[:, 0], 30.0 + 0.1 * t)
    with pytest.raises(RecordingError, match=r"no column 'oil' \(for temperature.a"):
        read(path, ["a"], {"temperature.a": "oil"})


def test_cut_select_and_other_clocks_keep_it(warm):
    assert warm.cut(1.0, 2.0).temperature.shape == (250, 2)
    elbow = warm.select(["elbow"]).temperature
    assert elbow is not None
    np.testing.assert_array_equal(elbow[:, 0], warm.temperature[:, 1])
    assert warm.select(["shoulder"]).temperature is None
    t = warm.t + 4e-4 * np.sin(40.0 * warm.t)
    with pytest.warns(DynidentWarning, match="jittered"):
        even = uniform(warm.replace(t=t))
    assert even.temperature is not None
    assert np.isnan(even.temperature[:, 0]).all()
    np.testing.assert_allclose(even.temperature[:, 1], 60 - 35 * np.exp(-even.t / 2), atol=0.02)


def test_gaps_are_refused(warm):
    broken = warm.temperature.copy()
    broken[7, 1] = NAN
    with pytest.raises(RecordingError, match=r"row 8, column temperature\.elbow: nan is not"):
        warm.replace(temperature=broken)
    with pytest.raises(RecordingError, match="temperature has the shape"):
        warm.replace(temperature=broken[:, :1])


def test_kelvin_is_noticed(warm, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(write(warm, tmp_path / "run.csv"))
    hot = write(warm.replace(temperature=warm.temperature + 273.15), tmp_path / "hot.csv")
    with pytest.warns(DynidentWarning, match="temperature.elbow: is up to 328.* kelvin") as told:
        read(hot)
    assert len(told) == 1


@pytest.mark.parametrize("number", [-1, 1.5, True, "first", None])
def test_numbers_are_whole(arm, number):
    assert arm.number == 0 and arm.replace(number=3).number == 3
    with pytest.raises(RecordingError, match="number = "):
        arm.replace(number=number)


def test_recordings_without_numbers_are_numbered_through_all_datasets(arm):
    train, test = numbered(Dataset((arm, arm)), Dataset((arm.replace(number=1),)))
    assert [r.number for r in (*train.recordings, *test.recordings)] == [1, 2, 3]
    known = Dataset((arm.replace(number=4), arm.replace(number=2)))
    assert numbered(known, test)[0] is known
