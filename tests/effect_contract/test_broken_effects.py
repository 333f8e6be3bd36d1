"""Effects that break one promise each: `check_effect` names it, with figures."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from dynident.effect_contract import RULES, check_effect
from dynident.effect_contract.crane import PLAIN, World, block_of, crane, places
from dynident.effect_contract.scaling_rules import _columns, _power
from dynident.effect_contract.unit_dimensions import Dimensions, dimensions
from dynident.effects import (
    Effect,
    JointEffect,
    Needs,
    Parameter,
    ResidualPicture,
    ShapeParameter,
    Term,
    catalogue,
    force_unit,
    motion_unit,
)
from dynident.errors import EffectError

BROKEN: dict[str, tuple[str, str, Callable[[], type[Effect]]]] = {}
"""Name -> the rule, words of the figures, and what makes the class."""


class Wave(JointEffect):
    """A friction that swells with the position: c v exp(-(q/w)^2)."""

    name = "wave"
    in_catalogue = False  # classes that are made of it say otherwise
    law = "c v exp(-(q/w)^2)"
    sign_of = "a slope against velocity in one place"
    experiment = "move {joint} at one speed everywhere"

    def parameters(self, robot):
        force, length = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (Parameter("c", f"{force} s/{length}"),)

    def shape_parameters(self, robot):
        unit = motion_unit(robot, self.joint)
        return (ShapeParameter("w", unit, (0.5, 2.0, 16.0), lower=0.1, upper=20.0),)

    def at_joint(self, block):
        j = [block.index(self.joint)]
        return block.v[:, j] * np.exp(-((block.q[:, j] / self.shape[0]) ** 2))

    def sensitivities(self, block):
        square = (block.q / self.shape[0]) ** 2
        return (self.columns(block) * 2.0 * square[:, :, None])[..., None]


def breaks(rule: str, words: str):
    """Register a function that returns the attributes by which a class is broken."""

    def register(changes: Callable[[], dict]) -> Callable[[], dict]:
        def made() -> type[Effect]:
            content = {"name": "broken_wave", "in_catalogue": True, **changes()}
            return type("BrokenWave", (Wave,), content)

        BROKEN[changes.__name__] = (rule, words, made)
        return changes

    return register


def columns_of(of: Callable) -> dict:
    """Columns from the right ones, without sensitivities."""
    return {
        "at_joint": lambda self, block: of(self, block, Wave.at_joint(self, block)),
        "sensitivities": Effect.sensitivities,
    }


@breaks("words", "law = ''")
def no_law():
    return {"law": ""}


@breaks("words", "experiment = None")
def no_experiment():
    return {"experiment": None}


@breaks("words", "confounded_with names 'gravity'")
def unknown_relative():
    return {"confounded_with": ("gravity",)}


@breaks("words", "does not say that it needs it")
def torque_without_need():
    return {"linear_in_torque": True}


@breaks("words", "needs = 'torque'")
def needs_in_words():
    return {"needs": "torque"}


@breaks("pictures", "which is no ResidualPicture")
def pictures_in_words():
    return {"pictures": ("a slope",)}


@breaks("pictures", "is against 'speed', and may be velocity, ")
def a_picture_of_no_map():
    return {"pictures": (ResidualPicture("speed", "a slope", lambda x, s: x),)}  # type: ignore[arg-type]


@breaks("pictures", "'a pole' at 0 times is nan where -0 is due (sample 0)")
def a_picture_that_is_not_finite():
    return {"pictures": (ResidualPicture("position", "a pole", lambda x, s: np.log(x)),)}


@breaks("places refused", "on() accepts the joints (None,)")
def accepts_any_joint():
    return {"on": lambda self, robot: replace(self, shape=self.shape or (2.0,))}


@breaks("places refused", "place = 'wall'")
def unknown_place():
    return {"place": "wall"}


@breaks("parameters", "parameters() has none")
def no_parameters():
    return {"parameters": lambda self, robot: ()}


@breaks("parameters", "what is no Parameter")
def parameters_in_words():
    return {"parameters": lambda self, robot: ("c",)}


@breaks("parameters", "named c, c")
def one_name_twice():
    return {"parameters": lambda self, robot: 2 * Wave.parameters(self, robot)}


@breaks("parameters", "ZeroDivisionError")
def candidates_raise():
    return {"candidates": classmethod(lambda cls, robot: [1 // 0])}


@breaks("seen somewhere", "candidates() yields no place")
def nowhere():
    return {"candidates": classmethod(lambda cls, robot: iter(()))}


@breaks("seen somewhere", "zero at every place")
def always_zero():
    return columns_of(lambda self, block, right: 0.0 * right)


@breaks("block unchanged", "block.v, changed by it, is")
def changes_the_block():
    def doubled(self, block, right):
        np.multiply(block.v, 2.0, out=block.v)
        return right

    return columns_of(doubled)


@breaks("finite columns", "25 of 25 of its columns' rows are not finite, first at q = ")
def not_a_number():
    return columns_of(lambda self, block, right: right * np.nan)


@breaks("finite columns", "of 25 of its columns' rows are not finite, first at q = ")
def infinite_at_some():
    return columns_of(lambda self, block, right: np.where(block.t[:, None] > 50, np.inf, right))


@breaks("finite columns", "float32 where float64 is due")
def single_precision():
    return columns_of(lambda self, block, right: right.astype(np.float32))


@breaks("finite columns", "has the shape (25, 4, 2) where (25, 4, 1) is due")
def a_column_too_many():
    return columns_of(lambda self, block, right: np.hstack([right, right]))


@breaks("finite columns", "returns a list")
def a_list():
    return {"columns": lambda self, block: Wave.columns(self, block).tolist()}


@breaks("finite columns", "KeyError: 'speed' (")
def raises():
    return columns_of(lambda self, block, right: {}["speed"])


@breaks("finite columns", "SystemExit: enough")
def leaves():
    return columns_of(lambda self, block, right: sys.exit("enough"))


@breaks("words of its place", "does not name travel")
def an_experiment_for_nobody():
    return {"experiment": "move about"}


@breaks("words of its place", "KeyError: 'axis'")
def an_experiment_with_a_gap():
    return {"experiment": "move {axis}"}


def with_unit(unit: str) -> dict:
    return {"parameters": lambda self, robot: (Parameter("c", unit),)}


@breaks("units", "no unit is named 'Nm'")
def an_unknown_unit():
    return with_unit("Nm")


@breaks("units", "c in N m s/rad, and travel slides")
def turned_where_it_slides():
    return with_unit("N m s/rad")


@breaks("units", "two units follow the stroke")
def an_ambiguous_unit():
    return with_unit("N/m s")


def offered(power: str) -> dict:
    """Units right in kind at every joint, and with another power than the columns'."""

    def parameters(self, robot):
        force, length = force_unit(robot, self.joint), motion_unit(robot, self.joint)
        return (Parameter("c", f"{force}{power}/{length}"),)

    return {"parameters": parameters}


@breaks("scaling as units", "c in N/m, and in units of 1/2 s its column is 0.5 times as large")
def a_second_forgotten():
    return offered("")


@breaks("scaling as units", "0.5 times as large where 0.25 is due")
def a_second_too_many():
    return offered(" s^2")


@breaks("scaling as units", "c in N s, and in units of 1/2 m its column is 2 times as large")
def a_metre_forgotten():
    def parameters(self, robot):
        return (Parameter("c", f"{force_unit(robot, self.joint)} s"),)

    return {"parameters": parameters}


@breaks("bounds", "c from 1 to inf, without zero")
def bounds_without_zero():
    return {"parameters": lambda self, robot: (replace(Wave.parameters(self, robot)[0], lower=1),)}


def with_shape(**changes) -> dict:
    def shape_parameters(self, robot):
        return (replace(Wave.shape_parameters(self, robot)[0], **changes),)

    return {"shape_parameters": shape_parameters}


@breaks("bounds", "the grid of w (0.05, 1) is not from 0.1 to 20")
def a_grid_outside():
    return with_shape(grid=(0.05, 1.0))


@breaks("bounds", "the grid of w does not ascend")
def a_grid_downwards():
    return with_shape(grid=(4.0, 2.0, 1.0))


@breaks("bounds", "at w = 0.1 m: 25 of 25 of its columns' rows are not finite")
def not_finite_at_the_bound():
    return columns_of(
        lambda self, block, right: right if self.shape[0] > 0.1 else right / np.zeros(1)
    )


@breaks("shapes refused", "on() accepts w = 20.2")
def any_shape():
    def on(self, robot):
        try:
            return Wave.on(self, robot)
        except EffectError:
            if self.shape and self.shape[0] > 20.0:
                return self
            raise

    return {"on": on}


@breaks("acting joints", "not zero at joints that acting_at does not name")
def acts_elsewhere():
    def columns(self, block):
        right = Wave.columns(self, block)
        return (
            right
            + right[:, ::-1] * (np.arange(len(block.names)) != block.index(self.joint))[:, None]
        )

    return {"columns": columns, "sensitivities": Effect.sensitivities}


@breaks("acting joints", "acting_columns is")
def another_column_where_it_acts():
    return {"acting_columns": lambda self, block: 2.0 * Wave.acting_columns(self, block)}


@breaks("families", "the column in family() at the shape (0.5,)")
def another_family():
    def family(self, variants, blocks):
        return [[2.0 * one.columns(block) for one in variants] for block in blocks]

    return {"family": family}


@breaks("one sample as many", "the column of a sample alone is 0 where")
def less_the_mean():
    return columns_of(lambda self, block, right: right - right.mean(axis=0))


@breaks("needs", "TypeError")
def takes_the_torque_unasked():
    return columns_of(lambda self, block, right: right * np.sign(block.torque[:, :1]))


@breaks("traits", "is_instantaneous = False with Needs.NOTHING")
def depends_and_does_not():
    return {"depends_on_fit": property(lambda self: not self.needs_torque)}


@breaks("payload", "not zero where the payload is not on board")
def a_payload_everywhere():
    return {"needs": Needs.PAYLOAD}


@breaks("payload", "a column without the payload is")
def a_payload_that_says_nothing():
    return columns_of(lambda self, block, right: right * block.carries_payload)


@breaks("scaling with torque", "a column at twice the torque is")
def a_square_of_the_torque():
    def square(self, block, _):
        return block.torque[:, [block.index(self.joint)]] ** 2

    return {
        "needs": Needs.TORQUE,
        "linear_in_torque": True,
        **columns_of(square),
    }


@breaks("contained effects", "torque_offset is no combination of its columns: ")
def contains_what_it_does_not():
    return {"contains": ("torque_offset",)}


@breaks("chords", "the column at 1e-09 of its values is")
def a_chord_of_its_own():
    return {
        **columns_of(lambda self, block, right: right * (2.0 if any(self.point) else 1.0)),
        "nonlinear": True,
    }


@breaks("derivatives", "the derivative by log w is")
def a_wrong_derivative():
    return {"sensitivities": lambda self, block: 0.5 * Wave.sensitivities(self, block)}


@breaks("derivatives", "sensitivities() has the shape (25, 4, 1) where (25, 4, 1, 1) is due")
def a_derivative_of_another_shape():
    return {"sensitivities": lambda self, block: Wave.columns(self, block)}


@breaks("zero values", "the simulated torque with values of zero is")
def a_force_from_nothing():
    def force(self, values, block):
        return Effect.simulated_force(self, values, block) + 1.0

    return {"simulated_force": force}


@breaks("zero values", "simulated_loss() is not zero for values of zero")
def a_loss_from_nothing():
    return {"simulated_loss": lambda self, values, robot: np.full(robot.n, 0.1)}


@breaks("simulation equals columns", "the torque of the columns at (")
def simulated_with_the_other_sign():
    def force(self, values, block):
        return -Effect.simulated_force(self, values, block)

    return {"simulated_force": force}


@breaks("simulation equals columns", "the torque of the columns at (")
def simulated_a_little_larger():
    def force(self, values, block):
        return (1.0 + 1e-6) * Effect.simulated_force(self, values, block)

    return {"simulated_force": force}


@breaks("simulated terms", "the sum of simulated_terms() at (")
def terms_of_another_law():
    def terms(self, values, robot):
        j = robot.names.index(self.joint)
        return (Term(j, "speed", (j,), values[0]),)

    return {"simulated_terms": terms}


def halved_above(limit: float) -> dict:
    def on(self, robot):
        made = Wave.on(self, robot)
        return made.shaped(made.shape[0] / 2) if made.shape[0] > limit else made

    return {"on": on}


@breaks("study file", "read back from a study it is broken_wave@travel")
def another_one_on_a_robot_from_a_file():
    def on(self, robot):
        made = Wave.on(self, robot)
        return made.shaped(1.0) if robot.description.path.endswith("crane.urdf") else made

    return {"on": on}


@breaks("estimate file", "read back from an estimate it is")
def halved_at_the_end_of_the_grid():
    return halved_above(4.0)


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_named(name):
    rule, words, made = BROKEN[name]
    with pytest.raises(EffectError) as told, np.errstate(all="ignore"):
        check_effect(made())
    said = str(told.value)
    assert f"breaks the rule '{rule}': " in said and words in said, said
    assert "\n" not in said and told.value.remedy


def test_every_rule_is_broken_by_somebody():
    assert {rule.name for rule in RULES} == {rule for rule, _, _ in BROKEN.values()}


@pytest.mark.slow
def test_the_effect_itself_is_sound():
    class SoundWave(Wave):
        name = "sound_wave"
        in_catalogue = True

    di.check_effect(SoundWave)
    assert catalogue()["sound_wave"] is SoundWave
    di.check_effect(Wave)  # which no file knows by its name


@pytest.mark.parametrize("kind", [int, Wave("swing"), "viscous_friction", None])
def test_what_is_no_class_of_an_effect_is_refused(kind):
    with pytest.raises(EffectError, match="no subclass of Effect"):
        check_effect(kind)


def test_a_place_in_the_file_of_the_class_is_named():
    _, _, made = BROKEN["raises"]
    with pytest.raises(EffectError, match=rf"\({__file__}:\d+\)"):
        check_effect(made())


def test_the_crane_in_other_units_is_the_same_crane():
    """Torques of the same motion, in the numbers of each world."""
    effect = places(catalogue()["viscous_friction"])[0]
    plain = block_of(effect, 3)
    assert plain.torque is not None
    for world in (World(time=3.0), World(force=5.0), World(length=7.0), World(2.0, 3.0, 5.0)):
        other = block_of(effect, 3, world)
        assert other.body is not None and other.torque is not None
        np.testing.assert_allclose(other.torque, world.torques * plain.torque, rtol=1e-12)
        inertia = other.body.torque_derivatives(other.q, other.v, other.a).by_a
        expected = crane().torque_derivatives(plain.q, plain.v, plain.a).by_a
        # A torque by an acceleration.
        scale = (world.torques[:, None] / world.positions[None, :]) * world.time**2
        np.testing.assert_allclose(inertia, scale * expected, rtol=1e-10, atol=1e-12)


def test_most_columns_are_powers_of_the_units():
    """Else the rule of scaling would pass over them."""
    shares = []
    for kind in catalogue().values():
        for effect in places(kind):
            found = []
            for base in ("time", "force", "length"):
                worlds = (PLAIN, World(**{base: 2.0}), World(**{base: 4.0}))
                columns = [_columns(effect, world) for world in worlds]
                for j in effect.acting_at(crane()):
                    found.append(_power(*(one[:, j, 0] for one in columns)) is not None)
            shares.append(np.mean(found))
    assert np.mean(shares) > 0.9


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("1", Dimensions()),
        ("N m s^2/rad^2", Dimensions(1, 1, 2)),
        ("kg m^2", Dimensions(1, 1, 2)),
        ("rad/(N m)", Dimensions(-1, -1, 0)),
        ("1/rev", Dimensions()),
        ("m/N", Dimensions(-1, 1, 0)),
        ("Hz", Dimensions(0, 0, -1)),
        ("N m/(s degC)", Dimensions(1, 1, -1)),
        ("s^-1", Dimensions(0, 0, -1)),
    ],
)
def test_units_are_read(unit, expected):
    assert dimensions(unit) == expected


@pytest.mark.parametrize(
    "unit", ["", " ", "N  m", "N*m", "Nm", "N m/s/rad", "N^", "N^1.5", "(N", "/"]
)
def test_units_that_cannot_be_read_are_refused(unit):
    with pytest.raises(EffectError, match="cannot be read"):
        dimensions(unit)
