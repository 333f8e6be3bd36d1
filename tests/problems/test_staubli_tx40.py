"""The Staubli TX40: what couples its wrist is found, and nothing that raises the held-out error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident import LeastSquares, compare, diagnose, effects_of, fit
from dynident.data_files import find_data
from dynident.diagnosis import Diagnosis
from dynident.errors import FileError
from dynident.explorer.switched_fit import Refitter
from dynident.study import Study, load
from dynident.study_draft import LogFacts, StudyDraft, draft_study

STUDY = Path(__file__).parents[2] / "problems" / "staubli_tx40" / "study.toml"
WRIST = "motor_position[5]/32 - motor_position[4]/45"


@pytest.fixture(scope="module")
def study() -> Study:
    try:
        find_data("staubli_tx40/recording.npz", STUDY.parent)
    except FileError as missing:
        pytest.skip(str(missing))
    return load(STUDY)


def test_columns_are_those_of_the_joints(study: Study) -> None:
    """q = R^-1 q_m with the zeros moved, tau = R^T c: power is the same on either side."""
    file = find_data("staubli_tx40/recording.npz", STUDY.parent)
    data = np.load(file)
    motors, currents = data["motor_position"], data["motor_torque"]
    gears = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    gears[5, 4] = 32.0
    recording = study.train.recordings[0]
    zeros = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
    expected = np.linalg.solve(gears, motors.T).T + zeros
    np.testing.assert_allclose(recording.q, expected, atol=1e-12)
    np.testing.assert_allclose(recording.tau, currents @ gears, atol=1e-9)


@pytest.fixture(scope="module")
def drafted(study: Study, tmp_path_factory: pytest.TempPathFactory) -> tuple[StudyDraft, Study]:
    """What `dynident init` makes of the raw columns, the ratios, and the answer to its question."""
    draft = _draft({"q.joint6": WRIST})
    return draft, load(draft.write(tmp_path_factory.mktemp("tx40") / "study.toml"))


def _draft(columns: dict[str, str]) -> StudyDraft:
    data = find_data("staubli_tx40/recording.npz", STUDY.parent)
    facts = LogFacts(gears=[32, 32, 45, -48, 45, 32], columns=columns)
    return draft_study(STUDY.with_name("tx40.urdf"), [data], facts=facts)


@pytest.mark.slow
def test_ratios_alone_leave_the_wrist_an_open_question(study: Study) -> None:
    """The torques do not tell of the coupling, and limits of speed alone change nothing."""
    draft = _draft({})
    said = {one.subject: one for one in draft.decisions}
    assert said["coupling"].words == "each motor turns one joint"
    assert said["coupling"].is_open and "limit" in said["coupling"].reason
    assert draft.open_question.endswith(f"--column 'q.joint6 = {WRIST}'")
    assert draft.columns["q.joint6"].name == "motor_position[5]/32"
    assert draft.columns["tau.joint5"].name == "45*motor_torque[4]"


@pytest.mark.slow
def test_a_draft_of_the_raw_columns_has_those_of_the_study_by_hand(
    study: Study, drafted: tuple[StudyDraft, Study]
) -> None:
    draft, loaded = drafted
    by_hand, found = study.train.recordings[0], loaded.train.recordings[0]
    np.testing.assert_allclose(found.q, by_hand.q, atol=1e-12)
    np.testing.assert_allclose(found.tau, by_hand.tau, atol=1e-9)
    said = {one.subject: one for one in draft.decisions}
    assert said["zeros"].words == "moved: joint2 by -90 deg, joint3 by +90 deg"
    assert "coupling" not in said and not draft.open_question


def test_every_fourth_half_second_is_to_judge_by(study: Study) -> None:
    train, test = ([one.window for one in part.recordings] for part in (study.train, study.test))
    assert test == [(1.5, 2.0), (3.5, 4.0), (5.5, 6.0)]
    assert len(train) == 12 and not set(train) & set(test)


@pytest.fixture(scope="module")
def found(study: Study) -> Diagnosis:
    return diagnose(study.model, study.train, study.test, propose="never")


@pytest.mark.slow
def test_both_directions_of_the_wrist_coupling_come_first(found: Diagnosis) -> None:
    first = {step.effect.label for step in found.steps[:2]}
    assert first == {"joint_coupling@joint5:joint6", "joint_coupling@joint6:joint5"}
    assert found.test_error.before > 0.10
    assert found.steps[1].test_error_after <= 0.06


@pytest.mark.slow
def test_the_pages_have_the_figures_of_a_run(found: Diagnosis) -> None:
    here = STUDY.with_name("README.md").read_text(encoding="utf-8")
    for step in found.steps:
        before, after = (100 * x for x in (step.test_error_before, step.test_error_after))
        assert f"| {before:.2f} % | {after:.2f} % |" in here, step.effect.label
    ends = f"{100 * found.test_error.before:.2f} to {100 * found.test_error.after:.2f} %"
    for page in (STUDY.parents[2] / "README.md", STUDY.parents[2] / "docs/howto/coupled_motors.md"):
        assert ends in page.read_text(encoding="utf-8"), page.name


@pytest.mark.slow
def test_the_error_falls_to_the_published_one_and_never_rises(found: Diagnosis) -> None:
    assert found.test_error.after <= 0.053
    assert all(step.test_error_after <= step.test_error_before for step in found.steps)
    wrist = {one.name: one.error_after for one in found.joints}
    assert wrist["joint5"] < 0.12 and wrist["joint6"] < 0.12
    assert found.wiring == () and not any("payload" in s.effect.label for s in found.steps)


@pytest.mark.slow
def test_six_joints_are_refitted_on_the_page_as_by_fit(study: Study) -> None:
    """Nothing repeats; the coupled wrist switched on, as `dynident open` does it."""
    couplings = ("joint_coupling@joint5:joint6", "joint_coupling@joint6:joint5")
    effects = [effects_of(label, study.robot)[0] for label in couplings]
    refitter = Refitter(study)
    now = refitter.fit(effects)
    wanted = fit(now.model, study.train, LeastSquares(errors="independent"))
    np.testing.assert_allclose(now.estimate.values, wanted.values, rtol=1e-9, atol=1e-9)
    errors = compare(wanted, study.test).results[0].joint_errors
    np.testing.assert_allclose(now.judged.joint_errors, errors, rtol=1e-9)
    assert now.judged.error < 0.6 * refitter.fit().judged.error
