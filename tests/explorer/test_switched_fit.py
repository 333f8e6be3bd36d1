"""What the page shows is what the functions say: fits, errors, choices, and what is written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynident as di
import standing_arm
from dynident.diagnosis import Diagnosis
from dynident.effects import Law
from dynident.errors import StudyError
from dynident.evidence import compare_models
from dynident.explorer.effect_choices import MOST_OTHERS, EffectChoice, effect_choices
from dynident.explorer.opened_study import OpenedStudy, StudyVersions
from dynident.explorer.search_thread import SearchThread
from dynident.explorer.switched_fit import Refitter
from dynident.fitting.reversals.misplaced_reversals import fitted_without
from dynident.recording import Dataset
from dynident.study import study_digest
from study_files import STUDY, edited, write_study

HIDDEN = "coulomb_friction@elbow"
DRAG = "quadratic_drag@elbow"


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> di.Study:
    return di.load(write_study(tmp_path_factory.mktemp("study")))


@pytest.fixture(scope="module")
def diagnosis(study) -> Diagnosis:
    return di.diagnose(study.model, study.train, study.test)


@pytest.fixture(scope="module")
def refitter(study) -> Refitter:
    return Refitter(study)


@pytest.mark.parametrize(
    "labels", [(), (HIDDEN,), (DRAG, HIDDEN), ("load_friction@elbow",), ("payload",)]
)
def test_a_switch_fits_as_fit_does(refitter, study, labels):
    """Columns from the motion alone, and those that depend on the fit."""
    model = study.model
    for label in labels:
        model = model + label
    fast = refitter.fit(model.effects[len(study.model.effects) :])
    slow = di.fit(model, study.train)
    same = dict(zip(slow.names, slow.values, strict=True))
    found = dict(zip(fast.model.names, fast.estimate.values, strict=True))
    assert found.keys() == same.keys()
    for name, value in same.items():
        assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-9)
    compared = di.compare(slow, study.test).results[0]
    np.testing.assert_allclose(fast.judged.joint_errors, compared.joint_errors, rtol=1e-9)
    assert fast.judged.error == pytest.approx(compared.error, rel=1e-9)
    assert fast.judged.floor == pytest.approx(compared.floor, rel=1e-9)


def test_intervals_are_those_of_fit(refitter, study):
    effects = di.effects_of(HIDDEN, study.robot)
    found = refitter.with_intervals(effects)
    wanted = di.fit(study.model + effects, study.train)
    np.testing.assert_allclose(found.values, wanted.values, rtol=1e-9)
    np.testing.assert_allclose(found.sigma, wanted.sigma, rtol=1e-9)


def test_a_shape_is_kept_and_its_uncertainty_counts(study):
    """Of an effect that the data hold: what a shape does to one that they lack is noise."""

    def falling(one: di.Recording) -> di.Recording:
        v = np.gradient(one.q, one.t, axis=0)
        more = np.tanh(v / 0.01) * np.exp(-((v / 0.3) ** 2))
        return replace(one, tau=one.tau + more * [0.0, 0.5])

    train = replace(study.train, recordings=tuple(falling(r) for r in study.train.recordings))
    (stribeck,) = di.effects_of("stribeck_friction@elbow", study.robot)
    stribeck = stribeck.shaped(0.3)
    (dry,) = di.effects_of(HIDDEN, study.robot)  # the rest is complete, or misfit is all there is
    found = Refitter(replace(study, train=train)).with_intervals([stribeck, dry])
    model = study.model + dry + stribeck
    fixed, _ = fitted_without(lambda data: di.LeastSquares().fit(model, data), train)
    assert found.model.effects[-1].shape == (0.3,)
    np.testing.assert_allclose(found.values, fixed.values, rtol=1e-9)
    at = found.names.index("Fc@elbow")  # what a wider spike takes from dry friction
    assert found.shapes[-1].sigma > 0 and found.sigma[at] > 1.2 * fixed.sigma[at]


def test_the_order_of_switches_does_not_matter(refitter, study):
    one, two = (di.effects_of(label, study.robot)[0] for label in (HIDDEN, DRAG))
    assert refitter.fit([one, two]) is refitter.fit([two, one])


def test_without_test_recordings_blocks_of_time_are_held_out(tmp_path):
    study = di.load(write_study(tmp_path, edited(('use = "test"', 'use = "train"'))))
    models = {"given": study.model, "wider": study.model + HIDDEN}
    compared = compare_models(models, study.train, study.test)
    refitter = Refitter(study)
    found = [refitter.fit(), refitter.fit(di.effects_of(HIDDEN, study.robot))]
    for one, other in zip(found, compared.results, strict=True):
        np.testing.assert_allclose(one.judged.joint_errors, other.joint_errors, rtol=1e-9)


def test_impossible_values_are_told(refitter, study):
    elbow, drag = (di.effects_of(one, study.robot) for one in (HIDDEN, DRAG))
    assert refitter.impossible(refitter.with_intervals(elbow)) == ()
    said = refitter.impossible(refitter.with_intervals(drag))  # stands in for dry friction
    assert any(one.startswith("Fq = -") and "elbow" in one for one in said)


@pytest.mark.slow
def test_what_is_missing_is_offered_first(diagnosis, study):
    choices = effect_choices(diagnosis, study)
    assert (choices[0].label, choices[0].group, choices[0].refusal) == (HIDDEN, "added", "")
    assert len({one.label for one in choices}) == len(choices)
    assert not any(one.effect in study.model for one in choices)
    assert sum(one.group == "others" for one in choices) <= MOST_OTHERS


@pytest.mark.slow
def test_what_cannot_be_switched_on_says_why(diagnosis, study):
    candidates = [one for one in diagnosis.candidates if one.effect.name == "contact"]
    only = replace(diagnosis, steps=(), candidates=tuple(candidates))
    offered = effect_choices(only, study)
    assert offered and all("happened once" in one.refusal for one in offered)
    payload = [one for one in diagnosis.candidates if one.effect.is_payload]
    only = replace(diagnosis, steps=(), candidates=tuple(payload))
    assert ["payload = true" in one.refusal for one in effect_choices(only, study)] == [True]


def test_a_diagnosis_that_fails_says_why(study):
    def fail(study, progress):
        raise StudyError("no good", "study.toml", "write another")

    search = SearchThread(study, diagnose=fail)
    search.wait(60)
    assert not search.is_running and "no good" in search.failure and search.diagnosis is None


def test_a_diagnosis_is_stopped_where_it_next_speaks(study):
    search = SearchThread(study, diagnose=lambda study, progress: _for_ever(progress))
    search.stop()
    search.wait(60)
    assert not search.is_running and search.failure == "stopped"


def _for_ever(progress):
    while True:
        progress("going on")


def versions(path: Path, diagnosis: Diagnosis) -> StudyVersions:
    first = OpenedStudy(di.load(path), diagnosis)
    return StudyVersions(path, lambda: di.load(path), first)


def test_what_is_switched_on_is_written(tmp_path, diagnosis):
    path = write_study(tmp_path)
    opened = versions(path, diagnosis)
    first = opened.latest()
    digest = opened.write(first.chosen([HIDDEN]), first.digest, "a tab")
    assert path.read_text() == edited(
        ('["viscous_friction"]', f'["viscous_friction", "{HIDDEN}"]'), text=STUDY
    )
    second = opened.latest()
    assert second.digest == digest != first.digest and opened.of(first.digest) is first
    assert HIDDEN in second.study.model
    opened.stop()


def test_a_study_that_has_changed_is_left_alone(tmp_path, diagnosis):
    path = write_study(tmp_path)
    opened = versions(path, diagnosis)
    first = opened.latest()
    path.write_text(STUDY + "# mine\n")
    with pytest.raises(StudyError, match="has changed since it was read"):
        opened.write(first.chosen([HIDDEN]), first.digest, "a tab")
    assert path.read_text() == STUDY + "# mine\n"


def test_what_a_tab_asks_twice_is_written_once_and_answered_alike(tmp_path, diagnosis):
    path = write_study(tmp_path)
    opened = versions(path, diagnosis)
    first = opened.latest()
    chosen = first.chosen([HIDDEN])
    answers = [opened.write(chosen, first.digest, "a tab") for _ in range(2)]
    assert answers[0] == answers[1] == study_digest(path)
    with pytest.raises(StudyError, match="has changed since it was read"):
        opened.write(chosen, first.digest, "another tab")


def test_labels_that_nobody_offered_choose_nothing(tmp_path, diagnosis):
    opened = versions(write_study(tmp_path), diagnosis).latest()
    assert opened.chosen(["../../etc/passwd", "payload", HIDDEN]) == opened.choices[:1]


def test_a_law_is_written_with_its_formula(tmp_path, diagnosis, study):
    path = write_study(tmp_path)
    opened = versions(path, diagnosis)
    law = Law(name="drum", torque="c*v*sin(q)")
    (effect,) = di.effects_of("law:drum@elbow", study.robot, (law,))
    choice = EffectChoice(effect=effect, group="proposed", words="", laws=(law,))
    opened.write([choice], opened.latest().digest, "a tab")
    assert "law:drum@elbow" in [one.label for one in di.load(path).model.effects]
    fitted = Refitter(study).fit([effect])
    wanted = di.fit(study.model + effect, study.train)
    np.testing.assert_allclose(fitted.estimate.values, wanted.values, rtol=1e-9)


def test_of_a_joint_that_stands_a_switch_counts_the_rows_that_a_fit_does(study):
    model = standing_arm.given().with_friction_width("elbow", 1e-3)
    train = Dataset(tuple(standing_arm.record(k, standing_arm.STOPPED) for k in range(2)))
    stands = replace(study, model=model, train=train, test=Dataset(()))
    quick, slow = Refitter(stands).fit().estimate, di.fit(model, train)
    np.testing.assert_allclose(quick.values, slow.values, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(quick.joint_errors, slow.joint_errors, rtol=1e-6)
    dry = next(one for one in model.effects if one.label == "coulomb_friction@elbow")
    later = Refitter(stands, model - dry).with_intervals([dry])
    assert later.value("Fc@elbow") == pytest.approx(slow.value("Fc@elbow"), rel=1e-6)
