"""`dynident payload` of a study whose files hold a wrench sensor, and no torques of joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.recording import COMPONENTS, Recording
from wrench_logs import CRATE, FRAME, TOOL, N, motion, recorded, robot, text

STUDY = """\
robot = "arm.urdf"

[loads.crate]

[[recordings]]
file = "empty.csv"

[[recordings]]
file = "crate.csv"
payload = "crate"
"""


def written(file: Path, recording: Recording, names: list[str]) -> None:
    table = np.column_stack([recording.t, recording.q[:, :N], recording.tau[:, N:]])
    header = ",".join(["t", *(f"q.{joint}" for joint in robot().names), *names])
    np.savetxt(file, table, delimiter=",", header=header, comments="", fmt="%.9g")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(text())
    names = [f"wrench.{FRAME}.{one}" for one in COMPONENTS]
    written(tmp_path / "empty.csv", recorded(TOOL, motion(3, 10.0), 3), names)
    written(tmp_path / "crate.csv", recorded(TOOL + CRATE, motion(4, 10.0), 4), names)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


@pytest.mark.slow
def test_the_sensor_weighs_without_any_torque(run, folder: Path) -> None:
    done = run("payload", folder / "study.toml", "--json")
    assert done.status == 0
    (sensor,) = done.json["wrench_sensors"]
    tool, crate = sensor["loads"]
    assert tool["name"] == "on the sensor"
    assert tool["mass"] == pytest.approx(1.6, rel=0.005)
    assert crate["mass"] == pytest.approx(2.8, rel=0.005)
    assert crate["centre"] == pytest.approx([-0.03, 0.05, 0.11], abs=0.002)
    assert crate["consistent"]
    shown = run("payload", folder / "study.toml").out
    assert "Load 'crate'" in shown
    assert f"The wrench sensor at '{FRAME}'" in shown


@pytest.mark.slow
def test_columns_of_a_sensor_go_by_other_names(run, folder: Path) -> None:
    before = run("payload", folder / "study.toml", "--json").json
    names = [f"ft_{one}" for one in COMPONENTS]
    written(folder / "empty.csv", recorded(TOOL, motion(3, 10.0), 3), names)
    written(folder / "crate.csv", recorded(TOOL + CRATE, motion(4, 10.0), 4), names)
    mapping = [f'"wrench.{FRAME}.{one}" = "ft_{one}"' for one in COMPONENTS]
    (folder / "study.toml").write_text("\n".join([STUDY, "[columns]", *mapping]))
    after = run("payload", folder / "study.toml", "--json").json
    assert after == before
    (folder / "study.toml").write_text("\n".join([STUDY, "[columns]", *mapping[:5]]))
    done = run("payload", folder / "study.toml")
    assert done.status == 2
    assert f"no column 'wrench.{FRAME}.tz'" in done.err


@pytest.mark.slow
def test_one_load_under_study_needs_no_name(run, folder: Path) -> None:
    plain = STUDY.replace("[loads.crate]\n", "").replace('"crate"', "true")
    (folder / "study.toml").write_text(plain)
    done = run("payload", folder / "study.toml", "--json")
    (sensor,) = done.json["wrench_sensors"]
    assert sensor["loads"][1]["mass"] == pytest.approx(2.8, rel=0.005)


def test_other_commands_say_that_no_torque_is_recorded(run, folder: Path) -> None:
    done = run("fit", folder / "study.toml")
    assert done.status == 2
    assert "tau.j0" in done.err
    assert len(done.err.strip().splitlines()) == 1


def test_a_frame_that_the_robot_lacks_is_named(run, folder: Path) -> None:
    data = (folder / "empty.csv").read_text().replace(f"wrench.{FRAME}.", "wrench.gripper.")
    (folder / "empty.csv").write_text(data)
    done = run("payload", folder / "study.toml")
    assert done.status == 2
    assert "no link 'gripper'" in done.err
