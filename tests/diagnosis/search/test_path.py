"""Steps that are taken together, refused, or taken back."""

from __future__ import annotations

from functools import cache

import pytest

from brief_search import BRIEF
from dynident import diagnose as find
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.details import Withdrawn, named_together
from dynident.effects import effects_of
from dynident.model import Model
from dynident.recording import Dataset, Filter
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
FULL = Model(arm()) + "viscous_friction" + "coulomb_friction"


def data(model: Model, values: dict[str, float], *seeds: int) -> Dataset:
    truth = true_values(model, **FRICTION, **values)
    return Dataset(
        tuple(
            synthetic(model, truth, s, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
            for s in seeds
        )
    )


@cache
def trained_on_what_the_test_lacks() -> Diagnosis:
    """A spring that was there in the training recordings only."""
    sprung = FULL + "joint_spring@elbow"
    train = data(sprung, {"k__elbow": 2.0, "c__elbow": 0.0}, 0, 1)
    return find(FULL, train, data(FULL, {}, 2), propose="never")


@pytest.mark.slow
def test_what_raises_the_held_out_error_is_withdrawn_and_said_to_be() -> None:
    found = trained_on_what_the_test_lacks()
    assert not [one for one in found.steps if one.effect.name == "joint_spring"]
    (spring,) = (one for one in found.withdrawn if one.effect.label == "joint_spring@elbow")
    assert "raises the error on the test recordings from" in spring.why
    assert found.test_error.after <= found.test_error.before
    assert any("Withdrawn: joint spring at elbow" in note for note in found.caveats)
    said = found.to_dict()
    where = {"joint": "elbow", "source": None}
    (one,) = (o for o in said["withdrawn"] if o["effect"] == "joint_spring")
    # The ripple that comes near a spring is told from it, and withdrawn by itself.
    assert one == {"effect": "joint_spring", **where, "why": spring.why}
    assert "torque_ripple@elbow" in {one.effect.label for one in found.withdrawn}
    for step in said["steps"]:
        assert step["test_error_after"] <= step["test_error_before"]
    assert found.verdict != "explained"


def test_what_cannot_be_told_from_something_withdrawn_is_said_with_it() -> None:
    offset, spring = (
        effects_of(f"{one}@elbow", arm())[0] for one in ("torque_offset", "joint_spring")
    )
    one = Withdrawn(effect=spring, why="raises the error", with_it=(offset,))
    assert one.to_dict()["with_it"] == [
        {"effect": "torque_offset", "joint": "elbow", "source": None}
    ]
    assert "Not tried in its place: torque offset at elbow, which is" in one.sentence
    assert set(one.refusals) == {spring.label, offset.label}


@pytest.mark.slow
def test_no_twin_of_what_was_withdrawn_takes_its_place() -> None:
    found = trained_on_what_the_test_lacks()
    refused = {label for one in found.withdrawn for label in one.refusals}
    assert not refused & {one.effect.label for one in found.steps}
    (again,) = [one for one in found.remaining if one.effect.label == "joint_spring@elbow"]
    assert again.status == "not_material"
    for one in found.remaining:
        assert not (one.effect.label in refused and one.status == "material")


@cache
def from_the_rigid_body(most: int) -> Diagnosis:
    train, test = data(FULL, {}, 0, 1), data(FULL, {}, 2)
    return find(Model(arm()), train, test, most=most, criteria=BRIEF)


@pytest.mark.slow
def test_what_every_joint_has_is_one_proposal() -> None:
    found = from_the_rigid_body(2)
    assert {one.effect.label for one in found.steps} == {e.label for e in FULL.effects}
    assert found.verdict == "explained"
    names = named_together(found.steps)
    assert len(names) == 2
    assert all(" at shoulder and elbow" in n or " at elbow and shoulder" in n for n in names)


@pytest.mark.slow
def test_an_end_at_the_limit_is_said_in_the_verdict() -> None:
    found = from_the_rigid_body(1)
    assert len({one.effect.name for one in found.steps}) == 1
    assert found.limit == 1
    assert "ended at its limit of 1 addition," in found.sentence
    assert from_the_rigid_body(2).limit is None


@pytest.mark.slow
def test_a_warm_motor_in_some_recordings_is_no_payload() -> None:
    """What an offset in the same recordings explains as well, nobody calls a load."""
    shifted = FULL + "torque_offset@shoulder"
    warm = data(shifted, {"offset__shoulder": 1.0}, 1, 3).recordings
    cold = data(FULL, {}, 0, 2).recordings
    train = Dataset((cold[0], warm[0], cold[1]))
    found = find(FULL, train, Dataset((warm[1],)), propose="never", criteria=BRIEF)
    assert not any(one.effect.is_payload for one in found.steps)


@pytest.mark.slow
def test_an_effect_that_noise_in_the_columns_makes_changes_with_the_filter() -> None:
    """Nothing repeats and no noise is stated: least squares shrinks inertias, and others grow."""
    truth = true_values(FULL, **FRICTION)
    made = [
        synthetic(FULL, truth, s, rate_hz=250.0, period=None, position_std=1e-3, torque_std=0.3)
        for s in range(3)
    ]
    rough = Filter(position_cutoff_hz=25.0)
    found = find(FULL, Dataset(tuple(made[:2]), rough), Dataset(tuple(made[2:]), rough))
    assert found.noise_source == "unknown"
    assert not found.steps
    remarks = [one.remark for one in found.candidates]
    assert any("changes with the filter" in remark for remark in remarks)


@pytest.mark.slow
def test_a_shape_is_sought_beside_an_effect_of_the_session() -> None:
    model = FULL + "thermal_friction@elbow"
    truth = {"Fvt__elbow": 0.2, "Fct__elbow": 0.1, "Fs__shoulder": 1.0}
    train = data(model + "stribeck_friction@shoulder", truth, 0, 1)
    found = find(model, train)
    assert [one.effect.label for one in found.steps] == ["stribeck_friction@shoulder"]
