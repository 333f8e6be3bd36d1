"""Derivatives that an effect says it knows, against differences."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.effect_contract.crane import block_of, crane, random_values
from dynident.effect_contract.disagreement import differs
from dynident.effects import Effect

_STEP = 1e-5  # of the logarithm of a shape parameter, for central differences


def chords_tend_to_the_derivative(effect: Effect) -> Iterator[str]:
    """Columns that are taken at values go over into those at zero."""
    values = random_values(effect, 6)
    if not effect.nonlinear:
        if effect.at(values.tolist()) is not effect:
            yield "it is linear in its parameters, and at() returns another effect"
        return
    if effect.simulated_transmission(tuple(values), crane()):  # it has no derivative at zero
        return
    block = block_of(effect, 6)
    derivative = effect.columns(block)
    limit = np.abs(derivative).max()
    # At its ends, what a recording does not hold is made up.
    inner = slice(2, -2) if effect.needs_recording else slice(None)
    for size in (0.0, 1e-9, 1e-5, 1e-4):
        chord = effect.at((size * values).tolist()).columns(block)
        room = (1e-9 + 1e3 * size) * limit
        what = f"the column at {size:g} of its values"
        yield from differs(what, chord[inner], derivative[inner], relative=1e-7, absolute=room)


def sensitivities_are_the_derivatives(effect: Effect) -> Iterator[str]:
    """By the logarithm of each shape parameter, against central differences."""
    block = block_of(effect, 8)
    found = effect.sensitivities(block)
    shapes = effect.shape_parameters(crane())
    if found is None or effect.simulated_transmission((1e-3,), crane()):
        return  # what gives way changes its contacts: differences say nothing of it
    columns = effect.columns(block)
    if found.shape != (*columns.shape, len(shapes)):
        due = (*columns.shape, len(shapes))
        yield f"sensitivities() has the shape {found.shape} where {due} is due"
        return
    for k, one in enumerate(shapes):
        sides = []
        for sign in (1.0, -1.0):
            shape = list(effect.shape)
            shape[k] *= np.exp(sign * _STEP)
            sides.append(effect.shaped(*shape).columns(block))
        expected = (sides[0] - sides[1]) / (2 * _STEP)
        room = 1e-5 * (np.abs(columns).max() + np.abs(expected).max())
        what = f"the derivative by log {one.name}"
        yield from differs(what, found[..., k], expected, relative=1e-7, absolute=room)
