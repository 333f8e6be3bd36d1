"""How far an effect is told from its rivals: by least squares, in the shape that imitates most."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.effects import effects_of
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.telling.imitations import Imitations, shapes_of
from dynident.experiment_design.telling.separation import (
    ALIKE,
    DECIDES,
    Predicted,
    Separation,
    Told,
)
from dynident.model import Model
from synthetic import arm, true_values

ROBOT = arm()
BARE = Model(ROBOT) + "viscous_friction" + "coulomb_friction"
VALUES = true_values(BARE)
(DRAG,), (STRIBECK,), (SPRING,), (RIPPLE,) = (
    effects_of(f"{one}@elbow", ROBOT)
    for one in ("quadratic_drag", "stribeck_friction", "joint_spring", "torque_ripple")
)
STD = np.array([0.2, 0.05])
SIZES = {DRAG.label: (0.3,), SPRING.label: (2.0, 0.5)}


def imitations(first, *rivals) -> Imitations:
    return Imitations(
        model=BARE,
        values=VALUES,
        columns=ColumnFunction.of(BARE, VALUES, (first,)),
        effect_values=np.array(SIZES[first.label]),
        std=STD,
        rivals=shapes_of(rivals, ROBOT),
        shapes=len(first.shape),
    )


def motion(count: int = 400):
    return np.linspace(0.0, 4.0, count), ROBOT.random_motion(5, count)


def left(first, rival, t, moved) -> float:
    """Square of what a rival in its shape cannot imitate, by least squares on all rows."""
    block = BARE.block(t, *moved)
    torque = first.columns(block) @ np.array(SIZES[first.label])
    columns = np.concatenate([BARE.columns(block), rival.columns(block)], axis=2)
    rows = (columns / STD[None, :, None]).reshape(-1, columns.shape[2])
    wanted = (torque / STD).ravel()
    return float(np.sum((wanted - rows @ np.linalg.lstsq(rows, wanted, rcond=1e-11)[0]) ** 2))


@pytest.mark.parametrize(
    ("first", "rivals"), [(DRAG, (STRIBECK,)), (SPRING, (RIPPLE,)), (DRAG, (SPRING, RIPPLE))]
)
def test_it_is_what_the_nearest_rival_leaves_of_the_torque(first, rivals) -> None:
    found, (t, moved) = imitations(first, *rivals), motion()
    every = [left(first, one, t, moved) for one in found.rivals]
    told = found.told(found.moments(t, moved))
    assert told.sigma == pytest.approx(np.sqrt(min(every)), rel=1e-5)
    assert 0.0 < told.share < 1.0
    # No shape between those that are tried imitates much more.
    (most,) = np.flatnonzero(np.array(every) == min(every))[:1]
    shape = np.array(found.rivals[most].shape)
    if len(shape):
        near = [
            left(first, found.rivals[most].shaped(*(x * shape)), t, moved) for x in (0.97, 1.03)
        ]
        assert min(near) > 0.85 * min(every)


def test_a_rival_with_more_parameters_is_told_by_chance_alone() -> None:
    """A diagnosis names none that explains less with more, however little less that is."""
    t, moved = motion()
    told = {
        name: found.told(found.moments(t, moved))
        for name, found in {
            "ripple": imitations(SPRING, RIPPLE),
            "drag": imitations(SPRING, DRAG),
            "both": imitations(SPRING, RIPPLE, DRAG),
        }.items()
    }
    assert told["ripple"].share < 1.0 and told["ripple"].share_alike == 1.0
    assert told["drag"].share_alike == told["drag"].share == told["both"].share_alike
    assert told["both"].share == told["ripple"].share < told["drag"].share


def test_moments_add_up_and_grow_with_rows() -> None:
    found, (t, moved) = imitations(DRAG, STRIBECK), motion()
    whole = found.moments(t, moved)
    halves = [
        found.moments(t[at], tuple(one[at] for one in moved))
        for at in (slice(150), slice(150, None))
    ]
    assert found.told(halves[0] + halves[1]).sigma == pytest.approx(found.told(whole).sigma)
    more = found.told(found.moments(t, moved, 4.0 * len(t)))
    assert more.sigma == pytest.approx(2.0 * found.told(whole).sigma)
    assert more.share == pytest.approx(found.told(whole).share)


def test_what_the_model_explains_is_told_from_nothing() -> None:
    (viscous,) = effects_of("viscous_friction@elbow", ROBOT)
    found = Imitations(
        model=BARE,
        values=VALUES,
        columns=ColumnFunction.of(BARE, VALUES, (viscous,)),
        effect_values=np.array([1.0]),
        std=STD,
        rivals=shapes_of((SPRING,), ROBOT),
        shapes=0,
    )
    t, moved = motion()
    assert found.told(found.moments(t, moved)) == Told(sigma=0.0, share=0.0, share_alike=0.0)


def test_the_least_that_decides_is_what_a_comparison_of_squares_can_tell() -> None:
    """Two simple hypotheses, x apart: the squares that they leave differ beyond chance or not."""
    rng, count = np.random.default_rng(0), 20_000
    # Along the line from one to the other, where x is the distance and the first is true.
    noise = rng.normal(size=count)
    more = (noise + DECIDES) ** 2 - noise**2  # squares left by the second, beyond the first's
    assert np.mean(more / (2 * DECIDES) > 1.96) == pytest.approx(0.9, abs=0.02)


def separation(designed: float, share: float, enough: float, chance: float = 1.0) -> Separation:
    return Separation(
        first="drag",
        others=("spring",),
        advice="",
        recorded=1.0,
        usual=2.0,
        predicted=Predicted(interval=(0.8 * designed, 1.2 * designed), chance=chance),
        told=Told(sigma=designed, share=0.5 * share, share_alike=share),
        worth=3.0,
        enough=enough,
    )


def test_what_decides_is_said() -> None:
    assert separation(50.0, 0.2, 0.1).decides
    assert "decide" not in separation(50.0, 0.2, 0.1).sentence(8.0)
    weak = separation(4.0, 0.2, 2.6)
    assert not weak.decides
    assert f"{DECIDES:g}" in weak.sentence(8.0) and "take 2.6 times as long" in weak.sentence(8.0)
    soon = separation(11.8, 0.9 * ALIKE, 1.4)
    assert not soon.decides
    assert f"{DECIDES:g}, from" not in soon.sentence(8.0)
    assert "it is predicted to decide from 1.4 times that length on." in soon.sentence(8.0)
    both = separation(5.9, 0.9 * ALIKE, 3.0)
    assert "6.5" not in both.sentence(8.0) and "from 3 times that length on" in both.sentence(8.0)
    alike = separation(50.0, 0.5 * ALIKE, np.inf)
    assert not alike.decides
    assert "may name both" in alike.sentence(8.0)
    assert alike.to_dict()["enough"] is None and alike.to_dict()["decides"] is False


@pytest.mark.parametrize(
    ("values", "variances"),
    [((2.0, 0.5), (0.04, 0.02)), ((0.2, 0.5), (1.0, 1e-4)), ((0.0, 0.5), (1.0, 1e-4))],
)
def test_a_prediction_is_as_uncertain_as_the_values_of_the_effect(values, variances) -> None:
    """Of truths that recordings leave open, what is measured lies within in 95 % of the cases."""
    found, (t, moved) = imitations(SPRING, DRAG), motion()
    forms = found.forms(found.moments(t, moved))
    interval = forms.predicted(np.array(values), np.diag(variances)).interval
    assert interval is not None
    low, high = interval
    rng = np.random.default_rng(1)
    truths = rng.multivariate_normal(values, np.diag(variances), 1000)
    measured = [forms.told(one).sigma + rng.standard_normal() for one in truths]
    assert np.mean([low <= abs(one) <= high for one in measured]) == pytest.approx(0.95, abs=0.02)


def test_what_may_be_small_may_not_decide() -> None:
    found, (t, moved) = imitations(SPRING, DRAG), motion()
    forms, values = found.forms(found.moments(t, moved)), np.array(SIZES[SPRING.label])
    assert forms.told(values).beyond > 0
    assert forms.predicted(values, 1e-4 * np.diag(values**2)).chance == 1.0
    assert (
        forms.predicted(values, 1e4 * np.diag(values**2)).chance > 0.9
    )  # as large with either sign
    assert 0.05 < forms.predicted(0.003 * values, np.diag((0.01 * values) ** 2)).chance < 0.9
    assert forms.predicted(values, None).interval is None
    assert forms.predicted(values, None).chance == 0.0


def test_an_uncertain_prediction_is_told_with_its_interval() -> None:
    one = separation(50.0, 0.2, 0.1)
    assert "by 50 standard deviations (95 %: 40 to 60); the" in one.sentence(8.0)
    assert one.to_dict()["interval"] == pytest.approx([40.0, 60.0])
    small = separation(50.0, 0.2, 0.1, chance=0.7)
    assert not small.decides and "may be smaller than it seems" in small.sentence(8.0)
    unknown = replace(small, predicted=Predicted(interval=None, chance=0.0))
    assert not unknown.decides and "do not tell" in unknown.sentence(8.0)
    assert unknown.to_dict()["interval"] is None


def test_of_a_larger_rival_no_share_is_asked() -> None:
    """A diagnosis names none that explains less with more parameters, however little less."""

    def made(share: float, share_alike: float) -> Separation:
        told = Told(sigma=50.0, share=share, share_alike=share_alike)
        return replace(separation(50.0, 1.0, 0.1), told=told)

    assert made(0.5 * ALIKE, 1.0).decides and "decide" not in made(0.5 * ALIKE, 1.0).sentence(8.0)
    assert not made(0.5 * ALIKE, 0.5 * ALIKE).decides
