"""Units, bounds and grids of an effect's parameters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.effect_contract.crane import block_of, crane
from dynident.effect_contract.unit_dimensions import dimensions, factors
from dynident.effects import Effect
from dynident.errors import EffectError


def units_are_of_its_joint(effect: Effect) -> Iterator[str]:
    """Units that can be read; N m and rad where a joint turns, N and m where it slides."""
    robot = crane()
    joints = [name for name in (effect.joint, effect.source) if name is not None]
    kinds = {robot.kinds[robot.names.index(name)] for name in joints}
    for one in (*effect.parameters(robot), *effect.shape_parameters(robot)):
        try:
            found = dimensions(one.unit)
        except EffectError as error:
            yield f"{one.name}: {error}"
            continue
        angular = any(name in ("rad", "deg") for name, _ in factors(one.unit))
        if kinds == {"revolute"} and found.force != found.length:
            yield f"{one.name} in {one.unit}, and {' and '.join(joints)} is turned, by N m"
        if kinds == {"prismatic"} and angular and "rad/m" not in one.unit:
            yield f"{one.name} in {one.unit}, and {' and '.join(joints)} slides, in m"


def bounds_leave_room(effect: Effect) -> Iterator[str]:
    """No effect at all is possible, and columns are finite at the bounds of every shape."""
    robot = crane()
    for parameter in effect.parameters(robot):
        if not parameter.lower < parameter.upper or not parameter.lower <= 0 <= parameter.upper:
            yield f"{parameter.name} from {parameter.lower:g} to {parameter.upper:g}, without zero"
    shapes = effect.shape_parameters(robot)
    for shape in shapes:
        inside = all(shape.lower <= value <= shape.upper for value in shape.grid)
        if not shape.lower < shape.upper or not inside or not shape.grid:
            grid = ", ".join(f"{value:g}" for value in shape.grid)
            limits = f"from {shape.lower:g} to {shape.upper:g}"
            yield f"the grid of {shape.name} ({grid}) is not {limits}"
        if list(shape.grid) != sorted(set(shape.grid)):
            yield f"the grid of {shape.name} does not ascend"
    block = block_of(effect, 0)
    for k, shape in enumerate(shapes):
        for value in (shape.lower, shape.upper):
            values = [*effect.shape[:k], value, *effect.shape[k + 1 :]]
            at = f"at {shape.name} = {value:g} {shape.unit}"
            try:
                columns = effect.shaped(*values).on(robot).columns(block)
            except EffectError as error:
                yield f"{at}: {error.what}"
            else:
                if not np.isfinite(columns).all():
                    yield f"{at}: columns are not finite"


def shapes_outside_are_refused(effect: Effect) -> Iterator[str]:
    """By name, as is a wrong number of them."""
    robot = crane()
    wanted = effect.shape_parameters(robot)
    for k, shape in enumerate(wanted):
        for value in (shape.lower - 1e-3 * shape.upper, shape.upper * 1.01, np.nan):
            values = [one.grid[0] for one in wanted]
            values[k] = value
            yield from _accepted(effect.shaped(*values), shape.name, f"{shape.name} = {value:g}")
    yield from _accepted(effect.shaped(*[1.0] * (len(wanted) + 1)), "shape", "a shape too many")


def _accepted(effect: Effect, word: str, what: str) -> Iterator[str]:
    try:
        effect.on(crane())
    except EffectError as error:
        if word not in str(error):
            yield f"the refusal of {what} does not name it: {error}"
    else:
        yield f"on() accepts {what}"
