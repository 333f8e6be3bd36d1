"""Every parameter of a model has a name of its own, whatever its effects call theirs."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

from dynident import diagnose, fit
from dynident.effects import catalogue
from dynident.model import Model
from dynident.recording import Dataset
from dynident.reporting.intervals import parameter_table
from synthetic import arm, synthetic, true_values


def names_of(model: Model) -> list[str]:
    return [*model.names, *(name for names in model.shape_names.values() for name in names)]


def test_no_two_parameters_of_a_model_have_one_name() -> None:
    """Of any two effects of the catalogue at one joint."""
    robot = arm()
    effects = [
        one
        for kind in catalogue().values()
        for one in kind.candidates(robot)
        if one.joint == "elbow"
    ]
    qualified = 0
    for pair in combinations(effects, 2):
        names = names_of(Model(robot) + pair)
        assert max(Counter(names).values()) == 1, pair
        qualified += sum(name.startswith(f"{one.name}.") for name in names for one in pair)
    assert qualified >= 4  # the spring beside ripple and elasticity, two offsets, two resonances


def test_an_effect_that_comes_later_renames_none_before_it() -> None:
    model = Model(arm()) + "joint_spring@elbow"
    assert (model + "joint_elasticity@elbow").names[: model.size] == model.names


def test_rows_of_parameters_can_be_told_apart() -> None:
    model = Model(arm()) + "viscous_friction" + "joint_spring@elbow" + "torque_ripple@elbow"
    values = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "k__elbow": 2.0, "As__elbow": 0.5}
    runs = tuple(
        synthetic(model, true_values(model, **values), seed, rate_hz=250.0, torque_std=0.1)
        for seed in range(2)
    )
    estimate = fit(model, Dataset(runs))
    shown = [*estimate.parameter_table().rows, *estimate.shape_table().rows]
    assert max(Counter(row[0] for row in shown).values()) == 1
    found = diagnose(model, Dataset(runs), most=0)
    rows = parameter_table(found.after, None, "replicates").rows
    said = [row[0] for row in rows]
    assert max(Counter(said).values()) == 1 and {"k@elbow", "torque_ripple.k@elbow"} <= set(said)
