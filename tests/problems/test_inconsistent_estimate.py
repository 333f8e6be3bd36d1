"""The problem `inconsistent_estimate`: an accurate fit whose links no rigid body can be."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from dynident import Constrained, Dataset, Estimate, Prior, Study, compare, load, project
from dynident import fit as fit_model
from dynident.closed_loop import Experiment, load_experiment
from dynident.constraints import Within
from dynident.inertia import margins, to_com
from dynident.recording import read

PROBLEM = Path(__file__).parents[2] / "problems" / "inconsistent_estimate"
PUBLISHED = tomllib.loads((PROBLEM / "published.toml").read_text())


@cache
def study() -> Study:
    return load(PROBLEM / "study.toml")


@cache
def experiment() -> Experiment:
    return load_experiment(PROBLEM / "experiment.toml")


@cache
def estimate() -> Estimate:
    return fit_model(study().model, study().train)


def with_true_effects(rigid: np.ndarray) -> Estimate:
    """The estimate with these base parameters, and friction and rotors as they truly are."""
    model = study().model
    values = np.zeros(model.size)
    values[: len(rigid)] = rigid
    for one in experiment().effects:
        values[model.slices[one.effect.label]] = one.values
    return replace(estimate(), values=values)


@pytest.mark.slow
def test_the_estimate_is_accurate_where_it_was_fitted_and_impossible() -> None:
    found, published = estimate(), PUBLISHED["least_squares"]
    assert (found.model.size, found.basis.rank) == (published["parameters"], published["rank"])
    assert found.rows == published["equations"]
    assert list(found.inconsistent_links()) == published["inconsistent_links"]
    assert found.error == pytest.approx(published["train_error"], rel=published["tolerance"])


@pytest.mark.slow
def test_on_another_motion_it_is_worse_than_the_data_sheet() -> None:
    base, published = study().model.base, PUBLISHED["data_sheet"]
    comparison = compare(
        {
            "fit": estimate(),
            "sheet": with_true_effects(base.coordinates(study().robot.theta)),
            "truth": with_true_effects(base.coordinates(experiment().robot.theta)),
        },
        study().test,
    )
    fit, sheet, truth = (result.error for result in comparison.results)
    assert fit == pytest.approx(PUBLISHED["least_squares"]["test_error"], rel=0.01)
    assert sheet == pytest.approx(published["test_error"], rel=published["tolerance"])
    assert fit > sheet > 2 * truth
    # Nothing is missing in the model: the truth leaves noise only.
    floor = comparison.results[-1].floor
    assert floor is not None
    assert truth == pytest.approx(floor, rel=0.05)


def test_data_sheet_and_truth_are_consistent_and_differ_by_10_to_20_percent() -> None:
    given, true = study().robot, experiment().robot
    for phi in (*given.theta.reshape(-1, 10), *true.theta.reshape(-1, 10)):
        assert margins(phi).consistent
    for ours, theirs in zip(given.theta.reshape(-1, 10), true.theta.reshape(-1, 10), strict=True):
        one, other = to_com(ours), to_com(theirs)
        assert 0.05 < abs(one.mass / other.mass - 1.0) < 0.25
        ratio = np.trace(one.inertia_com) / np.trace(other.inertia_com)
        assert 0.1 < abs(ratio - 1.0) < 0.25
    masses = [robot.theta[::10].sum() for robot in (given, true)]
    assert masses == pytest.approx([20.5, 20.5])


def test_its_projection_is_possible_and_predicts_another_motion() -> None:
    published = PUBLISHED["projection"]
    found = project(estimate())
    assert all(margins(phi).consistent for phi in found.robot.theta.reshape(-1, 10))
    assert found.certificate.optimal
    (result,) = compare(found.estimate, study().test).results
    assert result.error == pytest.approx(published["test_error"], rel=published["tolerance"])
    assert result.floor == pytest.approx(published["noise_floor"], rel=published["tolerance"])


def test_where_little_is_believed_the_constraint_helps() -> None:
    published = PUBLISHED["weak_prior"]
    prior = Prior(study().robot, spread=published["spread"])
    free, within = (
        fit_model(study().model, study().train, Constrained(Within(notion), prior))
        for notion in ("none", "full")
    )
    assert len(free.inconsistent_links()) == published["unconstrained_inconsistent_links"]
    assert within.inconsistent_links() == ()
    errors = [r.error for r in compare({"free": free, "within": within}, study().test).results]
    expected = [published["unconstrained_test_error"], published["test_error"]]
    assert errors == pytest.approx(expected, rel=published["tolerance"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", PUBLISHED["other_seeds"]["seeds"])
def test_noise_of_another_seed_makes_it_impossible_too(seed: int) -> None:
    train = replace(experiment(), seed=seed, runs=experiment().runs[:1]).run()
    found = fit_model(study().model, Dataset(train))
    least = PUBLISHED["other_seeds"]["least_inconsistent_links"]
    assert len(found.inconsistent_links()) >= least


def test_recordings_are_those_of_the_experiment() -> None:
    short = tuple(replace(run, duration=0.5) for run in experiment().runs)
    for found in replace(experiment(), runs=short).run():
        kept = read(PROBLEM / found.name, study().robot.names).cut(0.0, 0.499)
        # Motions beside it change the integrator's last digits, and then the encoder's rounding.
        np.testing.assert_allclose(found.q, kept.q, atol=2e-4)
        assert np.abs(found.tau - kept.tau).mean() < 0.2


def test_the_problem_is_small_and_keeps_the_truth_apart() -> None:
    files = list(PROBLEM.iterdir())
    assert sum(file.stat().st_size for file in files) < 2 * 2**20
    assert "true_arm" not in (PROBLEM / "study.toml").read_text()
