"""Drafts of arms of which a motor turns two joints: said, seen in torques, or seen in speeds."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynident as di
from chains import chain_text
from dynident.errors import RecordingError
from dynident.recording import Column, Recording
from dynident.study_draft import Decision, LogFacts, StudyDraft, draft_study
from dynident.study_draft.guesses.amendments import amended, shared
from dynident.study_draft.guesses.coupled_motors import Coupling
from dynident.study_draft.guesses.file_reading import Reading
from dynident.study_draft.guesses.motor_side import joint_side
from dynident.study_draft.shared_motors import with_shared_motors
from synthetic import smooth_motion

N = 4
RATIOS = np.array([50.0, 40.0, -45.0, 32.0])
STATED = {"q.j3": "m_pos[3]/32 + m_pos[2]/45 - 0.25"}


@dataclass(frozen=True, eq=False)
class Arm:
    """A chain, what its joints did, and the file that its drives wrote."""

    folder: Path
    recording: Recording

    @property
    def robot(self) -> Path:
        return self.folder / "arm.urdf"

    def draft(self, **facts) -> StudyDraft:
        told = LogFacts(gears=RATIOS.tolist(), **facts)
        return draft_study(self.robot, [self.folder / "run.npz"], facts=told)

    def study(self, draft: StudyDraft) -> di.Study:
        path = self.folder / "study.toml"
        path.unlink(missing_ok=True)
        return di.load(draft.write(path))


def written(folder: Path, text: str, turns: float, *, zero: float = 0.0, seed: int = 3) -> Arm:
    """Motors that rub by their own speeds; the third turns the last joint `turns` times, too."""
    (folder / "arm.urdf").write_text(text)
    robot = di.Robot.from_file(folder / "arm.urdf")
    t, q, v, a = smooth_motion(N, seed, 100.0, 16.0, 8.0)
    motors = np.eye(N)  # turns of motors behind their gears, from those of joints
    motors[3, 2] = -turns
    speed = v @ motors.T
    rubs = 0.6 * speed + 0.8 * np.tanh(speed / 0.01) + 0.05 * (a @ motors.T)
    tau = robot.inverse_dynamics(q, v, a) + rubs @ motors
    position = (q - np.array([0, 0, 0, zero])) @ motors.T * RATIOS
    effort = tau @ np.linalg.inv(motors) / RATIOS
    rng = np.random.default_rng(5)
    noise = 0.01 * effort.std(axis=0) * rng.standard_normal(effort.shape)
    np.savez(folder / "run.npz", t=t, m_pos=position, m_vel=speed * RATIOS, m_tau=effort + noise)
    exact = (effort + noise) * RATIOS @ motors
    return Arm(folder, Recording(t, q, exact, robot.names, v=v))


def assert_same(study: di.Study, arm: Arm) -> None:
    found = study.train.recordings[0]
    np.testing.assert_allclose(found.q, arm.recording.q, atol=1e-9)
    np.testing.assert_allclose(found.tau, arm.recording.tau, atol=1e-9)
    assert found.v is not None and arm.recording.v is not None
    np.testing.assert_allclose(found.v, arm.recording.v, atol=1e-9)


@pytest.mark.slow
def test_what_is_said_of_a_position_holds_for_speed_and_torque(tmp_path: Path) -> None:
    """Power is the same on either side of the gears, and the friction of motors is no fault."""
    arm = written(tmp_path, chain_text(N, 1), -1.0, zero=-0.25)
    draft = arm.draft(columns=STATED)
    study = arm.study(draft)
    assert_same(study, arm)
    read = study.train.recordings[0]
    assert read.v is not None
    with np.load(tmp_path / "run.npz") as file:
        power = np.sum(file["m_vel"] * file["m_tau"], axis=1)
    np.testing.assert_allclose(np.sum(read.v * read.tau, axis=1), power, atol=1e-9)
    said = {one.subject: one for one in draft.decisions}
    assert "tau.j2" in said["stated"].reason
    assert not {"zeros", "coupling", "units and signs"} & set(said)
    given = arm.draft(columns={**STATED, "tau.j2": "m_tau[2]"})
    assert given.columns["tau.j2"].name == "m_tau[2]"
    (said,) = (one for one in given.decisions if one.subject == "stated")
    assert "tau.j2 of the joint: a motor's would be multiplied by its gear" in said.reason


def test_behind_gears_a_column_without_a_name_is_asked_for_with_its_ratio(tmp_path: Path) -> None:
    arm = written(tmp_path, chain_text(N, 1), 0.0)
    with np.load(tmp_path / "run.npz") as file:
        t, position, torque = file["t"], file["m_pos"], file["m_tau"]
    for values, asked in (
        ({"pq": position, "m_tau": torque}, "q.j0 = NAME/50"),
        ({"m_pos": position, "um": torque}, "tau.j0 = 50*NAME"),
    ):
        np.savez(tmp_path / "run.npz", t=t, **values)
        with pytest.raises(RecordingError, match=re.escape(asked)):
            arm.draft()
    told = {f"tau.j{k}": f"{ratio:g}*um[{k}]" for k, ratio in enumerate(RATIOS)}
    read = arm.study(arm.draft(columns=told)).train.recordings[0]
    np.testing.assert_allclose(read.tau, arm.recording.tau, atol=1e-9)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"q.j9": "m_pos[0]"}, "'q.j9' is no column of this robot"),
        ({"t": "m_pos[0]"}, "'t' is no column of this robot"),
        ({"q.j3": "m_pos[3]/32 - motor[2]"}, "'motor[2]' is no column of the files"),
        ({"q.j3": "m_pos[3]*m_pos[2]"}, "not linear"),
        ({"q.j3": "m_pos[2]/32"}, "do not tell the motors apart"),
        ({"q.j3": "m_pos[3]/32 + m_vel[2]/45"}, "'m_vel[2]' stands beside motors' positions"),
        ({"q.j3": "m_pos[3]/64"}, "has 1/64 of its motor, where the gears have 1/32"),
    ],
)
def test_what_is_said_wrongly_is_refused(tmp_path: Path, columns, message: str) -> None:
    arm = written(tmp_path, chain_text(N, 1), 0.0)
    with pytest.raises(RecordingError, match=re.escape(message)):
        arm.draft(columns=columns)


@pytest.mark.slow
def test_a_heavy_wrist_shows_that_its_motor_turns_two_joints(tmp_path: Path) -> None:
    for turns, sign in ((-1.0, "less"), (1.0, "plus")):
        arm = written(tmp_path, chain_text(N, 1), turns)
        draft = arm.draft()
        (one,) = (one for one in draft.decisions if one.subject == "coupling")
        assert one.words == f"j3 is its motor's turn {sign} that of j2"
        assert "has not seen" in one.reason
        assert_same(arm.study(draft), arm)
        assert draft.otherwise is not None
        alone = {ours: column.name for ours, column in draft.otherwise.columns.items()}
        assert alone == {"q.j3": "m_pos[3]/32", "v.j3": "m_vel[3]/32", "tau.j2": "-45*m_tau[2]"}


@pytest.mark.parametrize("turns", [-1.0, 1.0])
@pytest.mark.slow
def test_wiring_that_is_mended_after_a_coupling_takes_the_motors_along(
    tmp_path: Path, turns: float
) -> None:
    """Of joints in each other's place, the other reading has one motor at each."""
    arm = written(tmp_path, chain_text(N, 1), turns)
    robot = di.Robot.from_file(arm.robot)
    first = {
        f"{ours}.{joint}": Column(f"{theirs}[{k}]")
        for joint, k in zip(robot.names, (0, 1, 3, 2), strict=True)
        for ours, theirs in (("q", "m_pos"), ("v", "m_vel"), ("tau", "m_tau"))
    }
    columns = joint_side(first, robot, [50.0, 40.0, 32.0, -45.0])
    alone = Reading(robot=robot, columns=columns, geared=True)
    swapped = shared(alone, Coupling(joint="j2", by="j3", turns=turns))

    def read(reading: Reading) -> tuple[Recording, ...]:
        path = tmp_path / "run.npz"
        return (di.read(path, robot.names, reading.columns, robot.kinds),)

    def take(subject: str, choices: list[str], _reason: str) -> int:
        wanted = subject == "units and signs"
        return next(k for k, one in enumerate(choices) if (one == "as recorded") != wanted)

    mended = amended(swapped, read, take)
    (found,) = read(mended)
    np.testing.assert_allclose(found.q, arm.recording.q, atol=1e-9)
    _, otherwise = with_shared_motors(mended, (found,), take)
    assert otherwise is not None
    one_each = {ours: column.name for ours, column in otherwise.columns.items()}
    assert one_each == {"q.j3": "m_pos[3]/32", "v.j3": "m_vel[3]/32", "tau.j2": "-45*m_tau[2]"}


def renamed(columns: dict[str, np.ndarray], before: str) -> dict[str, np.ndarray]:
    """The same with longer names, as topics of ROS have."""
    return {name if name == "t" else before + name: x for name, x in columns.items()}


@pytest.mark.slow
def test_a_coupling_of_columns_with_long_names_is_written_as_it_is_read(tmp_path: Path) -> None:
    arm = written(tmp_path, chain_text(N, 1), -1.0)
    before = f"/{'left_arm_controller/' * 8}"
    rewritten(arm, lambda x: renamed(x, before))
    draft = arm.draft()
    assert len(draft.columns["q.j3"].name) > 300
    assert_same(arm.study(draft), arm)


@pytest.mark.parametrize(
    ("before", "message"),
    [
        ("x" * 1500, "is longer than 2000 characters. give the columns shorter names in the files"),
        ("a`b", "has a backtick in its name: no expression can hold it. rename it in the files"),
    ],
)
def test_names_that_no_expression_holds_are_refused(
    tmp_path: Path, before: str, message: str
) -> None:
    arm = written(tmp_path, chain_text(N, 1), -1.0)
    rewritten(arm, lambda x: renamed(x, before))
    with pytest.raises(RecordingError, match=re.escape(message)) as caught:
        arm.draft()
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


@pytest.mark.slow
def test_motors_that_turn_one_joint_each_are_left_alone(tmp_path: Path) -> None:
    """The draft says how the other reading is written."""
    for seed in (1, 2):
        arm = written(tmp_path, chain_text(N, seed), 0.0)
        draft = arm.draft()
        assert "coupling" not in {one.subject for one in draft.decisions}
        assert_same(arm.study(draft), arm)
    text = (tmp_path / "study.toml").read_text()
    assert '\n# "q.j3" = "m_pos[3]/32 + m_pos[2]/45"\n' in text
    assert '\n# "tau.j2" = "-45*m_tau[2] + 32*m_tau[3]"\n' in text


def light_wrist(arm: Arm, share: float) -> str:
    """A description whose last link weighs nothing, and whose limits are the speeds reached."""
    v = arm.recording.v
    assert v is not None
    reached = np.abs(v).max(axis=0) * np.array([1.0, 1.0, 1.0, share])
    text = chain_text(N, 1)
    head, link, tail = text.partition('<link name="l3">')
    body, end, rest = tail.partition("</link>")
    text = head + link + re.sub(r'="([-\d.e]+)"', lambda x: f'="{1e-6 * float(x[1])}"', body)
    parts = (text + end + rest).split('velocity="3"')
    limits = [f'velocity="{limit}"' for limit in reached]
    return "".join(a + b for a, b in zip(parts, [*limits, ""], strict=True))


@pytest.mark.slow
def test_limits_of_speed_raise_a_question_where_a_wrist_is_light(tmp_path: Path) -> None:
    """They are no evidence by themselves: nothing changes until somebody answers."""
    arm = written(tmp_path, light_wrist(written(tmp_path, chain_text(N, 1), -1.0), 1.0), -1.0)
    draft = arm.draft()
    (one,) = (one for one in draft.decisions if one.subject == "coupling")
    assert one.words == "each motor turns one joint" and one.is_open
    assert "over its limit in the description" in one.reason
    assert draft.columns["q.j3"].name == "m_pos[3]/32"
    option = "--column 'q.j3 = m_pos[3]/32 + m_pos[2]/45'"
    assert draft.open_question.endswith(option)
    text = draft.text(tmp_path)
    assert f"\n# {option}\n" in text
    assert '\n# "tau.j2" = "-45*m_tau[2] + 32*m_tau[3]"\n' in text
    _, stated = shlex.split(option)
    ours, _, theirs = stated.partition(" = ")
    assert_same(arm.study(arm.draft(columns={ours: theirs})), arm)

    def yes(decision: Decision) -> int:
        return 1 if decision.subject == "coupling" else 0

    told = LogFacts(gears=RATIOS.tolist())
    asked = draft_study(arm.robot, [tmp_path / "run.npz"], facts=told, ask=yes)
    assert_same(arm.study(asked), arm)


@pytest.mark.parametrize("seed", [3, 6])
@pytest.mark.slow
def test_a_limit_that_is_too_low_makes_no_coupling(tmp_path: Path, seed: int) -> None:
    """The same light wrist whose motors turn one joint each, and a description 7 % too low."""
    first = written(tmp_path, chain_text(N, 1), 0.0, seed=seed)
    arm = written(tmp_path, light_wrist(first, 1 / 1.07), 0.0, seed=seed)
    draft = arm.draft()
    (one,) = (one for one in draft.decisions if one.subject == "coupling")
    assert one.words == "each motor turns one joint"
    assert_same(arm.study(draft), arm)


@pytest.mark.slow
def test_limits_that_no_joint_comes_near_tell_nothing(tmp_path: Path) -> None:
    text = light_wrist(written(tmp_path, chain_text(N, 1), -1.0), 1.0)
    for kept, joints in (("1000", (0, 1, 2)), ("0.5", (0,))):  # not reached; not kept
        parts = re.split(r'velocity="[^"]+"', text)
        limits = re.findall(r'velocity="[^"]+"', text)
        for joint in joints:
            limits[joint] = f'velocity="{kept}"'
        other = "".join(a + b for a, b in zip(parts, [*limits, ""], strict=True))
        draft = written(tmp_path, other, -1.0).draft()
        assert "coupling" not in {one.subject for one in draft.decisions}
        assert "If the motor of j2 turns j3 too" in draft.text(tmp_path)


def rewritten(arm: Arm, change: Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]) -> None:
    """Write the arm's file anew."""
    with np.load(arm.folder / "run.npz") as file:
        columns = {name: file[name] for name in file.files}
    changed: dict[str, Any] = change(columns)
    np.savez(arm.folder / "run.npz", **changed)


@pytest.mark.slow
def test_currents_of_two_motors_are_not_added_unasked(tmp_path: Path) -> None:
    """Each has a gain of its own: whoever knows these writes the sum."""
    arm = written(tmp_path, chain_text(N, 1), -1.0)
    rewritten(arm, lambda x: {"m_current" if k == "m_tau" else k: y for k, y in x.items()})
    told = {"q.j3": "m_pos[3]/32 + m_pos[2]/45"}
    with pytest.raises(RecordingError, match=r"give --column tau\.j2 \(currents of two motors add"):
        arm.draft(columns=told)
    sum_ = "-45*m_current[2] + 20*m_current[3]"
    draft = arm.draft(columns={**told, "tau.j2": sum_})
    assert draft.torque_unit == "A" and draft.columns["tau.j2"].name == sum_
    silent = arm.draft()
    assert silent.otherwise is None and "coupling" not in {x.subject for x in silent.decisions}


def test_degrees_in_a_stated_position_are_no_gear(tmp_path: Path) -> None:
    """Torques keep their size: the power of a motor is not counted in degrees."""
    arm = written(tmp_path, chain_text(N, 1), -1.0)

    def in_degrees(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        turned = {name: columns[name].copy() for name in ("m_pos", "m_vel")}
        for column in turned.values():
            column[:, 2:] = np.rad2deg(column[:, 2:])
        return {**columns, **turned}

    rewritten(arm, in_degrees)
    told = {
        "q.j2": "-m_pos[2]*pi/180/45",
        "q.j3": "m_pos[3]*pi/180/32 + m_pos[2]*pi/180/45",
    }
    assert_same(arm.study(arm.draft(columns=told)), arm)


def test_what_is_said_of_a_position_turns_speed_and_reference(tmp_path: Path) -> None:
    """Without gears too: sign and factor for both, the offset for the reference alone."""
    arm = written(tmp_path, chain_text(N, 1), 0.0)
    q, v, tau = arm.recording.q, arm.recording.v, arm.recording.tau
    assert v is not None
    back = np.array([1.0, -2.0, 1.0, 1.0])
    raw = (q - [0.0, 0.25, 0.0, 0.0]) / back
    t = arm.recording.t
    np.savez(tmp_path / "run.npz", t=t, pos=raw, vel=v / back, tau=tau, pos_ref=raw)
    told = LogFacts(columns={"q.j1": "-2*pos[1] + 0.25"})
    draft = draft_study(arm.robot, [tmp_path / "run.npz"], facts=told)
    study = arm.study(draft)
    assert_same(study, arm)
    asked = study.train.recordings[0].q_ref
    assert asked is not None
    np.testing.assert_allclose(asked, q, atol=1e-9)
