"""Published figures and real defects of measured data."""

import numpy as np
import pytest

from dynident.errors import DynidentWarning
from dynident.recording import (
    Column,
    Filter,
    ParallelFilter,
    differentiate,
    periods,
    read,
    require_repetition,
    uniform,
)

GTAU = 35.15065188248547
EMPS = {
    "t": "t",
    "q.slider": "qm",
    "tau.slider": Column("vir", GTAU),
    "q_ref.slider": "qg",
}
AUTHORS = Filter(
    position_cutoff_hz=100.0,
    rate_hz=100.0,
    decimation="chebyshev",
    edge_s=(0.049, 0.0),
    ends="keep",
    difference_order=2,
)


@pytest.fixture
def emps(measured):
    return read(measured("emps/DATA_EMPS.mat"), ["slider"], EMPS, ["prismatic"])


def authors_fit(recording, extra):
    """Ordinary least squares as the authors did it: values, deviations, condition, error."""
    assert uniform(recording) is recording
    motion = differentiate(recording, AUTHORS)
    parallel = ParallelFilter(AUTHORS, motion.rate_hz)
    v, a = motion.v[:, 0], motion.a[:, 0]
    columns = np.column_stack([a, *extra(v)])
    x, y = parallel.apply(columns), parallel.apply(motion.tau[:, 0])
    values, *_ = np.linalg.lstsq(x, y, rcond=None)
    residual = y - x @ values
    variance = residual @ residual / (len(y) - 1)  # theirs, not the unbiased len(y) - 4
    deviations = np.sqrt(variance * np.diag(np.linalg.inv(x.T @ x)))
    error = np.linalg.norm(residual) / np.linalg.norm(y)
    return values, deviations, np.linalg.cond(x), 100 * error


def test_emps_symmetric_friction(emps):
    values, deviations, condition, error = authors_fit(
        emps, lambda v: (v, np.sign(v), np.ones_like(v))
    )
    np.testing.assert_allclose(values, [95.1089, 203.5034, 20.3935, -3.1648], rtol=1e-4)
    np.testing.assert_allclose(deviations, [0.1085, 1.1460, 0.1012, 0.0444], atol=5.1e-5)
    assert condition == pytest.approx(25.9883, rel=1e-4)
    assert error == pytest.approx(4.0834, rel=1e-4)


def test_emps_asymmetric_friction(emps):
    values, *_, error = authors_fit(
        emps, lambda v: (v * (v > 0), 1.0 * (v > 0), v * (v < 0), -1.0 * (v < 0))
    )
    np.testing.assert_allclose(values, [95.1540, 166.7061, 20.1440, 240.4236, 20.6277], rtol=1e-4)
    assert error == pytest.approx(3.1117, rel=1e-4)


def test_emps_held_command_lowers_the_error(emps):
    *_, error = authors_fit(
        emps.replace(torque="held_command"), lambda v: (v, np.sign(v), np.ones_like(v))
    )
    assert error == pytest.approx(4.01, abs=0.005)


def test_emps_repeats(emps):
    recording = emps.replace(period=6.24)
    assert uniform(recording) is recording
    motion = differentiate(recording, AUTHORS)
    parallel = ParallelFilter(AUTHORS, motion.rate_hz, 6.24)
    q = parallel.apply(motion.q)
    found = periods(len(q), parallel.output_rate_hz, 6.24)
    assert found.rows_per_period == 624
    assert found.count * found.rows > 3 * 624
    require_repetition(q, found)
    with pytest.raises(Exception, match=r"they do after 1\.04 times that period"):
        require_repetition(q, periods(len(q), parallel.output_rate_hz, 6.0))


def test_panda_repeated_readings(measured):
    joints = [f"joint{i}" for i in range(1, 8)]
    columns = {"t": "t"}
    for ours, theirs in (("q", "q"), ("v", "dq"), ("tau", "tau")):
        columns |= {f"{ours}.{joint}": f"{theirs}[{i}]" for i, joint in enumerate(joints)}
    recording = read(measured("panda/recording.npz"), joints, columns, ["revolute"] * 7)
    assert recording.jitter > 5
    with pytest.warns(DynidentWarning, match=r"jittered by .* rows \(5.\d? ?%\) repeat"):
        even = uniform(recording)
    assert even.jitter < 1e-9

    def roughness(one):
        motion = differentiate(one, Filter(position_cutoff_hz=100, edge_s=(0.2, 0.2)))
        wanted = np.interp(motion.t, one.t, one.v[:, 3])
        return np.std(motion.v[:, 3] - wanted)

    assert roughness(even) < roughness(recording)


def test_double_pendulum(measured):
    path = measured("dfki_double_pendulum_C0/recordings.npz")
    record = "trajectory_00"
    names = ["t", "q.shoulder", "q.elbow", "v.shoulder", "v.elbow", "tau.shoulder", "tau.elbow"]
    columns = {ours: f"{record}[{i}]" for i, ours in enumerate(names)}
    recording = read(path, ["shoulder", "elbow"], columns, ["revolute", "revolute"])
    assert recording.samples == 4993
    with pytest.warns(DynidentWarning, match="9 samples are missing, and .* jittered by 35"):
        assert uniform(recording).samples == 4993 + 9
