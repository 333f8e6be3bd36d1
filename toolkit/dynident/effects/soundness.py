"""Are an effect's parameters and columns any? The least that everything else relies on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.effects.block import FRICTION_WIDTH, Block
from dynident.effects.effect import Effect
from dynident.effects.parameter import Parameter, ShapeParameter
from dynident.robot import Robot

_SAMPLES, _RATE = 25, 100.0


def sample_block(robot: Robot) -> Block:
    """Return a few samples of a robot at random, with everything that some effect needs."""
    q, v, a = robot.random_motion(0, _SAMPLES)
    return Block(
        np.arange(_SAMPLES) / _RATE,
        q,
        v,
        a,
        names=robot.names,
        friction_width=np.full(robot.n, FRICTION_WIDTH),
        carries_payload=True,
        tip=robot.tip,
        rigid=robot.regressor(q, v, a),
        torque=robot.inverse_dynamics(q, v, a),
        body=robot,
        empty=robot,
        rotor=np.full(robot.n, 0.1),
        number=1,
    )


def unsound_parameters(effect: Effect, robot: Robot) -> Iterator[str]:
    """Yield what is wrong with an effect's parameters; nothing where they are sound."""
    parameters, shapes = effect.parameters(robot), effect.shape_parameters(robot)
    if not parameters:
        yield "parameters() has none"
    if not all(isinstance(one, Parameter) for one in parameters):
        yield "parameters() holds what is no Parameter"
    elif not all(isinstance(one, ShapeParameter) for one in shapes):
        yield "shape_parameters() holds what is no ShapeParameter"
    else:
        for found in (parameters, shapes):
            names = [one.name for one in found]
            if len(set(names)) < len(names) or not all(names):
                yield f"its parameters are named {', '.join(names)}"


def unsound_columns(effect: Effect, block: Block, robot: Robot) -> Iterator[str]:
    """Yield what is wrong with an effect's columns in a block; nothing where they are sound.

    Parameters
    ----------
    effect : on the robot.
    block : samples of the robot.
    robot : whose places decide what parameters there are.
    """
    columns = effect.columns(block)
    if not isinstance(columns, np.ndarray):
        yield f"columns() returns a {type(columns).__name__}, not an array"
        return
    due = (*block.q.shape, len(effect.parameters(robot)))
    if columns.shape != due:
        yield f"columns() has the shape {columns.shape} where {due} is due"
    elif columns.dtype != np.float64:
        yield f"columns() is of {columns.dtype} where float64 is due"
    elif bad := np.count_nonzero(~np.isfinite(columns)):
        yield f"{bad} of {columns.size} entries of columns() are not finite"
