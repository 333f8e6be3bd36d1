"""Studies whose torques are in the unit of the drives, and whose recordings name their loads."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from dynident.cli import commands
from dynident.errors import StudyError
from dynident.fitting import fit
from dynident.fitting.drive_gains import with_gain_errors
from dynident.inertia import from_com
from dynident.model import Model
from dynident.recording import Recording, write
from dynident.study import Study, load
from study_files import edited
from synthetic import ARM, arm, smooth_motion

GAINS = np.array([12.0, 5.0])
STD = np.array([0.02, 0.02])
TOOL = (1.5, [0.1, -0.02, 0.0], 0.004)  # kg, m, kg m^2 about z
CRATE = (0.8, [0.05, 0.06, 0.0], 0.002)
STUDY = """\
robot = "arm.urdf"
effects = ["viscous_friction"]
torque_unit = "A"

[noise]
position_std = 1e-6
torque_std = [0.02, 0.02]

[loads.tool]
mass = 1.5
centre = [0.1, -0.02, 0.0]
inertia = [0.002, 0, 0, 0.002, 0, 0.004]

[loads.crate]

[[recordings]]
file = "empty.csv"

[[recordings]]
file = "tool.csv"
payload = "tool"

[[recordings]]
file = "crate.csv"
payload = "crate"

[[recordings]]
file = "test.csv"
use = "test"
payload = "tool"
"""


def phi(body: tuple[float, list[float], float]) -> np.ndarray:
    return from_com(body[0], body[1], np.diag([0.0, 0.0, body[2]]))


@cache
def recorded(seed: int, body: str) -> tuple[Recording, np.ndarray]:
    """Currents of the arm with a load, and the torques (T, 2) of the arm alone in N m."""
    model = Model(arm()) + "viscous_friction"
    values = model.given_values()
    values[model.base.rank :] = [1.0, 0.5]
    t, q, v, a = smooth_motion(2, seed, 100.0, 12.0, 12.0)
    alone = model.torque(model.block(t, q, v, a), values)
    carrying = model + "payload"
    load = {"": np.zeros(10), "tool": phi(TOOL), "crate": phi(CRATE)}[body]
    block = carrying.block(t, q, v, a, carries_payload=True)
    current = carrying.torque(block, np.append(values, load)) / GAINS
    noise = STD * np.random.default_rng(seed).normal(size=current.shape)
    return Recording(t, q, current + noise, model.robot.names), alone


BODIES = {"empty": "", "tool": "tool", "crate": "crate", "test": "tool"}


def written(folder: Path, text: str = STUDY) -> Path:
    (folder / "arm.urdf").write_text(ARM)
    for seed, (name, body) in enumerate(BODIES.items()):
        write(recorded(seed, body)[0], folder / f"{name}.csv")
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


@pytest.fixture
def study(tmp_path: Path):
    def make(text: str = STUDY) -> Study:
        return load(written(tmp_path, text))

    return make


def test_torques_of_a_study_are_those_of_the_robot_alone_in_newton_metres(study) -> None:
    made = study()
    assert made.drives is not None
    np.testing.assert_allclose(made.drives.gains, GAINS, rtol=0.02)
    assert set(made.drives.findings) == {"identified"}
    crate = made.drives.loads[1]
    assert crate.values[0] == pytest.approx(CRATE[0], rel=0.02)
    every = (*made.train.recordings, *made.test.recordings)
    for seed, (one, body) in enumerate(zip(every, BODIES.values(), strict=True)):
        alone = recorded(seed, body)[1][50:-50]
        left = one.tau[50:-50] - alone
        bound = 2 * STD * GAINS + 0.03 * np.sqrt(np.mean(alone**2, axis=0))
        assert np.all(np.sqrt(np.mean(left**2, axis=0)) < bound)
        assert one.payload is None and not one.load
        assert "torque from A by shoulder" in one.provenance.filter
        assert ("less the torque of the load" in one.provenance.filter) == bool(body)
    assert made.train.noise is not None
    np.testing.assert_allclose(made.train.noise.torque_std, STD * made.drives.gains)


@pytest.mark.slow
def test_a_fit_prints_the_gains_first_and_has_their_errors(tmp_path: Path) -> None:
    path = written(tmp_path)
    done = CliRunner().invoke(commands, ["fit", str(path)])
    assert done.exit_code == 0
    assert done.stdout.index("Gains of the drives") < done.stdout.index("Parameters")
    assert "Load 'crate'" in done.stdout and "Load 'tool'" not in done.stdout
    done = CliRunner().invoke(commands, ["fit", str(path), "--json"])
    said = json.loads(done.stdout)
    assert [one["name"] for one in said["drives"]["joints"]] == ["shoulder", "elbow"]
    made = load(path)
    plain = fit(made.model, made.train).sigma
    wide = np.array([one["sigma"] for one in said["parameters"]])
    assert np.all(wide >= plain * (1 - 1e-9)) and np.any(wide > 1.1 * plain)


@pytest.mark.slow
def test_an_explanation_and_its_report_have_the_gains_with_their_intervals(tmp_path: Path) -> None:
    """The gains are the answer, and what rests on them holds their errors."""
    path = written(tmp_path)
    page = tmp_path / "report.html"
    words = ["explain", str(path), "--most", "0", "--propose", "never", "--report", str(page)]
    done = CliRunner().invoke(commands, words)
    assert done.exit_code == 0, done.output
    drives = load(path).drives
    assert drives is not None
    for low, high in drives.intervals:
        between = f"{low:.4g} to {high:.4g}"
        assert between in done.stdout and between in page.read_text()
    said = " ".join(done.stdout.split())
    assert "What is said in N m of torques is A times these gains." in said
    assert "It holds the errors of the gains and loads too." in page.read_text()


def test_sigma_beside_other_effects_takes_the_gains_for_known_and_says_so(study) -> None:
    made = study()
    assert made.drives is not None
    estimate = fit(made.model + "joint_spring@elbow", made.train)
    shown = with_gain_errors(estimate, made.drives)
    np.testing.assert_array_equal(shown.sigma, estimate.sigma)
    assert "It takes the gains and loads for known" in shown.words_of_sigma


@pytest.mark.parametrize("command", ["compare", pytest.param("diagnose", marks=pytest.mark.slow)])
def test_commands_say_up_to_which_scale_things_are_known(tmp_path: Path, command: str) -> None:
    text = STUDY.split("[[recordings]]")[0] + '[[recordings]]\nfile = "empty.csv"\n'
    path = written(tmp_path, edited(("[loads.crate]", ""), text=text))
    done = CliRunner().invoke(commands, [command, str(path)])
    assert done.exit_code == 0, done.output
    assert "known up to the common scale of the drives" in " ".join(done.stdout.split())


def test_a_gain_that_is_known_fixes_the_scale(study) -> None:
    text = edited(
        ('torque_unit = "A"', 'torque_unit = "A"\ndrive_gains = { elbow = 5.0 }'),
        ("mass = 1.5\ncentre = [0.1, -0.02, 0.0]\ninertia = [0.002, 0, 0, 0.002, 0, 0.004]\n", ""),
        text=STUDY,
    )
    drives = study(text).drives
    assert drives.findings == ("identified", "given")
    assert drives.gains[0] == pytest.approx(GAINS[0], rel=0.02)
    assert [load.values[0] for load in drives.loads] == pytest.approx([1.5, 0.8], rel=0.03)


def test_loads_may_be_stated_where_they_are_carried(study) -> None:
    inline = "payload = { mass = 1.5, centre = [0.1, -0.02, 0.0] }"
    made = study(edited(('payload = "tool"', inline), text=STUDY))
    assert len(made.drives.loads) == 2
    np.testing.assert_allclose(made.drives.gains, GAINS, rtol=0.02)


def test_loads_are_weighed_in_newton_metres_too(tmp_path: Path) -> None:
    path = written(tmp_path, edited(('torque_unit = "A"', 'torque_unit = "N m"'), text=STUDY))
    for seed, (name, body) in enumerate(BODIES.items()):
        one = recorded(seed, body)[0]
        write(one.replace(tau=one.tau * GAINS), tmp_path / f"{name}.csv")
    made = load(path)
    assert made.drives is not None
    assert made.drives.loads[1].values[0] == pytest.approx(CRATE[0], rel=0.02)
    assert "Gains" not in str(made.drives.tables()[0])


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('payload = "crate"', 'payload = "crates"', "did you mean 'crate'"),
        ('payload = "crate"', "payload = true", "name every load"),
        ("[loads.crate]", "[loads.unknown]", "choose another name"),
        ("mass = 1.5\n", "mass = -1.5\n", "loads.tool.mass"),
        ("centre = [0.1, -0.02, 0.0]\n", "", "state its centre"),
        ("centre = [0.1, -0.02, 0.0]", "center = [0.1, -0.02, 0.0]", "did you mean 'centre'"),
        ("[loads.crate]", '[loads.crate]\nlink = "upper"', "moves no link 'upper'"),
        ('torque_unit = "A"', 'torque_unit = "Nm"', "torque_unit"),
        ('torque_unit = "A"', "drive_gains = { elbow = 2.0 }", 'state torque_unit = "A"'),
        ('torque_unit = "A"', 'torque_unit = "A"\ndrive_gains = { wrist = 2.0 }', "no joint"),
        ('use = "test"\npayload = "tool"', 'use = "test"\npayload = { mass = 2.0 }', "train with"),
    ],
)
def test_what_cannot_be_is_refused_with_the_remedy(study, old: str, new: str, what: str) -> None:
    with pytest.raises(StudyError, match=what):
        study(edited((old, new), text=STUDY))


def test_payload_weighs_the_loads_that_are_not_known(tmp_path: Path) -> None:
    path = written(tmp_path)
    done = CliRunner().invoke(commands, ["payload", str(path), "--json"])
    assert done.exit_code == 0, done.output
    crate = json.loads(done.stdout)["loads"][1]
    assert crate["mass"] == pytest.approx(CRATE[0], rel=0.02)
    # A motion in a plane shows one moment of inertia, and no centre across the plane.
    assert crate["consistent"] is None and "not judged" in crate["verdict"]
    nothing = edited(
        ("[loads.crate]\n", ""),
        ('file = "crate.csv"\npayload = "crate"', 'file = "crate.csv"\nuse = "test"'),
        text=STUDY,
    )
    path.write_text(nothing)
    done = CliRunner().invoke(commands, ["payload", str(path)])
    assert done.exit_code != 0 and "[loads.crate]" in str(done.exception)


def test_links_are_trusted_by_their_names(tmp_path: Path) -> None:
    plain = STUDY.partition("[loads.tool]")[0] + '[[recordings]]\nfile = "empty.csv"\n'
    text = plain.replace('torque_unit = "A"', 'torque_unit = "A"\ntrusted = ["forearm"]')
    path = written(tmp_path)
    path.write_text(text)
    links = [link.name for link in arm().links]
    with pytest.raises(StudyError, match="no moving link 'forearm'"):
        load(path)
    path.write_text(text.replace("forearm", links[-1]))
    drives = load(path).drives
    assert drives is not None and not drives.is_scaled
    path.write_text(text.replace('torque_unit = "A"\n', "").replace("forearm", links[-1]))
    with pytest.raises(StudyError, match="trusted links, and torques in N m"):
        load(path)


@pytest.mark.parametrize("unit", ["A", "%"])
@pytest.mark.slow
def test_torques_and_noise_are_said_in_the_unit_of_the_drives(tmp_path: Path, unit: str) -> None:
    path = written(tmp_path, STUDY.replace('"A"', f'"{unit}"'))
    current, _ = recorded(4, "tool")
    for command in ("diagnose", "compare"):
        found = json.loads(CliRunner().invoke(commands, [command, str(path), "--json"]).stdout)
        for joint in found["joints"]:
            assert joint["torque_unit"] == unit
            # Stated of a raw sample; the low-pass leaves less than half of it.
            assert 0.003 < joint["noise_rms"] < 0.02
            assert joint["torque_rms"] < 2 * np.abs(current.tau).max()
    shown = CliRunner().invoke(commands, ["fit", str(path)]).stdout
    assert f" {unit} " in shown.partition("Load")[0]
