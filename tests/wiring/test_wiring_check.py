"""Columns that are not what they are called: named where they are, silence where they are not."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomlkit

import dynident as di
from dynident.cli import main
from dynident.recording import Dataset, Recording, write
from dynident.wiring import check_wiring
from standing_arm import given, record
from study_files import edited, recording, true_model, write_study
from synthetic import ARM, smooth_motion, true_values
from wiring_faults import Injected, broken, column_faults, data_faults

FAULTS = [*column_faults(2), *data_faults(2)]
NAMES = [f"{one.kind[0]} {one.joints}" for one in FAULTS]


@cache
def data() -> Dataset:
    return Dataset((recording(0), recording(1)))


@pytest.mark.parametrize("fault", FAULTS, ids=NAMES)
def test_every_single_fault_is_named(fault: Injected) -> None:
    found = check_wiring(true_model(), broken(data(), fault.change))
    assert fault.is_named(found, true_model().robot.names), found


def test_nothing_is_said_where_nothing_is_wrong() -> None:
    assert check_wiring(true_model(), data(), Dataset((recording(2),))) == ()


@pytest.mark.parametrize("fault", [one for one in FAULTS if "sign" in one.kind[0]])
def test_signs_are_told_though_a_joint_stands_where_it_is_slow(fault: Injected) -> None:
    """While it stands its dry friction is as others ask, and no fit of all rows tells a sign."""
    sticks = Dataset(tuple(record(seed, 0.6) for seed in (0, 1)))
    assert check_wiring(given(), sticks) == ()
    assert fault.is_named(check_wiring(given(), broken(sticks, fault.change)), given().robot.names)


def drag(one: Recording) -> np.ndarray:
    """(rad/s)^2 with the sign of the speed."""
    v = np.gradient(one.q, one.t, axis=0)
    return v * np.abs(v)


@pytest.mark.slow
def test_missing_physics_is_no_fault() -> None:
    """Large effects that the model lacks: springs, drag, a delay, another gain."""
    for change in (
        lambda r: r.replace(tau=r.tau + 20.0 * r.q),
        lambda r: r.replace(tau=r.tau + np.array([0.0, 20.0]) * drag(r)),
        lambda r: r.replace(tau=r.tau * np.array([1.0, 0.7])),
        lambda r: r.replace(tau=np.roll(r.tau, 1, axis=0)),
        lambda r: r.replace(tau=r.tau + 2.0 * np.sin(7 * r.q)),
        lambda r: r.replace(q=r.q + np.array([0.0, 0.3])),
    ):
        assert check_wiring(true_model(), broken(data(), change)) == ()


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_noise_of_a_joint_at_rest_is_no_position_in_degrees(seed: int) -> None:
    """Any scale that makes it smaller makes its accelerations fit better."""
    model, rng = true_model(), np.random.default_rng(seed)
    t, q, v, a = (np.array(x) for x in smooth_motion(2, seed, 200.0, 16.0, 8.0))
    for x in (q, v, a):
        x[:, 0] = 0.0
    values = true_values(model, Fv__shoulder=2.0, Fv__elbow=1.0, Fc__elbow=1.5)
    tau = model.torque(model.block(t, q, v, a), values)
    q, tau = (x + std * rng.normal(size=x.shape) for x, std in ((q, 1e-3), (tau, 0.05)))
    one = Recording(t, q, tau, model.robot.names, period=8.0, name="shoulder at rest")
    assert check_wiring(model, Dataset((one,))) == ()


@pytest.mark.parametrize(("kind", "faults"), [("continuous", 0), ("revolute", 1)])
def test_how_far_a_continuous_joint_turns_is_no_fault(kind: str, faults: int) -> None:
    """Its torque tells nothing: friction alone, as of a joint about a vertical axis."""
    limits = '<limit lower="-2.5" upper="2.5" velocity="6" effort="200"/>'
    text = ARM.replace(limits, "").replace('rpy="1.5707963267948966 0 0"', "")
    text = text.replace('name="shoulder" type="revolute"', f'name="shoulder" type="{kind}"')
    model = di.Model(di.Robot.from_text(text, joints=["shoulder"]))
    t = np.arange(1600) / 100.0
    q = 1.5 * t + np.sin(2 * t)
    tau = np.random.default_rng(0).standard_normal(len(t))
    found = check_wiring(model, Dataset((Recording(t, q, tau, ("shoulder",)),)))
    assert [fault.kind for fault in found] == ["degrees"] * faults


@pytest.mark.slow
def test_joints_in_another_order_have_the_same_fault() -> None:
    swapped = Dataset(tuple(one.select(("elbow", "shoulder")) for one in data().recordings))
    robot = di.Robot.from_text(true_model().robot.description.text, joints=["elbow", "shoulder"])  # type: ignore[union-attr]
    for fault in column_faults(2):
        if fault.joints == (1,):
            continue  # as of the other joint
        there = check_wiring(di.Model(robot), broken(swapped, fault.change))
        assert fault.is_named(there, robot.names), fault.kind


def test_two_faults_are_both_named() -> None:
    def change(one: Recording) -> Recording:
        tau = one.tau * np.array([-1.0, 1.0])
        return one.replace(q=np.rad2deg(one.q), tau=tau)

    found = check_wiring(true_model(), broken(data(), change))
    assert {fault.kind for fault in found} == {"torque_sign", "degrees"}
    assert found[0].mend == found[1].mend and len(found[0].mend) == 3


def test_random_numbers_are_no_wiring() -> None:
    rng = np.random.default_rng(3)
    t, q, _, _ = smooth_motion(2, 5, 100.0, 16.0, 8.0)
    noise = Recording(t, q, rng.normal(size=q.shape), ("shoulder", "elbow"))
    assert check_wiring(true_model(), Dataset((noise,))) == ()


def test_what_was_fitted_does_not_judge() -> None:
    train, other = data().recordings
    (fault,) = check_wiring(true_model(), Dataset((train,)), Dataset((train, other)))
    assert fault.kind == "same_data" and train.name in fault.what and other.name not in fault.what
    first, second = train.replace(window=(0.0, 8.0)), train.replace(window=(8.0, 16.0))
    assert check_wiring(true_model(), Dataset((first,)), Dataset((second,))) == ()


# --- the line that mends it -----------------------------------------------------------------------


OF_POSITIONS = {"positions_exchanged", "degrees", "motor_side_position"}


def _at_the_elbow(fault: Injected) -> bool:
    return fault.joints == (0, 1) or (fault.joints == (1,) and fault.kind[0] not in OF_POSITIONS)


MAPPED = '\n[columns]\n"tau.elbow" = "current"\n'
MENDED = [
    pytest.param(fault, mapped, id=f"{fault.kind[0]} {fault.joints}{'-mapped' if mapped else ''}")
    for fault in column_faults(2)
    for mapped in ("", MAPPED)
    # What may be said of the column with another name, or of both joints.
    if not mapped or _at_the_elbow(fault)
]


def _study_with(fault: Injected, folder: Path, mapped: str) -> Path:
    """A study whose files have the fault, in names and a scale of their own where asked."""
    path = write_study(folder)
    for k, file in enumerate(("train.csv", "test.csv")):
        write(fault.change(recording(k).replace(q_ref=recording(k).q)), folder / file)
    if mapped:
        for file in ("train.csv", "test.csv"):
            text = (folder / file).read_text()
            (folder / file).write_text(text.replace("tau.elbow", "current", 1))
        path.write_text(path.read_text() + mapped)
    return path


def _mended(path: Path, fault: di.wiring.Fault) -> None:
    """Type the lines where the fault says they go."""
    document = tomlkit.parse(path.read_text())
    lines = tomlkit.parse("\n".join(fault.mend))
    if fault.kind == "period":
        for entry in document["recordings"]:  # type: ignore[union-attr]
            entry["period"] = lines["period"]
    else:
        columns = document.setdefault("columns", tomlkit.table())
        for key, value in lines.items():
            columns[key] = value
    path.write_text(tomlkit.dumps(document))


@pytest.mark.filterwarnings("ignore::dynident.errors.DynidentWarning")
@pytest.mark.parametrize(("fault", "mapped"), MENDED)
@pytest.mark.slow
def test_the_line_mends_it_when_typed(fault: Injected, mapped: str, tmp_path: Path) -> None:
    path = _study_with(fault, tmp_path, mapped)
    study = di.load(path)
    found = check_wiring(study.model, study.train, study.test)
    assert fault.is_named(found, study.robot.names), found
    _mended(path, found[0])
    study = di.load(path)
    if fault.ratio is not None:  # which the mend has about
        assert check_wiring(study.model, study.train, study.test) == ()
    else:  # that of the files without a fault, of which nothing is said when a period is mended
        for made, own in zip(
            (*study.train.recordings, *study.test.recordings), (0, 1), strict=True
        ):
            assert made.tau == pytest.approx(recording(own).tau, rel=1e-6, abs=1e-9)
            assert made.q == pytest.approx(recording(own).q, rel=1e-6, abs=1e-9)


def test_a_period_is_mended_too(tmp_path: Path) -> None:
    path = write_study(tmp_path)
    path.write_text(edited(("period = 8.0", "period = 8.03")))
    study = di.load(path)
    (fault,) = check_wiring(study.model, study.train, study.test)
    assert fault.kind == "period" and fault.mend == ("period = 8.0",)
    _mended(path, fault)
    study = di.load(path)
    assert check_wiring(study.model, study.train, study.test) == ()


# --- in the commands ------------------------------------------------------------------------------

NEGATED = """
[columns]
"tau.shoulder" = { name = "tau.shoulder", scale = -1.0 }
"tau.elbow" = { name = "tau.elbow", scale = -1.0 }
"""


@cache
def negated() -> di.diagnosis.Diagnosis:
    change = next(one.change for one in FAULTS if one.kind == ("torque_signs",))
    train, test = (broken(Dataset((recording(k),)), change) for k in (0, 1))
    return di.diagnose(true_model(), train, test)


@pytest.mark.slow
def test_the_fault_is_the_answer_of_a_diagnosis() -> None:
    """All torques negated fit as well as before: only what the values mean shows it."""
    found = negated()
    assert found.verdict == "unexplained" and found.steps == () and found.confidence == ""
    assert "signs of all torques are wrong" in str(found.tables()[0])
    (said,) = found.to_dict()["wiring"]
    assert said["what"] == "the signs of all torques are wrong" and said["evidence"]


@pytest.mark.slow
def test_the_report_says_it_first(tmp_path: Path) -> None:
    page = di.report(negated(), tmp_path / "report.html").read_text()
    assert page.index("signs of all torques") < page.index("Relative torque error")
    assert "scale = -1.0" in page and "dynident add" not in page


@pytest.mark.parametrize("command", ["fit", "compare"])
def test_other_commands_say_it_too(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_study(tmp_path)
    path.write_text(path.read_text() + NEGATED)
    with pytest.raises(SystemExit) as end:
        main([command, str(path)])
    assert not end.value.code
    out = " ".join(capsys.readouterr().out.split())
    assert "Wiring: the signs of all torques are wrong" in out


@pytest.mark.slow
def test_health_has_an_empty_list() -> None:
    found = di.diagnose(true_model(), Dataset((recording(0),)), Dataset((recording(1),)))
    assert found.to_dict()["wiring"] == [] and found.verdict != "unexplained"
