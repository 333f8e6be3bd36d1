"""What a verdict says first, and what it does not claim where the search was stopped."""

from __future__ import annotations

from dataclasses import replace

import pytest

from brief_search import BRIEF
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.details import JointFall
from dynident.diagnosis.leading_effects import MOST_OF_IT, LeadingEffects
from dynident.diagnosis.procedure import diagnose
from dynident.model import Model
from dynident.recording import Dataset
from dynident.reporting.headline import headline
from dynident.reporting.html import page
from dynident.reporting.next_steps import next_steps
from dynident.tables import two_percent
from reporting.fabricated import diagnosis, effect
from synthetic import arm, synthetic, true_values

NAMES = ("joint_spring", "torque_ripple", "torque_offset", "quadratic_drag")


def along(falls: tuple[float, ...], noise: bool = True) -> Diagnosis:
    """A diagnosis with an effect for each fall (in points, of 12 %), one after the other."""
    found = diagnosis(("shoulder", "elbow"), noise=noise, samples=100)
    (one,) = found.steps
    steps, error = [], 0.12
    for name, fall in zip(NAMES, falls, strict=False):
        after = error - fall / 100
        added = effect(name, "elbow", shape=(3.0,) if name == "torque_ripple" else ())
        values = (0.1,) * len(added.parameters(found.after.model.robot))
        steps.append(
            replace(
                one,
                effect=added,
                values=values,
                indistinguishable=(),
                test_error_before=error,
                test_error_after=after,
            )
        )
        error = after
    return replace(
        found,
        steps=tuple(steps),
        test_error=replace(found.test_error, before=0.12, after=error),
    )


def left_over(found: Diagnosis, **changed) -> Diagnosis:
    """The same, with a residual beyond the noise."""
    worse = tuple(replace(joint, ratio_after=2.0) for joint in found.joints)
    return replace(found, verdict="unexplained", joints=worse, **changed)


@pytest.mark.parametrize("noise", [True, False])
def test_effects_that_carry_the_fall_are_named_before_the_others_with_how_much(noise) -> None:
    found = along((0.3, 6.0, 0.2, 2.0), noise)
    for said in (found.sentence, headline(found).sentence):
        first = said.lower().index("torque ripple at elbow")
        assert first < said.index("quadratic drag at elbow") < said.index("8.00 of the 8.50 points")
    assert "two smaller ones (0.50 points: joint spring at elbow, torque offset" in found.sentence
    assert "joint spring" not in headline(found).sentence
    assert "two main effects found" in headline(found).title
    assert "Torque ripple" not in headline(along((1.0, 1.2, 0.9, 1.1), noise)).sentence


def test_no_effect_is_called_small_that_is_needed_for_most_of_the_fall() -> None:
    for falls in ((1.0, 1.2, 0.9, 1.1), (5.0, 4.0), (3.0,), ()):
        found = LeadingEffects.of(along(falls).steps)
        assert found.smaller == () and "smaller" not in found.in_words
    found = LeadingEffects.of(along((0.4, 9.1, 0.5)).steps)
    carried = sum(step.fall for group in found.leading for step in group)
    assert carried >= MOST_OF_IT * 0.1 and [len(found.leading), len(found.smaller)] == [1, 2]


def test_a_fall_that_may_be_chance_does_not_lead() -> None:
    steps = along((1.0, 2.0)).steps
    chance = replace(steps[1], fall_standard_error=0.02)
    assert chance.uncertain and not steps[0].uncertain
    found = LeadingEffects.of((steps[0], chance))
    assert [one.effect.name for one in found.leading[0]] == ["joint_spring"]
    assert [one.effect.name for one in found.smaller[0]] == ["torque_ripple"]
    assert len(LeadingEffects.of((chance,)).leading) == 1


@pytest.mark.parametrize("falls", [(9.0, 0.1, 0.1), (0.1, 9.0, 0.1)])
def test_what_requires_another_effect_leads_with_it(falls: tuple[float, float, float]) -> None:
    steps = along(falls).steps
    pair = effect("base_tilt"), effect("unbalance", "elbow")
    steps = (*(replace(s, effect=e) for s, e in zip(steps, pair, strict=False)), steps[2])
    leading = [step.effect.label for group in LeadingEffects.of(steps).leading for step in group]
    assert leading == ["base_tilt", "unbalance@elbow"]


def test_what_cannot_be_told_apart_is_named_together_in_either_part() -> None:
    found = along((6.0, 0.1))
    twins = (effect("asymmetric_friction", "elbow"),)
    steps = tuple(replace(step, indistinguishable=twins) for step in found.steps)
    said = replace(found, steps=steps).sentence
    assert said.count("(or asymmetric friction at elbow)") == 2


@pytest.mark.parametrize("noise", [True, False])
@pytest.mark.parametrize("falls", [(6.0, 2.0), ()])
@pytest.mark.slow
def test_where_the_search_was_stopped_nothing_is_said_of_the_rest_of_the_catalogue(
    noise, falls
) -> None:
    stopped = left_over(along(falls, noise), limit=len(falls))
    advice = " ".join(f"{one.what} {one.why}" for one in next_steps(stopped))
    for said in (stopped.sentence, headline(stopped).sentence, advice, page(stopped)):
        assert "more effects are significant and relevant" in said
        assert "explains it" not in said and "take it away" not in said
        assert "no effect of the catalogue" not in said.lower()
    assert stopped.sentence.lower().count("more effects are significant") == 1
    ended = left_over(along(falls, noise=True))
    assert "in the catalogue" in ended.sentence


@pytest.mark.slow
def test_no_law_is_proposed_while_the_catalogue_has_more() -> None:
    """A law "that no catalogue has" is for what the whole catalogue leaves."""
    given = Model(arm()) + "viscous_friction"
    full = given + "coulomb_friction" + "joint_spring@elbow"
    values = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
    truth = true_values(full, **values, k__elbow=2.5, c__elbow=-0.4)
    runs = tuple(synthetic(full, truth, seed, rate_hz=250.0, torque_std=0.1) for seed in range(3))
    train, test = Dataset(runs[:2]), Dataset(runs[2:])
    found = diagnose(given, train, test, most=1, criteria=BRIEF)
    assert found.verdict == "unexplained" and found.limit == 1
    assert found.proposals == ()


def test_what_takes_most_of_a_small_joints_own_error_is_not_called_small() -> None:
    found = along((9.0, 0.01, 0.01))
    wrist = JointFall(joint="elbow", before=0.15, after=0.04, standard_error=0.01)
    steps = list(found.steps)
    steps[1] = replace(steps[1], at_joint=wrist, fall_standard_error=0.1)
    told = replace(found, steps=tuple(steps))
    assert not told.steps[1].uncertain
    groups = LeadingEffects.of(told.steps)
    local, small = ([g[0].effect.name for g in part] for part in (groups.local, groups.smaller))
    assert local == ["torque_ripple"] and small == ["torque_offset"]
    assert "torque ripple at elbow (elbow from 15.00 % to 4.00 %)" in told.sentence
    assert "one smaller one (0.01 points: torque offset at elbow)" in told.sentence
    said = headline(told).sentence
    assert said.count("torque ripple at elbow takes elbow from 15.00 % to 4.00 %") == 1
    first = next_steps(told)[0]
    assert first.commands[0] == "dynident add STUDY joint_spring@elbow torque_ripple@elbow"


def test_where_all_joints_together_gain_little_the_joint_that_gains_is_told() -> None:
    found = along((0.5,))
    wrist = JointFall(joint="elbow", before=0.15, after=0.04, standard_error=0.01)
    elbow = found.joints[1]
    before, after = two_percent(elbow.error_before, elbow.error_after)
    told = replace(found, steps=(replace(found.steps[0], at_joint=wrist),))
    for said in (headline(told).sentence, next_steps(told)[0].why):
        assert f"to 11.50 %, that of elbow from {before} to {after}" in said
    none = replace(told, test_error=replace(told.test_error, after=told.test_error.before + 1e-6))
    said = headline(none).sentence
    assert f"takes the torque error of elbow from {before} to {after}, and that of all" in said
    assert "Most of the error stays" not in next_steps(told)[0].why
    big = along((9.0,))
    assert (
        "that of"
        not in headline(replace(big, steps=(replace(big.steps[0], at_joint=wrist),))).sentence
    )


@pytest.mark.parametrize(
    "at_joint",
    [
        JointFall(joint="elbow", before=0.15, after=0.04),
        JointFall(joint="elbow", before=0.15, after=0.04, standard_error=0.04),
        JointFall(joint="elbow", before=0.15, after=0.11, standard_error=0.001),
    ],
)
def test_what_a_joint_gains_by_chance_or_little_of_is_small(at_joint: JointFall) -> None:
    assert not at_joint.is_large
    steps = along((9.0, 0.01)).steps
    chance = replace(steps[1], at_joint=at_joint, fall_standard_error=0.1)
    assert chance.uncertain
    assert LeadingEffects.of((steps[0], chance)).local == ()
