"""The contract that every effect of the catalogue keeps; a new effect is tested by being there."""

from __future__ import annotations

import re

import numpy as np
import pytest

from dynident.closed_loop import Mechanism, TrueEffect
from dynident.effect_contract import check_effect
from dynident.effect_contract.crane import crane, places
from dynident.effects import Effect, catalogue, effects_of, force_unit, motion_unit
from dynident.errors import EffectError

ROBOT = crane()
EVERY = pytest.mark.parametrize(
    "effect",
    [one for kind in catalogue().values() for one in places(kind)],
    ids=lambda effect: effect.label,
)
EACH = pytest.mark.parametrize("kind", catalogue().values(), ids=list(catalogue()))


@EACH
def test_every_effect_keeps_the_contract(kind: type[Effect]) -> None:
    check_effect(kind)


@EVERY
def test_units_of_the_catalogue_are_of_the_usual_forms(effect: Effect) -> None:
    """A column's unit times its parameter's is N m at a revolute joint and N at a prismatic one."""
    if effect.joint is None:
        return
    force = force_unit(ROBOT, effect.joint)
    assert force == ("N m" if effect.joint in ("slew", "swing") else "N")
    length = motion_unit(ROBOT, effect.source or effect.joint)
    inertia = {"N m": "kg m^2", "N": "kg"}[force]
    power = r"(\^2)?"
    valid = [
        "1",
        re.escape(force),
        re.escape(force) + rf"/{length}",
        re.escape(force) + rf" s{power}/{length}{power}",
        re.escape(inertia),
        # Torques that are not linear in the parameter, or have another quantity as their unit.
        re.escape(force) + "/s",
        length,
        "s",
        {"rad": r"rad/\(N m\)", "m": "m/N"}[length],
    ]
    for one in effect.parameters(ROBOT):
        assert any(re.fullmatch(unit, one.unit) for unit in valid), f"{one.name}: {one.unit}"


@EACH
def test_true_effects_refuse_wrong_values(kind: type[Effect]) -> None:
    effect = next(iter(kind.candidates(ROBOT))).on(ROBOT)
    parameters = effect.parameters(ROBOT)
    with pytest.raises(EffectError, match="give"):
        TrueEffect.of(effect.label, ROBOT, [1.0] * (len(parameters) + 1))
    with pytest.raises(EffectError, match="did you mean"):
        TrueEffect.of(effect.label, ROBOT, {parameters[0].name + "x": 1.0})
    for parameter in parameters:
        with pytest.raises(EffectError, match="choose it between"):
            TrueEffect.of(effect.label, ROBOT, {parameter.name: np.nan})
        if np.isfinite(parameter.lower):
            with pytest.raises(EffectError, match="choose it between"):
                TrueEffect.of(effect.label, ROBOT, {parameter.name: parameter.lower - 1.0})


def test_labels_without_a_joint_stand_for_every_place() -> None:
    assert [one.label for one in effects_of("viscous_friction", ROBOT)] == [
        "viscous_friction@travel",
        "viscous_friction@slew",
        "viscous_friction@swing",
        "viscous_friction@hoist",
    ]
    assert len(effects_of("joint_coupling", ROBOT)) == 12
    assert [one.label for one in effects_of("payload", ROBOT)] == ["payload"]
    (pair,) = effects_of("joint_coupling@swing:hoist", ROBOT)
    assert (pair.joint, pair.source) == ("swing", "hoist")
    assert pair.formula.startswith("cv v[hoist] + cc sign(v[hoist])")


@pytest.mark.parametrize("name", list(catalogue()))
def test_a_misspelt_name_is_answered_with_the_right_one(name: str) -> None:
    misspelt = name[:3] + name[4:]
    with pytest.raises(EffectError, match=f"did you mean '{name}'"):
        effects_of(misspelt, ROBOT)


def test_a_strange_name_is_answered_with_all() -> None:
    with pytest.raises(EffectError) as caught:
        effects_of("zzz", ROBOT)
    for name in catalogue():
        assert name in str(caught.value)


def test_true_effects_by_name_leave_the_rest_at_zero() -> None:
    (spring,) = TrueEffect.of("joint_spring@swing", ROBOT, {"k": 2.0})
    assert spring.values == (2.0, 0.0)
    (stribeck,) = TrueEffect.of("stribeck_friction@swing", ROBOT, {"Fs": 1.0}, {"vs": 0.1})
    assert stribeck.effect.shape == (0.1,)
    with pytest.raises(EffectError, match="did you mean 'vs'"):
        TrueEffect.of("stribeck_friction@swing", ROBOT, {"Fs": 1.0}, {"vss": 0.1})
    with pytest.raises(EffectError, match="twice"):
        Mechanism.of(ROBOT, [spring, spring])
