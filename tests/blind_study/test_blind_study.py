"""The blind study in small: cases drawn, made, asked about, judged."""

from __future__ import annotations

import json
import signal
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from blind_study.cases import BLOCK, SHARES, draw
from blind_study.command import answered, main
from blind_study.experiments import SensorError
from blind_study.foreign import EFFECTS, FOREIGN
from blind_study.judge import judge, same
from blind_study.make import Size, make, unavailable
from blind_study.rate import Rate
from blind_study.report import summary
from blind_study.robots import specimen
from blind_study.strengths import KNOWN, start
from blind_study.table import figures, load
from blind_study.worker import Place, explain
from dynident.effects import catalogue
from dynident.fitting import fit
from dynident.study import load as load_study

TINY = Size(rate_of_two=200.0, rate_of_many=200.0, runs=2, tests=1)


def test_cases_are_drawn_by_the_block_and_stay_as_they_are() -> None:
    cases = draw(3, 120)
    assert [c.number for c in cases] == list(range(120))
    assert draw(3, 5, first=100) == cases[100:105]
    assert Counter(c.kind for c in cases[:BLOCK]) == SHARES
    assert draw(4, 1) != cases[:1]
    assert json.loads(json.dumps(cases[0].to_dict()))["seed"] == 3


ALONE = {name: kind for name, kind in catalogue().items() if not kind.requires}
"""Effects that make a torque without another one."""


def test_every_effect_comes_up_and_none_that_is_foreign_is_known() -> None:
    hidden = Counter(h.effect for c in draw(1, 300) if c.kind == "known" for h in c.hidden)
    assert set(hidden) == set(KNOWN)
    assert len(KNOWN) == 22
    assert max(hidden.values()) - min(hidden.values()) <= 3
    assert set(ALONE) <= set(KNOWN)
    assert not set(FOREIGN) & set(catalogue())
    two = [c.hidden for c in draw(1, 300) if c.kind == "two"]
    assert all(a.effect != b.effect for a, b in two)


@pytest.mark.parametrize("joints", [2, 6, 7])
def test_robots_exist_and_their_first_values_fit_the_effects(joints: int) -> None:
    rng = np.random.default_rng(joints)
    made = specimen(joints, 250.0, rng)
    assert made.robot.n == made.nominal.n == joints
    assert (made.inertia > 0).all()
    assert np.abs(made.robot.theta - made.nominal.theta).max() > 0
    places = {"joint": (True, False), "pair": (True, True), "robot": (False, False)}
    for name, kind in {**ALONE, **EFFECTS}.items():
        begin = start(name, made, 1, 0, rng, 0.01)
        joint, source = places.get(kind.place, (True, False))
        names = made.robot.names
        effect = kind(names[1] if joint else None, names[0] if source else None, begin.shape)
        checked = effect.on(made.robot)
        assert len(begin.values) == len(checked.parameters(made.robot))
        assert begin.most > 1


@pytest.mark.slow
def test_what_is_hidden_is_scaled_to_its_ratio_and_stays_out_of_the_data(tmp_path: Path) -> None:
    case = next(c for c in draw(0, 300) if c.joints == 2 and _hides(c, "joint_spring"))
    truth = make(case, tmp_path, TINY)
    assert 0.4 < truth["ratio"] / case.hidden[0].ratio < 2.5
    written = sorted(p.name for p in tmp_path.iterdir())
    assert written == ["robot.urdf", "run1.npz", "run2.npz", "run3.npz", "study.toml"]
    text = (tmp_path / "study.toml").read_text()
    assert "spring" not in text and str(case.seed) not in written
    study = load_study(tmp_path / "study.toml")
    assert study.model.friction_width == case.stated_width
    assert [r.start for r in (study.train + study.test).recordings] == [0.0, 120.0, 240.0]
    assert fit(study.model, study.train).values.size


def _hides(case, effect: str) -> bool:
    return case.kind == "known" and case.hidden[0].effect == effect and not unavailable(case)


@pytest.mark.slow
def test_a_study_is_run_judged_and_goes_on_where_it_stopped(tmp_path: Path, capfd) -> None:
    cases = [c for c in draw(0, 100) if c.joints == 2 and c.kind == "healthy"]
    numbers = [str(c.number) for c in cases[:2]]
    ask = ["run", "--out", str(tmp_path), "--count", "100", "--jobs", "1"]
    ask += ["--rates", "200", "200", "--runs", "1", "1"]
    main([*ask, "--numbers", *numbers[:1]])
    first = (tmp_path / "answers.jsonl").read_text()
    main([*ask, "--numbers", *numbers])
    both = (tmp_path / "answers.jsonl").read_text()
    assert both.startswith(first) and both.count("\n") == 2
    judged, skipped = load(tmp_path)
    assert [j.name for j in judged] == sorted(c.name for c in cases[:2])
    assert not skipped
    assert not any(j.broken for j in judged)
    assert {j.kind for j in judged} == {"healthy"}
    assert not list((tmp_path / "data").iterdir())
    assert "Figures" in capfd.readouterr().out
    assert answered_names(tmp_path) == {j.name for j in judged}


def answered_names(folder: Path) -> set[str]:
    return answered(Place(folder))


def test_what_has_no_answer_in_time_is_stopped_and_counted_as_not_answered(monkeypatch) -> None:
    def endless(_: list[str]) -> None:
        while True:
            with suppress(Exception):
                time.sleep(0.01)

    monkeypatch.setattr("dynident.cli.main", endless)
    before = signal.getsignal(signal.SIGALRM)
    said = explain(Path("study.toml"), 0.05)
    assert said["error"] == "no answer within 0.05 s" and "answer" not in said
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    late = judge(_truth("joint_spring", "a"), {"name": "x", **said})
    assert late.broken == said["error"] and not late.right
    for rates in (figures([late]), summary([late])):
        (unanswered,) = [one for one in rates if one.what == "cases without an answer"]
        assert unanswered.held == [True]


def _truth(effect: str, joint: str | None, kind: str = "known", ratio: float = 3.0) -> dict:
    case = {"kind": kind, "joints": 2, "width": 0.01, "stated_width": 0.01}
    hidden = [{"effect": effect, "joint": joint, "source": None, "ratio": ratio}]
    return {"case": case, "joints": ["a", "b"], "planar": True, "hidden": hidden, "ratio": ratio}


def _said(verdict: str, *steps: dict, candidates: tuple = ()) -> dict:
    error = {"before": 0.1, "after": 0.0505, "noise_floor": 0.05}
    answer = {
        "verdict": verdict, "steps": steps, "candidates": candidates, "test_error": error
    }  # fmt: skip
    return {"name": "x", "cpu_s": 1.0, "answer": answer}


def _step(effect: str, joint: str | None, *others: dict) -> dict:
    return {"effect": effect, "joint": joint, "source": None, "indistinguishable": others}


def test_an_answer_is_right_where_the_truth_is_first_or_in_its_set() -> None:
    truth = _truth("joint_spring", "a")
    exact = judge(truth, _said("explained", _step("joint_spring", "a")))
    assert exact.exact and exact.right and exact.in_set and exact.in_three
    assert exact.over_floor == pytest.approx(1.01)
    within = judge(
        truth, _said("explained", _step("torque_ripple", "a", _step("joint_spring", "a")))
    )
    assert not within.exact and within.right and within.size == 2
    elsewhere = judge(truth, _said("explained", _step("joint_spring", "b")))
    assert not elsewhere.right
    later = {"effect": "joint_spring", "joint": "a", "source": None, "status": "material"}
    third = judge(truth, _said("explained", _step("joint_spring", "b"), candidates=(later,)))
    assert not third.right and third.in_three
    nothing = judge(truth, {"name": "x", "cpu_s": 1.0, "error": "error: no"})
    assert nothing.broken and not nothing.right


def test_declared_equivalence_holds_on_the_robots_it_is_declared_for() -> None:
    tilt, zero = ("base_tilt", None, None), ("joint_zero", "a", None)
    assert same(tilt, zero, ["a", "b"], planar=True)
    assert not same(tilt, zero, ["a", "b"], planar=False)
    assert not same(tilt, ("joint_zero", "b", None), ["a", "b"], planar=True)
    offset = ("torque_offset", "a", None)
    assert not same(offset, ("asymmetric_friction", "b", None), ["a", "b"], planar=True)


def test_foreign_laws_are_to_be_refused_and_absorbed_ones_listed() -> None:
    strange = judge(_truth("speed_product", "a", "foreign"), _said("unexplained"))
    assert strange.rejected
    bristles = _truth("lugre_friction", "a", "foreign")
    assert judge(bristles, _said("explained", _step("presliding", "a"))).rejected
    assert not judge(bristles, _said("explained", _step("presliding", "b"))).rejected
    listed = {"effect": "joint_zero", "joint": "b", "source": None, "status": "absorbed"}
    hidden = _truth("joint_zero", "b", "absorbed")
    one = judge(hidden, _said("nothing_missing", candidates=(listed,)))
    assert one.absorbed and not one.alarm
    rates = {rate.what: rate for rate in figures([strange, one])}
    assert rates["effects that are not identifiable reported as such"].held == [True]


def test_rates_come_with_their_interval_and_what_is_demanded() -> None:
    _, value, interval, demand, met = Rate("x", [True] * 19 + [False], 0.9).row()
    assert (value, demand, met) == ("19/20 = 0.950", "at least 0.9", "yes")
    assert interval == "0.764 .. 0.991"
    assert Rate("x", [True], 0.05, at_most=True).row()[-1] == "NO"


def test_the_lugre_state_settles_at_the_stribeck_curve() -> None:
    from dynident.effects import Block

    effect = EFFECTS["lugre_friction"]("j", None, (0.01, 0.5, 0.1))
    v = np.array([[0.05], [-0.2], [3.0]])
    level = (1 + 0.5 * np.exp(-((v / 0.1) ** 2))) * np.sign(v)
    still = np.zeros((3, 1))
    block = Block(still[:, 0], still, v, still, names=("j",), memory=level)
    np.testing.assert_allclose(effect.simulated_rate((2.0,), block), 0.0, atol=1e-12)
    np.testing.assert_allclose(effect.simulated_force((2.0,), block), 2.0 * level)
    assert SensorError("cubic_sensor_error", 0, 0.1).size == 0.1
