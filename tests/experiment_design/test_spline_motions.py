"""B-splines as motions: at rest at both ends, within limits, written and read back."""

from __future__ import annotations

import tomllib
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dynident.closed_loop import BSpline, Controller, load_experiment
from dynident.errors import DesignError, SimulationError, StudyError
from dynident.experiment_design import DesignTask, MotionLimits, RecordingDesign, design
from dynident.experiment_design.design_files import EXPERIMENT, write_design
from dynident.experiment_design.motion_program import FINER, MotionProgram, instants_of
from dynident.experiment_design.motions.spline_motions import SplineMotions
from dynident.experiment_design.written_design import read_design
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

ROBOT = arm()
MODEL = Model(ROBOT) + "viscous_friction"
DATA = Dataset((synthetic(MODEL, true_values(MODEL), 1, torque_std=0.05),))


def motions(intervals: int = 12) -> SplineMotions:
    return SplineMotions(limits=MotionLimits.of(ROBOT), period=6.0, intervals=intervals)


@pytest.fixture(scope="module")
def found() -> RecordingDesign:
    return design(MODEL, DATA, DesignTask(duration=6.0, repeat=2, intervals=10, starts=1))


@pytest.mark.parametrize("intervals", [2, 7, 40])
def test_they_begin_and_end_at_rest_and_are_linear_in_their_variables(intervals: int) -> None:
    some = motions(intervals)
    variables = some.random(2)
    motion = some.trajectory(variables)
    for part, name in zip(motion.at(np.array([0.0, 6.0, 12.0])), "qva", strict=True):
        rest = some.centre(variables) if name == "q" else 0.0
        np.testing.assert_allclose(part - rest, 0.0, atol=1e-12)
    just = 6.0 * (1 - 1e-12)
    assert max(np.abs(one).max() for one in motion.at(np.array([just]))[1:]) < 1e-6
    t = some.times(301)
    for basis, part in zip(some.bases(t)[:3], motion.at(t), strict=True):
        linear = some.limits.speed * (basis @ variables.T)
        moved = part - part[0] if basis is not some.bases(t)[1] else part
        np.testing.assert_allclose(moved, linear - linear[0], atol=1e-10)
    later, earlier = (motion.at(t[1:] + step)[2] for step in (1e-5, -1e-5))
    np.testing.assert_allclose(
        some.jerk(variables, t[1:]), (later - earlier) / 2e-5, rtol=1e-3, atol=1e-2
    )


@pytest.mark.parametrize("intervals", [4, 8, 24])
@pytest.mark.slow
def test_a_jerk_that_is_largest_where_the_period_ends_is_seen(intervals: int) -> None:
    """It ends at another jerk than it begins with, and after the last of evenly spaced instants."""
    limits = replace(MotionLimits.of(ROBOT), jerk=np.array([12.0, 20.0]))
    some = SplineMotions(limits=limits, period=6.0, intervals=intervals)
    few = some.to_the_end(FINER * instants_of(some))
    many = np.append(np.linspace(0.0, 6.0, 20_001)[:-1], np.nextafter(6.0, 0.0))
    ends = 0
    for seed in range(30):
        variables = some.random(seed)
        used = np.abs(some.jerk(variables, many)) / limits.jerk
        ends += int((used.argmax(axis=0) == len(many) - 1).sum())
        share = limits.jerk_shares(some.jerk(variables, few))
        assert np.all(used.max(axis=0) <= (1 + 1e-6) * share)
        assert np.all(share <= 1.001 * used.max(axis=0))
    assert ends > 0


def test_memory_is_that_of_the_motion_however_many_points_it_has() -> None:
    points = np.pad(np.random.default_rng(0).normal(size=(2, 3000)), ((0, 0), (3, 3)))
    motion, t = BSpline(600.0, points), np.linspace(0.0, 600.0, 2000)
    motion.at(t[:2])
    tracemalloc.start()
    try:
        motion.at(t)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 2e6  # a matrix of instants and points has 48 MB


def test_derivatives_are_those_of_the_position() -> None:
    motion = motions().trajectory(motions().random(5))
    t, h = np.linspace(0.3, 5.7, 50), 1e-5
    before, now, after = (motion.at(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-6)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), now[2], atol=1e-4)


@pytest.mark.slow
def test_a_designed_spline_keeps_its_limits_and_tells_more_than_random_ones(found) -> None:
    program: MotionProgram = found.program
    t, limits = np.linspace(0.0, 6.0, 10 * FINER * program.instants), found.limits
    q, v, a = found.trajectory.at(t)
    assert isinstance(found.trajectory, BSpline)
    assert np.all(q >= limits.lower) and np.all(q <= limits.upper)
    assert np.all(np.abs(v) <= limits.speed) and np.all(np.abs(a) <= limits.acceleration)
    some = (program.within(program.motions.random(300 + k)) for k in range(50))
    assert found.motion.loss < min(program.loss(one) for one in some if one is not None)


def test_it_is_written_and_read_back(found, tmp_path: Path) -> None:
    controller = Controller(kind="pd", rate_hz=500.0, kp=(10.0, 10.0), kd=(2.0, 2.0))
    write_design(found, tmp_path, 100.0, controller)
    t = np.linspace(0.0, 12.0, 100)
    (run,) = load_experiment(tmp_path / EXPERIMENT).runs
    for one in (run.trajectory, read_design(tmp_path, ROBOT.names).trajectory):
        for ours, theirs in zip(one.at(t), found.trajectory.at(t), strict=True):
            np.testing.assert_allclose(ours, theirs, atol=1e-9)
    assert "sine" not in found.to_dict() and len(found.to_dict()["points"]) == 2


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ("[[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]", "2 rows"),
        ("[[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.1], [0, 0, 0, 1, 0, 0, 0]]", "at rest"),
        ("[[0.0, 0.0], [0.0, 0.0]]", "too few"),
        ("[[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0, 0]]\nspeed = 1.0", "two motions at once"),
    ],
)
def test_points_that_are_no_motion_are_one_line(found, tmp_path, points: str, said: str) -> None:
    controller = Controller(kind="pd", rate_hz=500.0, kp=(10.0, 10.0), kd=(2.0, 2.0))
    write_design(found, tmp_path, 100.0, controller)
    path = tmp_path / EXPERIMENT
    text = path.read_text()
    assert tomllib.loads(text)["recordings"][0]["trajectory"].keys() == {"points"}
    path.write_text(
        text[: text.index("[recordings.trajectory]")]
        + f"[recordings.trajectory]\npoints = {points}\n"
    )
    with pytest.raises((StudyError, SimulationError), match=said) as caught:
        load_experiment(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("intervals", [1, 0, -3, 500])
def test_impossible_numbers_of_intervals_are_refused(intervals: int) -> None:
    with pytest.raises(DesignError, match="intervals"):
        motions(intervals)
