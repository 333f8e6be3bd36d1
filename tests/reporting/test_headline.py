"""What a reader sees first: verdict, icon, title and colour must say the same, and briefly."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest

from dynident.diagnosis.details import Withdrawn
from dynident.diagnosis.nuisances.sampling_time import SamplingTime
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.effects import Law, law_effect
from dynident.reporting.content import step_groups
from dynident.reporting.glossary import glossary
from dynident.reporting.headline import headline
from dynident.reporting.html import page
from dynident.reporting.joint_states import opened, states
from dynident.reporting.next_steps import FIRST, in_short, next_steps, then_record
from dynident.tables import percent
from dynident.wiring import Fault
from dynident.wiring.speed_limits import OverSpeed
from reporting.fabricated import diagnosis, effect
from reporting.read_page import Elements

KINDS = list(product(("nothing_missing", "explained", "unexplained"), (True, False), (True, False)))


@pytest.fixture(scope="module")
def six():
    return diagnosis(tuple(f"joint{i}" for i in range(1, 7)), samples=200)


def of_kind(verdict, steps, noise):
    found = diagnosis(("shoulder", "elbow"), steps=steps, noise=noise, samples=100)
    worse = 2.0 if noise and verdict == "unexplained" else 0.1 if noise else None
    joints = tuple(replace(joint, ratio_after=worse) for joint in found.joints)
    return replace(found, verdict=verdict, joints=joints)


@pytest.mark.parametrize(("verdict", "steps", "noise"), KINDS)
@pytest.mark.slow
def test_verdict_icon_title_and_colour_agree(verdict, steps, noise):
    if (verdict == "explained" and not steps) or (verdict == "nothing_missing" and steps):
        pytest.skip("is no verdict that a diagnosis can have")
    found = of_kind(verdict, steps, noise)
    head, (kind, title) = headline(found), opening(page(found))
    remains = noise and verdict == "unexplained"
    assert (head.mark == "\u2713") == (noise and not remains) == (kind == "nothing_missing")
    assert (head.mark == "!") == remains == (kind == "unexplained")
    assert (head.mark == "?") == (not noise) == (kind == "unknown")
    assert ("noise is unknown" in head.sentence) == (not noise) == ("noise unknown" in title)
    assert ("remains" in title) == remains and ("beyond the noise" in head.sentence) == remains
    assert ("missing" in title) == (verdict == "nothing_missing" and noise)
    assert ("found" in title and "nothing" not in title) == steps
    assert len(head.sentence.split()) <= 32


@pytest.mark.parametrize("steps", [True, False])
def test_a_part_below_the_noise_is_told_with_every_verdict(steps):
    found = of_kind("explained" if steps else "nothing_missing", steps, noise=True)
    for left, told in ((0.4, False), (0.7, True), (1.1, True)):
        joints = tuple(replace(joint, ratio_after=left) for joint in found.joints)
        one = replace(found, joints=joints)
        assert ("though not nothing" in headline(one).sentence) == (left == 0.7)
        assert ("steps of the encoders" in headline(one).sentence) == (left == 1.1)
        size = {
            0.4: "within",
            0.7: "smaller than the noise (0.7 of it)",
            1.1: "1.1 times the noise",
        }
        assert size[left] in one.sentence
        assert ("smaller" in headline(one).sentence) == ("smaller" in one.sentence)
        assert ("Nothing is missing" in one.sentence) == (not steps and not told)
        assert (headline(one).title == "nothing is missing") == (not steps and not told)


def test_what_was_found_and_withdrawn_is_not_said_to_be_nothing():
    found = of_kind("nothing_missing", False, noise=True)
    alike = (effect("drive_gain", "elbow"),)
    taken = Withdrawn(
        effect=effect("drive_gain", "shoulder"), why="raises the error", with_it=alike
    )
    one = replace(found, withdrawn=(taken,))
    assert "drive gain at shoulder or drive gain at elbow: withdrawn" in one.sentence
    assert "Nothing is missing:" not in one.sentence + headline(one).sentence
    assert headline(one).mark == "?"


def test_a_joint_that_is_too_fast_comes_first():
    fast = OverSpeed(joint="elbow", reached=7.0, limit=6.0, unit="rad/s", at_limit=("shoulder",))
    for verdict, steps in (("explained", True), ("nothing_missing", False), ("unexplained", True)):
        found = of_kind(verdict, steps, noise=True)
        doubted = replace(found, too_fast=fast)
        assert doubted.sentence.startswith("As the study reads positions, elbow reaches 7 rad/s")
        assert doubted.to_dict()["notes"][0] == fast.sentence
        assert headline(doubted).sentence.startswith("elbow is too fast")
        assert headline(doubted).mark != "\u2713"
        assert "q.elbow" in next_steps(doubted)[0].what
        assert doubted.track_record is None


def test_where_reversals_are_left_out_no_model_is_called_right():
    found = of_kind("nothing_missing", False, noise=True)
    small = replace(found.test_error, before=found.test_error.noise_floor)
    one = replace(found, test_error=small, reversals_left_out={"elbow": 0.43})
    assert replace(one, reversals_left_out={}).track_record is not None
    assert one.track_record is None
    assert one.sentence.startswith("Away from the reversals of elbow nothing is missing")
    assert "reversals of elbow (43 % of its rows)" in one.sentence
    head, (first, *_) = headline(one), next_steps(one)
    assert head.mark == "?" and "away from reversals" in head.title
    assert "Nothing is missing:" not in head.sentence + one.sentence
    assert (
        "Do not trust the model at the reversals of elbow" in first.what
        and "use the model" not in first.what
    )


def test_what_is_added_is_said_with_what_these_data_do_not_tell_it_from():
    found = of_kind("explained", True, noise=True)
    first, *rest = found.steps
    one = replace(first, indistinguishable=(effect("drive_gain", "elbow"),))
    told_apart = (replace(step, indistinguishable=()) for step in (first, *rest))
    alike, apart = replace(found, steps=(one, *rest)), replace(found, steps=tuple(told_apart))
    told = f"These data do not tell {one.effect.title} from drive gain at elbow."
    assert told in next_steps(alike)[0].what
    assert "do not tell" not in next_steps(apart)[0].what


def test_what_a_law_makes_superfluous_is_not_advised():
    found = of_kind("unexplained", True, noise=True)
    label = found.steps[0].effect.label
    law = law_effect(Law(name="proposal1", torque="c*v*q"))("elbow").on(found.before.model.robot)
    proposal = Proposal(
        effect=law,
        values=(1.0,),
        sigma=(0.1,),
        shape_sigma=(),
        explains=0.9,
        is_explanation=True,
        p_value=0.0,
        tried=900,
        test_error_before=0.0117,
        test_error_after=0.0086,
        noise_floor=0.0085,
    )
    besides = replace(found, proposals=(proposal,))
    instead = replace(found, proposals=(replace(proposal, instead_of=(label,)),))
    first, second = (next_steps(one)[0] for one in (besides, instead))
    assert any(label in command for command in first.commands)
    assert second.what.startswith(f"Do not add {label} yet.") and "0.86 %" in second.what
    assert second.commands == ("dynident add STUDY --proposal 1",)
    others = [one.commands for one in next_steps(instead)]
    assert not any(label in command for commands in others for command in commands)
    assert f"in the place of {label} takes it to 0.86 %" in headline(instead).sentence
    assert "in the place of" not in headline(besides).sentence


def test_that_the_catalogue_lacks_it_is_not_said_of_what_was_withdrawn():
    found = of_kind("unexplained", False, noise=True)
    assert "no effect in the catalogue was seen to take it away" in found.sentence
    assert "no effect of the catalogue explains it" in headline(found).sentence
    taken = Withdrawn(effect=effect("drive_gain", "shoulder"), why="raises the error", with_it=())
    one = replace(found, withdrawn=(taken,))
    assert "call for was withdrawn: drive gain at shoulder. Missing may be some" in one.sentence
    assert "of the catalogue explains" not in one.sentence + headline(one).sentence
    again = replace(one, withdrawn=(taken, replace(taken, effect=effect("drive_gain", "elbow"))))
    assert "shoulder and drive gain at elbow. Missing may be several of these" in again.sentence
    assert one.track_record is None


def opening(html):
    parsed = Elements(html)
    (kind,) = (a["class"] for tag, a in parsed.elements if tag == "body")
    return kind, html.partition("<title>")[2].partition("</title>")[0]


def test_faulty_recordings_and_impossible_values_are_never_a_tick():
    fault = Fault(
        kind="torque_sign", joints=("slide",), what="sign of tau.slide", evidence="mirrored"
    )
    fine = diagnosis(("slide",), steps=False, samples=100)
    for bad in (replace(fine, wiring=(fault,)), replace(fine, impossible=("m.link1 = -3 kg",))):
        assert headline(bad).mark == "!" and headline(bad).colour == "unexplained"


def test_what_every_joint_has_is_told_once(six):
    names = [joint.name for joint in six.joints]
    one = six.steps[0]
    steps = tuple(
        replace(one, effect=effect("coulomb_friction", name), indistinguishable=())
        for name in names
    )
    (group,) = step_groups(replace(six, steps=steps))
    assert group.title == "coulomb friction at all six joints"
    some = step_groups(replace(six, steps=(*steps[:2], one)))
    assert [g.title for g in some] == [
        "coulomb friction at joint1 and joint2",
        "stribeck friction at joint6",
    ]


def test_the_headline_never_names_an_effect_without_what_it_cannot_be_told_from(six):
    assert (
        "Stribeck friction at joint6 (or asymmetric friction at joint6)" in headline(six).sentence
    )


def test_what_follows_the_motion_is_said_and_shown_at_its_joint(six):
    """Verdict, next step, table and the picture that is open name one joint."""
    joints = tuple(
        replace(one, ratio_before=None, ratio_after=None, noise_rms=None) for one in six.joints
    )
    found = replace(six, noise_source="unknown", joints=joints, verdict="unexplained")
    found = replace(found, following_motion=("joint2",))
    assert "what is left at joint2 follows the motion" in headline(found).sentence
    assert any("pictures of joint2" in one.what for one in next_steps(found))
    (failing,) = (one for one in states(found) if one.state == "failing")
    assert failing.joint.name == "joint2" and "not all noise" in failing.words
    assert opened(found) == {"joint2"}


def test_without_a_noise_the_error_is_said_in_the_headline_and_the_json():
    found = of_kind("nothing_missing", steps=False, noise=False)
    error = percent(found.test_error.after)
    assert error in headline(found).sentence and error in found.sentence
    said = found.to_dict()
    assert said["verdict"] == "nothing_missing" and "cannot be said" in said["notes"][0]
    assert error in said["notes"][0]
    known = of_kind("nothing_missing", steps=False, noise=True).to_dict()
    assert not any("cannot be said" in note for note in known["notes"])


def test_a_small_fall_that_may_be_chance_is_not_to_be_added(six):
    one = six.steps[0]
    falls = ((0.10, 0.02, 1e-3), (0.02, 0.019, 1e-4), (0.019, 0.0189, 1e-3))
    names = ("stribeck_friction", "joint_spring", "torque_offset")
    steps = tuple(
        replace(
            one,
            effect=effect(name, "joint6"),
            indistinguishable=(),
            test_error_before=before,
            test_error_after=after,
            fall_standard_error=sigma,
        )
        for name, (before, after, sigma) in zip(names, falls, strict=True)
    )
    told = next_steps(replace(six, steps=steps))
    assert [c for one in told for c in one.commands if "add" in c] == [
        "dynident add STUDY stribeck_friction@joint6",
        "dynident add STUDY joint_spring@joint6",
    ]
    (left_out,) = (one for one in told if one.what.startswith("Leave"))
    assert "torque offset at joint6" in left_out.what and "chance" in left_out.why


def test_a_long_text_ends_with_the_verdict_and_what_to_type(six):
    verdict, following = in_short(six, Path("my studies/arm.toml"))
    assert headline(six).sentence in verdict
    what, *commands = following.splitlines()
    assert next_steps(six)[0].what in what
    assert commands[0].startswith("    dynident add 'my studies/arm.toml' ") and len(commands) == 2


def test_rivals_of_what_was_added_are_told_with_the_recording_that_decides(six):
    rivals = (effect("torque_ripple", "joint6"), effect("joint_zero", "joint6"))
    steps = tuple(
        replace(six.steps[0], effect=effect(name, "joint6"), indistinguishable=those)
        for name, those in (
            ("joint_spring", rivals),
            ("quadratic_drag", ()),
            ("stribeck_friction", (effect("viscous_friction", "joint6"),)),
        )
    )
    one, both = (replace(six, steps=some) for some in (steps[:2], steps))
    arm = Path("my arm.toml")
    (alone,), (told,) = (then_record(found, arm) for found in (one, both))
    for said in (alone, told):
        assert said.startswith("Then: Before you believe in joint spring at joint6")
        assert said.endswith("\n    dynident explain 'my arm.toml' --design next")
        assert "quadratic drag" not in said
    assert "from torque ripple at joint6 and from joint zero at joint6" in alone
    assert "joint spring at joint6 and stribeck friction at joint6" in told
    commands = [typed for advice in next_steps(both) for typed in advice.commands]
    assert commands.count("dynident explain STUDY --design next") == 1
    none = "no motion of this robot tells joint spring at joint6 from torque ripple at joint6"
    untold = (
        replace(six, steps=(steps[1],)),  # without rivals
        replace(one, steps=(replace(steps[0], advice=none), steps[1])),
        replace(one, steps=(replace(steps[0], effect=effect("backlash", "joint6")),)),
        replace(one, impossible=("the inertia of joint6 is negative",)),
    )
    for found in untold:
        assert then_record(found, arm) == ()
        assert not any("--design" in c for advice in next_steps(found) for c in advice.commands)


@pytest.mark.slow
def test_at_most_three_next_steps_are_unfolded(six):
    many = replace(six, noise_source="unknown", steps=six.steps * 4)
    advice = next_steps(many)
    assert len(advice) > FIRST
    html = page(many)
    shown, _, folded = html.partition("How far")[2].partition("<details><summary>")
    assert shown.count("<li><strong>") == FIRST
    assert folded.count("<li><strong>") == len(advice) - FIRST


def test_every_word_is_defined_once_and_every_symbol_of_the_model_is(six):
    terms = glossary(six)
    words = [one.word for one in terms]
    assert len(set(words)) == len(words)
    model = six.after.model
    symbols = {name.partition("@")[0].partition(".")[0] for name in model.names}
    assert symbols <= set(words)
    assert {"vs", "stribeck friction", "asymmetric friction"} <= set(words)
    text = Elements(page(six)).text
    for one in terms:
        assert text.count(one.meaning) == 1


@pytest.mark.parametrize("steps", [True, False])
def test_a_torque_of_another_moment_is_the_first_to_be_mended(steps):
    found = of_kind("explained" if steps else "nothing_missing", steps, noise=True)
    sampled = SamplingTime(later_s=2e-3, sigma_s=1e-4, mend='torque = "held_command"')
    told = next_steps(replace(found, sampled=sampled))
    assert sampled.mend in told[0].what and "2 ms later" in told[0].why
    assert not any("use the model as it is" in one.what for one in told)
    assert not any("held_command" in one.what for one in next_steps(found))


def test_a_contact_is_found_and_takes_no_error(six):
    """Its rows are left out: the errors before and after are the same."""
    pushed = effect("contact", "joint2")
    values = (0.1,) * len(pushed.parameters(six.after.model.robot))
    step = replace(six.steps[0], effect=pushed, values=values, indistinguishable=())
    said = headline(replace(six, steps=(step,))).sentence
    assert said.startswith("Contact at joint2 was found, and beside it the torque error is")
