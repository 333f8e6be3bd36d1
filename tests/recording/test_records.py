"""Several recordings in one file: a table each, and the names of their columns once."""

import numpy as np
import pytest
import scipy.io

from dynident.errors import RecordingError
from dynident.recording import Column, read, uniform, write
from dynident.study import load
from study_files import STUDY, write_study

NAMES = ["t", "q.a", "q.b", "i1", "i2"]
MAP = {"tau.a": Column("i1", 2.0), "tau.b": "i2"}


def tables(count=2, rows=50, step=0.01):
    rng = np.random.default_rng(0)
    t = step * np.arange(rows)
    return {f"run{k}": np.column_stack([t, rng.standard_normal((rows, 4))]) for k in range(count)}


def save(path, arrays):
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        scipy.io.savemat(path, arrays)


@pytest.mark.parametrize("suffix", [".npz", ".mat"])
def test_each_record_is_a_recording_of_its_own(tmp_path, suffix):
    runs, path = tables(), tmp_path / f"session{suffix}"
    save(path, {"columns": np.array(NAMES), **runs})
    for name, x in runs.items():
        found = read(path, ["a", "b"], MAP, record=name)
        np.testing.assert_array_equal(found.t, x[:, 0])
        np.testing.assert_array_equal(found.q, x[:, 1:3])
        np.testing.assert_array_equal(found.tau, x[:, 3:] * [2.0, 1.0])
        assert found.name == name
        assert found.provenance.file == str(path)
        assert found.where == f"{path}, record {name}"


def test_messages_and_resampled_recordings_name_the_record(tmp_path):
    runs = tables(1)
    runs["run0"][:, 0] += 1e-3 * np.random.default_rng(1).uniform(size=50)
    save(tmp_path / "s.npz", {"columns": np.array(NAMES), **runs})
    found = read(tmp_path / "s.npz", ["a", "b"], MAP, record="run0")
    with pytest.warns(UserWarning, match=r"s.npz, record run0: .*jittered"):
        assert uniform(found).where == found.where
    with pytest.raises(RecordingError, match=r"record run0.*no column 'i3'"):
        read(tmp_path / "s.npz", ["a", "b"], {**MAP, "tau.b": "i3"}, record="run0")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"columns": np.array(NAMES)}, r"no record 'run0'. did you mean 'run1'"),
        ({}, "no array 'columns' names its columns"),
        ({"columns": np.arange(5.0), "run0": 0}, "does not hold names"),
        ({"columns": np.array(["t", "t", "q.a"]), "run0": 0}, "the name 't' twice"),
        ({"columns": np.array(["t", "q.a", "tau.a"]), "run0": 0}, r"shape \(50, 5\), and 3"),
        ({"columns": np.array(["t", "q.a", "tau.a"]), "run0": 1}, r"shape \(50,\)"),
    ],
)
def test_what_is_no_record_is_refused(tmp_path, content, words):
    x = tables(1)["run0"]
    arrays = {
        key: (x, x[:, 0])[value] if key == "run0" else value for key, value in content.items()
    }
    save(tmp_path / "s.npz", {"run1": x} | arrays)
    with pytest.raises(RecordingError, match=words) as told:
        read(tmp_path / "s.npz", ["a"], record="run0")
    assert "\n" not in str(told.value)


def test_a_file_of_one_recording_has_no_records(arm, tmp_path):
    with pytest.raises(RecordingError, match="records are for NPZ and MAT files"):
        read(write(arm, tmp_path / "run.csv"), record="run0")


def test_a_study_names_records(tmp_path):
    """Two records of one file in place of two files give the same recordings."""
    straight = load(write_study(tmp_path))
    runs = {}
    for use, one in (("train", straight.train), ("test", straight.test)):
        (made,) = one.recordings
        runs[use] = np.column_stack([made.t, made.q, made.tau])
    names = ["t", "q.shoulder", "q.elbow", "tau.shoulder", "tau.elbow"]
    save(tmp_path / "both.npz", {"columns": np.array(names), **runs})
    text = STUDY
    for use in runs:
        text = text.replace(f'file = "{use}.csv"', f'file = "both.npz"\nrecord = "{use}"')
    (tmp_path / "study.toml").write_text(text)
    study = load(tmp_path / "study.toml")
    for one, other in ((study.train, straight.train), (study.test, straight.test)):
        assert [r.name for r in one.recordings] == [one.recordings[0].use]
        np.testing.assert_array_equal(one.recordings[0].q, other.recordings[0].q)
        np.testing.assert_array_equal(one.recordings[0].tau, other.recordings[0].tau)
    (tmp_path / "study.toml").write_text(text.replace('record = "train"', 'record = "trian"'))
    with pytest.raises(RecordingError, match=r"no record 'trian'. did you mean 'train'"):
        load(tmp_path / "study.toml")
