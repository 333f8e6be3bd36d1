"""Effects of a model by their labels: one of each, with the shape that it has there."""

from __future__ import annotations

import pytest

from dynident.errors import EffectError
from dynident.model import Model
from synthetic import arm


def test_an_effect_is_had_by_its_label_as_it_is_in_the_model() -> None:
    model = Model(arm()) + "viscous_friction" + "stribeck_friction@elbow"
    stated = model.effect("stribeck_friction@elbow")
    other = stated.shaped(*(2.0 * value for value in stated.shape))
    assert model.with_shapes((other,)).effect(stated.label) == other != stated
    assert stated not in model - other.label
    assert model - stated == model - other == model - stated.label


def test_what_is_not_in_a_model_is_neither_had_nor_taken_out() -> None:
    model = Model(arm()) + "viscous_friction@elbow"
    for asked in (model.effect, model.__sub__):
        with pytest.raises(EffectError, match=r"shoulder.*is not in the model"):
            asked("viscous_friction@shoulder")
