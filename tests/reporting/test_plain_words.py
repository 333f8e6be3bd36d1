"""What the report tells a reader in words: what to do, how each joint does, how sure values are."""

import json
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest

from dynident.effects import catalogue
from dynident.effects.friction.viscous_friction import ViscousFriction
from dynident.reporting.content import left
from dynident.reporting.glossary import meaning, use_of
from dynident.reporting.headline import headline
from dynident.reporting.intervals import parameter_table, widening_after, widening_before
from dynident.reporting.joint_states import opened, states
from dynident.reporting.next_steps import next_steps
from dynident.reporting.packing import packed
from dynident.reporting.pictures.joint_errors import joint_errors
from reporting.fabricated import diagnosis, effect
from reporting.read_page import unpacked


@pytest.fixture(scope="module")
def found():
    return diagnosis(samples=200)


def rejected(found, *ratios):
    joints = tuple(replace(j, ratio_after=r) for j, r in zip(found.joints, ratios, strict=True))
    return replace(found, verdict="unexplained", joints=joints)


def test_every_effect_of_the_catalogue_is_explained(found):
    assert [
        name for name, kind in catalogue().items() if "shows as" in meaning(kind("elbow"))
    ] == []
    assert all(use_of(one.against) for one in found.maps)


def test_an_effect_of_ones_own_is_explained_by_what_it_looks_like():
    class Own(ViscousFriction):
        name = "my_effect"

    assert meaning(Own("elbow")) == f"it shows as {Own.sign_of}"


def test_what_to_do_names_commands_and_the_experiment_that_separates(found):
    add, separate, not_identifiable = next_steps(found)
    assert add.commands == ("dynident add STUDY stribeck_friction@elbow", "dynident fit STUDY")
    assert "asymmetric friction at elbow" in separate.what
    assert separate.commands == ("dynident explain STUDY --design next",)
    for one in (found.steps[0].effect, *found.steps[0].indistinguishable):
        assert one.advice in separate.why
    assert "cannot show" in not_identifiable.what


def test_what_may_be_chance_is_asked_of_another_recording_before_it_is_added(found):
    (step,) = found.steps
    doubtful = replace(step, fall_standard_error=0.6 * step.fall)
    first = next_steps(replace(found, steps=(doubtful,)))[0]
    assert first.what.startswith("Before you add stribeck friction at elbow, hold out another")
    assert "may be chance" in first.why
    assert first.commands == ("dynident compare STUDY --with stribeck_friction@elbow",)


@pytest.mark.parametrize("fall", [0.0005, -0.0005])
def test_what_a_study_cannot_take_up_or_what_brings_nothing_is_no_command(found, fall):
    (step,) = found.steps
    push = replace(step, effect=catalogue()["contact"]("elbow"))
    small = replace(
        step,
        effect=effect("torque_offset", "elbow"),
        test_error_before=step.test_error_after,
        test_error_after=step.test_error_after - fall,
        indistinguishable=(),
    )
    advice = next_steps(replace(found, steps=(push, step, small)))
    commands = [one for each in advice for one in each.commands]
    assert not any("contact" in one for one in commands)
    assert any("torque_offset@elbow" in one for one in commands) == (fall > 0)
    assert ("of the" in advice[0].why) == (fall > 0)


def test_without_noise_the_first_thing_is_a_motion_that_repeats():
    unknown = diagnosis(("slide",), noise=False, steps=False, samples=200)
    first = next_steps(unknown)[0]
    assert "Record a motion that repeats" in first.what
    assert first.commands == ("dynident design STUDY --out next",)
    assert "noise is unknown" in headline(unknown).sentence


def test_where_nothing_is_missing_nothing_is_to_be_done():
    fine = diagnosis(("slide",), steps=False, samples=200)
    fine = replace(fine, candidates=())
    (only,) = next_steps(fine)
    assert only.what.startswith("Nothing is to be added")


def test_a_joint_fails_only_where_the_verdict_says_so(found):
    def of(one):
        return {state.joint.name: state.state for state in states(one)}

    assert of(rejected(found, 0.1, 2.0))["elbow"] == "failing"
    # One of few samples: the verdict has tested it.
    nothing = replace(found, verdict="nothing_missing", steps=())
    assert set(of(nothing).values()) == {"fine"}
    assert of(found)["elbow"] == "repaired"
    assert opened(found) >= {"elbow"}


def test_the_worst_joint_is_opened():
    many = diagnosis(tuple("abcdefg"), samples=200)
    assert opened(rejected(many, *[1.0, 5.0, 2.0, 3.0, 0.1, 0.2, 0.3])) == {"b"}


def test_errors_of_the_joints_are_drawn_over_the_noise(found):
    noise, given, after = (np.asarray(one["x"]) for one in joint_errors(found).to_dict()["data"])
    assert list(given) == [100 * joint.error_before for joint in found.joints]
    assert list(after) == [100 * joint.error_after for joint in found.joints]
    assert list(noise) == [100 * joint.noise_share for joint in found.joints]


def test_what_is_left_of_a_map_is_said(found):
    one = next(one for one in found.maps if one.sentence)
    assert left(replace(one, after=0 * one.after)) == "Within the noise."
    assert left(replace(one, sentence="", before=0 * one.before, after=0 * one.after)) == ""
    assert "Beyond the noise" in left(replace(one, after=9 * one.band))
    assert left(replace(one, band=np.full(len(one.band), np.nan))) == ""


def half_widths(table):
    ends = [row[3].split(" to ") for row in table.rows if row[3] != "-"]
    return np.array([float(stop) - float(start) for start, stop in ends]) / 2


def test_intervals_are_those_of_the_noise_where_the_model_holds(found):
    assert widening_after(found) is None
    half = half_widths(parameter_table(found.after, None, "given"))
    sigma = found.after.sigma[found.after.identified]
    assert half == pytest.approx(1.96 * sigma, rel=0.1)  # as written, rounded


def test_a_joint_is_not_called_in_order_by_another_measure_than_the_verdict(found):
    one = rejected(found, *(0.45 for _ in found.joints))
    assert {state.state for state in states(one)} == {"failing"}
    calm = rejected(found, *(0.1 for _ in found.joints))
    assert not any("nothing is left but noise" in state.words for state in states(calm))


def test_intervals_of_a_rejected_model_are_wider_by_the_birge_ratio(found):
    one = rejected(found, 0.0, 3.0)
    wider = widening_after(one)
    assert wider is not None
    assert wider.joints == pytest.approx({"shoulder": 1.0, "elbow": np.sqrt(10.0)})
    assert wider.overall == pytest.approx(np.sqrt(11.0 / 2.0))
    tables = [parameter_table(one.after, x, "given") for x in (None, wider)]
    grown = half_widths(tables[1]) / half_widths(tables[0])
    names = [row[0] for row in tables[0].rows if row[3] != "-"]
    for name, ratio in zip(names, grown, strict=True):
        place = name.partition("@")[2]
        expected = wider.joints[place] if place else wider.overall
        assert ratio == pytest.approx(expected, rel=0.1)
    assert "rejected" in tables[1].notes[0] and "rejected" not in tables[0].notes[0]


def test_the_model_as_given_is_rejected_where_something_was_added(found):
    assert widening_before(found) is not None
    assert widening_before(diagnosis(("slide",), steps=False, samples=200)) is None
    assert widening_before(diagnosis(("slide",), noise=False, samples=200)) is None


def test_shared_parts_are_written_once_and_come_back():
    x = np.arange(200, dtype=np.float32)
    figures = {name: go.Figure(go.Scatter(x=x, y=x**2, name="<a&b>")) for name in ("one", "two")}
    both = packed(figures)
    assert not set("<>&") & set(both.figures + both.shared + both.library)
    shared = json.loads(unpacked(both.shared))

    def whole(part):
        return shared[part["shared"]] if "shared" in part else part

    restored = json.loads(unpacked(both.figures), object_hook=whole)
    assert restored == {name: json.loads(str(one.to_json())) for name, one in figures.items()}
    alone = packed({"one": figures["one"]})
    assert len(unpacked(both.shared)) == len(unpacked(alone.shared))


def test_a_step_of_the_whole_robot_leaves_its_joints_as_they_are(found):
    step = replace(found.steps[0], effect=effect("payload"))
    calm = tuple(replace(joint, ratio_before=0.1) for joint in found.joints)
    assert {one.state for one in states(replace(found, steps=(step,), joints=calm))} == {"fine"}
