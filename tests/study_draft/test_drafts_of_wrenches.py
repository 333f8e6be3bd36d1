"""`init` tells a wrench sensor's columns from torques, and drafts a study of them alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.errors import RecordingError
from dynident.fitting.wrench_sensor import fit_wrench
from dynident.recording import Column, Recording
from dynident.study import load_wrenches
from dynident.study_draft import LogFacts, draft_study
from dynident.study_draft.wrench_groups import wrench_groups
from study_files import recording
from synthetic import ARM
from wrench_logs import CRATE, FRAME, N, motion, recorded, robot, text


@pytest.mark.parametrize(
    "names",
    [
        ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
        ["ft_fx", "ft_fy", "ft_fz", "ft_tx", "ft_ty", "ft_tz"],
        [f"wrench.{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"],
        [f"ft_sensor_{k}" for k in range(6)],
        [f"wrench.{FRAME}.{one}" for one in ("fx", "fy", "fz", "tx", "ty", "tz")],
    ],
)
def test_columns_of_sensors_are_known_by_many_names(names: list[str]) -> None:
    joints = [f"q{k}" for k in range(6)]
    (found,) = wrench_groups(["t", *joints, *reversed(names), "tau_0", "tau_1"], robot())
    assert found.columns == tuple(names)
    assert found.frames[0] == FRAME


@pytest.mark.parametrize(
    "names",
    [
        [f"actual_TCP_force_{k}" for k in range(6)],  # worked out of the currents
        [f"target_wrench_{k}" for k in range(6)],
        ["Fx", "Fy", "Fz"],
        [f"torque_{k}" for k in range(6)],
    ],
)
def test_what_is_no_sensor_is_left_alone(names: list[str]) -> None:
    assert wrench_groups(names, robot()) == ()


def written(path: Path, columns: dict[str, np.ndarray]) -> Path:
    header, rows = ",".join(columns), np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def log(one: Recording, scale: float = 1.0) -> dict[str, np.ndarray]:
    joints = {f"joint_{k}_pos": scale * one.q[:, k] for k in range(N)}
    sensor = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
    return {"time": one.t, **joints, **dict(zip(sensor, one.tau[:, N:].T, strict=True))}


@pytest.mark.parametrize("scale", [1.0, 180 / np.pi])
def test_a_log_without_torques_is_drafted_for_payload(tmp_path: Path, scale: float) -> None:
    (tmp_path / "arm.urdf").write_text(text())
    data = written(tmp_path / "run.csv", log(recorded(CRATE, motion(1), 1), scale))
    draft = draft_study(tmp_path / "arm.urdf", [data])
    assert draft.next_command == "dynident payload"
    (problem,) = load_wrenches(draft.write(tmp_path / "study.toml"))
    (crate,) = fit_wrench(problem).loads
    assert crate.values[0] == pytest.approx(2.8, rel=0.005)
    (one,) = [one for one in draft.decisions if one.subject == "wrench"]
    assert FRAME in one.words and one.is_open


def test_torques_and_a_sensor_go_into_one_study(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    one = recording(1)
    joints = {"time": one.t, "pos_1": one.q[:, 0], "pos_2": one.q[:, 1]}
    torques = {"trq_1": one.tau[:, 0], "trq_2": one.tau[:, 1]}
    names = ("fx", "fy", "fz", "mx", "my", "mz")
    sensor = {name: np.sin(one.t + k) for k, name in enumerate(names)}
    data = written(tmp_path / "run.csv", joints | torques | sensor)
    draft = draft_study(tmp_path / "arm.urdf", [data])
    (frame,) = {ours.split(".")[1] for ours in draft.columns if ours.startswith("wrench.")}
    assert draft.columns[f"wrench.{frame}.tx"] == Column("mx")
    study = di.load(draft.write(tmp_path / "study.toml"))
    np.testing.assert_allclose(study.train.recordings[0].tau, one.tau, atol=1e-9)


@pytest.mark.parametrize("facts", [LogFacts(gears=[1.0] * N), LogFacts(columns={"q.x": "time"})])
def test_what_is_said_of_motors_is_refused_of_a_sensor_alone(tmp_path: Path, facts) -> None:
    run = written(tmp_path / "run.csv", log(recorded(CRATE, motion(1), 1)))
    (tmp_path / "arm.urdf").write_text(text())
    with pytest.raises(RecordingError, match="leave out --gears and --column"):
        draft_study(tmp_path / "arm.urdf", [run], facts=facts)
