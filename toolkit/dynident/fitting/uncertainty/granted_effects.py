"""What sigma takes for granted: effects that make no torque without one that the model has.

An upright robot hides how far its first link's centre of mass lies beside a vertical axis; a tilted
one turns that into a torque, and the columns of the tilt take it from the description. The tilt is
then known no better than the description. How well it is known without that, the fit with the
torque of the hidden distance tells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from dynident.effects import Effect, catalogue
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.tables import listed, number

_NAMED = 4  # parameters in a sentence
_MORE = 1.5
"""Standard deviations that a parameter would change by, or have, from which it is said."""


def with_granted_effects(estimate: Estimate, fit: Callable[[Model], Estimate]) -> Estimate:
    """Return an estimate that says what its sigma takes for granted, and what it would be else.

    Parameters
    ----------
    estimate : whose words of its sigma do not say it yet.
    fit : the same method, of another model. It is asked where the catalogue has an effect that
        requires one of the model's (`Effect.requires`), and the model has it not.

    Raises
    ------
    FitError
        As `fit` does.
    """
    model, said = estimate.model, []
    for effect in _granted(model):
        wide = fit(replace(model, effects=(*model.effects, effect)))
        own = np.concatenate([np.r_[model.slices[label]] for label in effect.requires])
        change = np.hypot(wide.sigma[own], wide.values[own] - estimate.values[own])
        parts = [
            f"{model.names[i]} is {number(float(wide.values[i]), 3)} with a sigma of "
            f"{number(float(wide.sigma[i]), 2)} {model.units[i]}"
            for i, one in zip(own, change, strict=True)
            if one > _MORE * estimate.sigma[i] > 0.0
        ]
        if parts:
            said.append(
                f" It takes for granted that there is no {effect.title} ({effect.meaning}). Where "
                f"that is not known, add {effect.label}: then {listed(parts)}."
            )
    said += _bodies_left_open(estimate)
    if not said:
        return estimate
    return replace(estimate, sigma_words="".join([estimate.words_of_sigma, *said]))


def _bodies_left_open(estimate: Estimate) -> list[str]:
    """What effects whose columns are of bodies take of these from the description, a sentence."""
    model, alone = estimate.model, estimate.alone
    bodies = range(len(model.base.independent))
    left = [model.names[i] for i in bodies if estimate.identified[i] and not alone[i]]
    own = [one.title for one in model.effects if one.needs_bodies]
    if not left or not own:
        return []
    more = f" and {len(left) - _NAMED} more" if left[_NAMED:] else ""
    return [
        f" The columns of {listed(own)} are made of the bodies. Of {', '.join(left[:_NAMED])}"
        f"{more} the data tell only sums with other parameters: how much of a sum is a body's is "
        "taken from the description, and sigma holds no error in that."
    ]


def _granted(model: Model) -> Iterator[Effect]:
    """Effects that a model has not, though it has one that they require."""
    for kind in catalogue().values():
        if not kind.requires or not all(label in model.slices for label in kind.requires):
            continue
        for effect in kind.candidates(model.robot):
            if effect.label not in model.slices:
                yield effect.on(model.robot)
