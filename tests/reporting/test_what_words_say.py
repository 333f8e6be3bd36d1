"""Words of an answer: how much each effect carries, with which error, and what was not sought."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.test_verdict_in_words import along
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.advice.geometry_doubt import with_geometry_doubt
from dynident.fitting.estimate import ShapeValue
from dynident.model import Model
from dynident.reporting.intervals import parameter_table, printed_parameters
from dynident.reporting.next_steps import next_steps
from reporting.fabricated import diagnosis, effect, fitted, motion


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnosis(("shoulder", "elbow"), samples=100)


def test_what_carries_the_fall_is_to_be_added_first() -> None:
    """The largest fall first; what is small beside it is a step of its own, after the others."""
    first, *others = next_steps(along((2.0, 0.1, 5.0, 0.05)))
    assert first.what.startswith("Add torque offset at elbow and joint spring at elbow to")
    assert "7.00 of the 7.15 points" in first.why
    assert first.commands[0].endswith("STUDY torque_offset@elbow joint_spring@elbow")
    (then,) = [one for one in others if one.what.startswith("Then add")]
    assert "torque ripple at elbow and quadratic drag at elbow" in then.what


@pytest.mark.parametrize(("fall", "stays"), [(2.0, True), (6.0, False)])
def test_a_small_fall_is_said_to_leave_most(fall: float, stays: bool) -> None:
    """Where something is left, or nobody knows: of a model that explains all it is noise."""
    found = along((fall,))
    why = next_steps(replace(found, verdict="unexplained"))[0].why
    assert ("Most of the error stays." in why) == stays
    assert "stays" not in next_steps(replace(found, verdict="explained"))[0].why


def test_more_than_three_are_named_by_their_number() -> None:
    first = next_steps(along((2.0, 2.1, 2.2, 2.3)))[0]
    assert first.what.endswith("and one more to the model, and fit it.")
    assert first.commands[0].count("@elbow") == 4


@pytest.mark.parametrize(
    ("fall", "error", "words"),
    [
        (0.0207, 0.0048, "2.07 \u00b1 0.48"),
        (0.00331, 0.00083, "0.331 \u00b1 0.083"),
        (0.070, 0.0152, "7.00 \u00b1 1.52"),
    ],
)
def test_a_fall_has_the_digits_of_its_error(
    found: Diagnosis, fall: float, error: float, words: str
) -> None:
    one = replace(
        found.steps[0],
        test_error_before=0.1,
        test_error_after=0.1 - fall,
        fall_standard_error=error,
    )
    assert one.fall_in_words == words


def test_where_nothing_was_to_be_added_no_search_is_said_to_have_ended(found: Diagnosis) -> None:
    none = replace(found, steps=(), verdict="unexplained", limit=0)
    assert "Nothing was to be added, and more effects are significant" in none.sentence
    assert "ended" not in none.sentence
    assert "outside the catalogue" not in none.confidence
    assert replace(none, limit=None).track_record is not None and none.track_record is None


def test_shapes_have_intervals_where_their_sigma_is_known(found: Diagnosis) -> None:
    after = found.after
    (name,) = [one for names in after.model.shape_names.values() for one in names][:1]
    value = next(e.shape[0] for e in after.model.effects if e.shape)
    unknown = {row[0]: row for row in parameter_table(after, None, "replicates").rows}
    assert unknown[name][3] == "-"
    known = replace(after, shapes=(ShapeValue(name=name, value=value, sigma=0.02, unit="rad/s"),))
    rows = {row[0]: row for row in parameter_table(known, None, "replicates").rows}
    low, high = map(float, rows[name][3].split(" to "))
    assert high - low == pytest.approx(2 * 1.96 * 0.02, rel=0.05) and low < value < high
    wide = replace(after, shapes=(ShapeValue(name=name, value=value, sigma=value, unit="rad/s"),))
    rows = {row[0]: row for row in parameter_table(wide, None, "replicates").rows}
    said, _, most = rows[name][3].rpartition(" ")  # no such speed is negative
    assert said == "up to" and float(most) == pytest.approx(2.96 * value, rel=0.05)


def test_a_stated_coupling_is_not_doubted_by_what_is_left_there(found: Diagnosis) -> None:
    left: Any = (SimpleNamespace(joint="elbow", told=("other joints",)),)
    open_ = replace(found, verdict="unexplained", steps=(), residual_dependence=left)
    assert any("coupled_motors" in note for note in with_geometry_doubt(open_, ()).notes)
    coupled = found.before.model + "joint_coupling@elbow:shoulder"
    stated = replace(open_, before=replace(found.before, model=coupled))
    assert not any("coupled_motors" in note for note in with_geometry_doubt(stated, ()).notes)


def test_explain_says_above_its_parameters_that_a_model_is_rejected() -> None:
    fine = diagnosis(("shoulder", "elbow"), samples=100)
    worse = tuple(replace(joint, ratio_after=2.0) for joint in fine.joints)
    above, *rest = printed_parameters(replace(fine, verdict="unexplained", joints=worse))
    above = str(above)
    assert "rejected" in above and "sigma holds noise only" in above and len(above) < 100
    assert "rejected" not in "".join(str(part) for part in printed_parameters(fine))
    assert [str(one) for one in rest] == [str(one) for one in printed_parameters(fine)]


@pytest.mark.parametrize("at_end", [True, False])
def test_explain_says_of_a_shape_that_it_is_at_the_end_of_where_it_is_sought(at_end: bool) -> None:
    found = diagnosis(("shoulder", "elbow"), samples=100)
    robot = found.after.model.robot
    (shape,) = effect("thermal_friction", "elbow").shape_parameters(robot)
    warm = effect("thermal_friction", "elbow", shape=(shape.upper if at_end else 240.0,))
    model = Model(robot) + warm
    block = model.block(*motion(robot, 1, 400))
    after = fitted(model, np.random.default_rng(1).normal(size=block.q.shape), block)
    one = replace(found, steps=(replace(found.steps[0], effect=warm),), after=after)
    for table in (*printed_parameters(one), parameter_table(after, None, "replicates")):
        assert ("the best may lie beyond" in " ".join(str(table).split())) == at_end


def test_explain_prints_what_it_added_and_what_that_is() -> None:
    found = diagnosis(("shoulder", "elbow"), samples=100)
    model = Model(found.after.model.robot) + effect("thermal_friction", "elbow", shape=(240.0,))
    model += effect("viscous_friction", "elbow")
    block = model.block(*motion(model.robot, 1, 400))
    after = fitted(model, np.random.default_rng(1).normal(size=block.q.shape), block)
    step = replace(found.steps[0], effect=model.effects[0])
    for shapes, said in (
        ((ShapeValue(name="T@elbow", value=240.0, sigma=3.0, unit="s"),), ["3", "1.2", "%"]),
        ((), ["-", "-"]),
    ):
        one = replace(found, steps=(step,), after=replace(after, shapes=shapes))
        (table,) = printed_parameters(one)
        lines = [line.split() for line in str(table).splitlines()]
        assert ["T@elbow", "240", *said, "s"] in lines
        legend = [" ".join(line[1:]) for line in lines if line and line[0] in ("Fvt:", "T:")]
        parts = (*step.effect.parameters(model.robot), *step.effect.shape_parameters(model.robot))
        assert [one.partition(" ")[0] for one in legend] == [
            parts[i].means.partition(" ")[0] for i in (0, 2)
        ]
        names = [line[0] for line in lines if line and "@" in line[0]]
        assert names == ["Fvt@elbow", "Fct@elbow", "T@elbow"]
        # A contact is an event: it has a step, and no part in the model.
        contact = replace(step, effect=effect("contact", "elbow"))
        with_it = printed_parameters(replace(one, steps=(contact, step)))
        assert str(with_it[0]) == str(table)
        assert printed_parameters(replace(one, steps=(contact,))) == ()
        assert printed_parameters(replace(one, steps=())) == ()
