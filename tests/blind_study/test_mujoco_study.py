"""The blind study on MuJoCo in small: cases, settings of [filter], answers, report."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import tomlkit

from blind_study.cases import BLOCK, draw
from blind_study.circumstances import JOINTS, draw_mujoco
from blind_study.command import main
from blind_study.filters import FILTERS, setting, state
from blind_study.judge import Judged, judge
from blind_study.make import Size, make
from blind_study.report import groups, summary
from dynident.recording import Filter
from dynident.study import load as load_study


def test_half_of_the_cases_of_each_kind_have_the_constraints_friction() -> None:
    cases = draw_mujoco(50000, BLOCK)
    assert draw_mujoco(50000, 4, first=30) == cases[30:34]
    assert Counter(case.joints for case in cases) == JOINTS
    tight = [case for case in cases if case.circumstances.friction == "constraint"]
    assert abs(len(tight) - BLOCK / 2) <= 3
    healthy = Counter(c.circumstances.friction for c in cases if c.kind == "healthy")
    assert healthy["tanh"] == healthy["constraint"] == 15
    assert {case.circumstances.rate_hz for case in cases} >= {200.0, 5000.0}
    for case in cases:
        if any(one.effect == "contact" for one in case.hidden):
            assert case.circumstances.repetition == "stated"
    assert json.loads(json.dumps(cases[0].to_dict()))["circumstances"]


def test_the_cases_of_the_own_simulator_stay_what_they_were() -> None:
    cases = draw(30000, 3)
    assert [case.name for case in cases] == [
        "case_30000_0000",
        "case_30000_0001",
        "case_30000_0002",
    ]
    assert [case.width for case in cases] == pytest.approx(WIDTHS)
    emptied = cases[1].healthy()
    assert emptied.kind == "healthy" and not emptied.hidden
    assert emptied.name == "case_30000_0001_healthy"


WIDTHS = [0.011811539612326054, 0.020728995458892497, 0.010046416666642154]


@pytest.mark.parametrize("rate", [200.0, 250.0, 5000.0])
def test_settings_of_filter_suit_every_sampling_rate(rate: float, tmp_path: Path) -> None:
    assert len(FILTERS) == 6
    study = tmp_path / "study.toml"
    study.write_text('robot = "robot.urdf"\n[[recordings]]\nfile = "run1.npz"\n')
    for name in FILTERS:
        said = setting(name, rate)
        made = Filter(**said)  # type: ignore[arg-type]
        assert made.cutoff_hz is None or made.cutoff_hz < rate / 2
        state(study, name, rate)
        assert tomlkit.parse(study.read_text()).unwrap().get("filter", {}) == said
    assert "recordings" in study.read_text()


@pytest.mark.slow
def test_records_of_a_case_are_cut_out_of_motion_and_say_nothing_of_it(tmp_path: Path) -> None:
    case = next(
        c
        for c in draw_mujoco(50000, 100)
        if c.joints == 2
        and c.kind == "healthy"
        and c.circumstances.rate_hz <= 500
        and c.circumstances.repetition == "none"
    )
    truth = make(case, tmp_path, Size(runs=1, tests=1, repetitions=1))
    assert truth["rate_hz"] == case.circumstances.rate_hz
    study = load_study(tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text()
    assert "period" not in text and "mujoco" not in text.lower()
    for recording in (study.train + study.test).recordings:
        assert recording.period is None
        ends = np.abs(recording.q[[-1, 0]] - recording.q[[-3, 2]]).max(axis=1)
        assert (ends > 1e-4).all()  # rad: it moves where it starts and where it stops


@pytest.mark.slow
def test_a_healthy_robot_in_mujoco_is_found_healthy(tmp_path: Path, capfd) -> None:
    cases = [
        c
        for c in draw_mujoco(50000, 100)
        if c.joints == 2
        and c.kind == "healthy"
        and c.circumstances.friction == "tanh"
        and c.circumstances.rate_hz <= 500  # most of the time goes into steps of MuJoCo
        and c.width == c.stated_width
    ]
    ask = ["run", "--plant", "mujoco", "--seed", "50000", "--count", "100", "--jobs", "1"]
    ask += ["--runs", "1", "1"]
    ask += ["--out", str(tmp_path), "--numbers", str(cases[0].number), "--filter", "both"]
    main(ask)
    (line,) = (tmp_path / "answers.jsonl").read_text().splitlines()
    said = json.loads(line)
    assert said["name"] == f"{cases[0].name}:both" and said["filter"] == "both"
    assert said["answer"]["verdict"] == "nothing_missing"
    assert "contact named on healthy robots" in capfd.readouterr().out
    main(ask)  # it is not asked again
    assert len((tmp_path / "answers.jsonl").read_text().splitlines()) == 1


def _judged(kind: str, *added: str, after: float = 0.05, also: tuple = ()) -> Judged:
    circumstances = {"friction": "constraint"}
    case = {
        "kind": kind, "joints": 2, "width": 0.0, "stated_width": 0.01,
        "circumstances": circumstances,
    }  # fmt: skip
    place = {"effect": "joint_coupling", "joint": "a", "source": "b"}
    hidden = [] if kind == "healthy" else [{**place, "ratio": 3.0}]
    truth = {
        "case": case, "joints": ["a", "b"], "planar": True, "hidden": hidden, "ratio": 3.0,
        "also": also,
    }  # fmt: skip
    steps = [{"effect": one, "joint": "b", "source": "a", "indistinguishable": ()} for one in added]
    error = {"before": 0.1, "after": after, "noise_floor": None}
    answer = {"verdict": "explained", "steps": steps, "candidates": (), "test_error": error}
    return judge(truth, {"name": "x", "cpu_s": 1.0, "answer": answer, "filter": "slow"})


def test_a_tendon_couples_both_ways_and_both_are_right() -> None:
    other = {"effect": "joint_coupling", "joint": "b", "source": "a"}
    assert _judged("known", "joint_coupling", also=(other,)).right
    assert not _judged("known", "joint_coupling").right


def test_the_report_counts_what_is_claimed_without_reason() -> None:
    judged = [_judged("healthy", "contact"), _judged("known", "joint_spring", after=0.2)]
    rates = {rate.what: rate.held for rate in summary(judged)}
    assert rates["false alarms on healthy robots"] == [True]
    assert rates["contact named on healthy robots"] == [True]
    assert rates["payload named on healthy robots"] == [False]
    assert rates["held-out error after above before"] == [False, True]
    assert rates["first suggestion right, ratio above 2"] == [False]
    assert groups([*judged, judge_own()])["filter slow"] == judged


def judge_own() -> Judged:
    case = {"kind": "healthy", "joints": 2, "width": 0.01, "stated_width": 0.01}
    truth = {"case": case, "joints": ["a", "b"], "planar": True, "hidden": [], "ratio": 0.0}
    return judge(truth, {"name": "y", "cpu_s": 1.0, "error": "no"})
