"""Columns in other units: a column times its parameter is a torque in any of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dynident.effect_contract.crane import PLAIN, World, block_of, crane
from dynident.effect_contract.disagreement import differs
from dynident.effect_contract.unit_dimensions import Dimensions, dimensions
from dynident.effects import Effect

_STEP = 2.0  # from world to world; a power of two is exact
_WORDS = {"time": "s", "force": "N", "length": "m"}
_POWER = 1e-4  # of the step: what rounding makes of an exponent is far less
_ALIKE = 1e-6  # of a column: how well one is a multiple of another


def scales_with_the_torque(effect: Effect) -> Iterator[str]:
    """Columns that are said to be linear in the torque double with it, to the bit."""
    if not effect.linear_in_torque:
        return
    block = block_of(effect, 10)
    twice = replace(block, torque=2.0 * np.asarray(block.torque))
    expected = 2.0 * effect.columns(block)
    yield from differs("a column at twice the torque", effect.columns(twice), expected)


def scales_as_its_units(effect: Effect) -> Iterator[str]:
    """In smaller units of time, force or length a column grows as the units of its parameter say.

    A column that holds a number with a unit (as tanh(v/0.1) does) is no power of them, and is
    passed over.
    """
    robot = crane()
    for base, unit in _WORDS.items():
        worlds = (PLAIN, World(**{base: _STEP}), World(**{base: _STEP**2}))
        found = [_columns(effect, world) for world in worlds]
        for j, kind in enumerate(robot.kinds):
            torque = Dimensions(1, int(kind == "revolute"))
            for k, parameter in enumerate(effect.parameters(robot)):
                power = _power(*(columns[:, j, k] for columns in found))
                due = getattr(torque * dimensions(parameter.unit) ** -1, base)
                if power is not None and abs(power - due) > _POWER:
                    yield (
                        f"{parameter.name} in {parameter.unit}, and in units of 1/2 {unit} its "
                        f"column is {_STEP**power:.4g} times as large where {_STEP**due:.4g} is due"
                    )


def _columns(effect: Effect, world: World) -> np.ndarray:
    """Columns in another world, whose shapes are the same in other numbers."""
    shape = []
    for value, one in zip(effect.shape, effect.shape_parameters(crane()), strict=True):
        has = dimensions(one.unit)
        scale = world.force**has.force * world.length**has.length * world.time**has.time
        shape.append(value * scale)
    return effect.shaped(*shape).columns(block_of(effect, 12, world))


def _power(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> float | None:
    """Exponent with which a column grows from step to step; None if it does not by one power."""
    square = float(first @ first)
    ratio = float(first @ second) / square if square > 0 else 0.0
    if not (np.isfinite(ratio) and ratio > 0):
        return None
    for before, after in ((first, second), (second, third)):
        if not np.abs(after - ratio * before).max() <= _ALIKE * np.abs(after).max():
            return None
    return float(np.log2(ratio))
