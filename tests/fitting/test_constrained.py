"""Least squares under constraints: known truth, the same as projection, better than without."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chains import SOLVERS, chain_text, least
from dynident.constraints import Bounds, Known, TotalMass, Within
from dynident.errors import FitError
from dynident.fitting import (
    Constrained,
    Estimate,
    LeastSquares,
    Metric,
    Prior,
    fit,
    load_estimate,
    project,
    rows,
)
from dynident.inertia import margins
from dynident.model import Model
from dynident.moments import factorise
from dynident.nlp.certificate import OPTIMAL
from dynident.recording import Dataset, Filter
from dynident.robot import Robot
from synthetic import smooth_motion, synthetic, true_values

QUIET = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=50.0, edge_s=(0.02, 0.02))


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(Robot.from_text(chain_text(3))) + "viscous_friction"


@pytest.fixture(scope="module")
def truth(model: Model) -> np.ndarray:
    return true_values(model, Fv__j0=0.3, Fv__j1=0.2, Fv__j2=0.1)


def poor(model: Model, truth: np.ndarray, seed: int) -> Dataset:
    """A short, noisy recording of little motion."""
    recording = synthetic(
        model, truth, seed, rate_hz=200.0, duration=2.0, period=None, torque_std=1.0
    )
    return Dataset((recording,), QUIET)


def off_description(model: Model, seed: int = 0, by: float = 0.1) -> Robot:
    """The description with every link's parameters wrong by a tenth."""
    rng = np.random.default_rng(seed)
    robot = model.robot
    return robot.with_links(
        {f"l{k}": robot.links[k + 1].phi * (1 + by * rng.normal()) for k in range(robot.n)}
    )


@pytest.fixture(scope="module")
def constrained(model: Model, truth: np.ndarray) -> Estimate:
    return fit(model, poor(model, truth, 3), Constrained())


@pytest.mark.parametrize("solver", SOLVERS)
def test_noise_free_truth_is_recovered(model, truth, solver) -> None:
    """From a description that is off by a tenth, which a wide prior lets go of."""
    prior = Prior(off_description(model), spread=10.0)
    data = Dataset(
        (synthetic(model, truth, 1, duration=8.0),),
        Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=100.0),
    )
    found = fit(model, data, Constrained(prior=prior, solver=solver))
    free = fit(model, data, LeastSquares())
    assert found.error < free.error + 1e-4, "what differentiation leaves, no more"
    np.testing.assert_allclose(found.values, truth, rtol=5e-3, atol=5e-3)
    proof = found.certificate
    assert proof is not None and not found.inconsistent_links()
    # Next to nothing is left to minimise, of which the nonlinear program may leave a part.
    assert proof.optimal or (solver == "nlp" and "NOT proved" in proof.sentence)


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize("consistency", ["full", "semi"])
@pytest.mark.slow
def test_it_is_fitting_first_and_projecting_under_the_metric(
    model, truth, consistency, distance
) -> None:
    """To rounding: X'X and the least-squares estimate are all that data say."""
    data = poor(model, truth, 3).of_joints(model.robot.names)
    within, prior = Within(consistency), Prior(model.robot, distance, 3.0)
    direct = fit(model, data, Constrained(within, prior, weighting="none"))
    free = fit(model, data, LeastSquares("none"))
    assert free.inconsistent_links()
    factors = factorise(rows(model, data))
    std = np.sqrt(np.mean(free.torque_std**2))
    R = factors.pooled(np.full(3, 1 / std))[: model.size, : model.size]
    later = project(free, prior, Metric(R, model.names, rows=factors.rows, source="X'X"), within)
    size = later.space.scale
    np.testing.assert_allclose(links_of(direct) / size[:30], later.x[:30] / size[:30], atol=1e-8)
    np.testing.assert_allclose(direct.values, later.values, rtol=1e-7, atol=1e-9)
    assert not np.allclose(direct.values, free.values, rtol=1e-2), "constraints changed it"
    # With weights of joints that follow from residuals, and refined ones in the metric: nearly.
    direct = fit(model, data, Constrained(within, prior))
    later = project(fit(model, data), prior, Metric.of_data(model, data), within)
    np.testing.assert_allclose(direct.values, later.values, rtol=1e-2, atol=1e-3)


def links_of(estimate: Estimate) -> np.ndarray:
    assert estimate.links is not None
    return np.concatenate(list(estimate.links.values()))


@pytest.mark.parametrize("solver", SOLVERS)
def test_links_are_possible_and_the_answer_the_optimum(model, truth, solver) -> None:
    for consistency in ("full", "semi"):
        method = Constrained(Within(consistency), Prior(model.robot, spread=3.0), solver)
        found = fit(model, poor(model, truth, 5), method)
        proof = found.certificate
        assert proof is not None and proof.optimal
        assert proof.gap <= (1e-6 if solver == "conic" else OPTIMAL)
        assert found.links is not None
        for phi in found.links.values():
            assert least(phi, consistency) >= -1e-9
        if consistency == "full":
            assert all(
                margins(link.phi).consistent for link in found.robot.links if link.name != "base"
            )
        rigid = len(model.base.independent)
        base = model.base.coordinates(found.robot.theta)
        np.testing.assert_allclose(found.values[:rigid], base, rtol=1e-9, atol=1e-11)
        assert np.all(found.values[rigid:] >= -1e-9), "friction opposes motion"


@pytest.mark.slow
def test_held_out_motion_is_predicted_better_than_by_least_squares(model, truth) -> None:
    """Of poorly exciting noisy data, with a description that is off by a tenth."""
    better = 0
    t, q, v, a = smooth_motion(3, 99, 50.0, 8.0, 8.0, 1.0)
    block = model.block(t, q, v, a)
    want = model.torque(block, truth)
    for seed in range(20):
        data = poor(model, truth, seed)
        prior = Prior(off_description(model, seed))
        errors = [
            np.linalg.norm(model.torque(block, fit(model, data, method).values) - want)
            for method in (LeastSquares(), Constrained(prior=prior))
        ]
        better += errors[1] < errors[0]
    assert better >= 16


@pytest.mark.parametrize("solver", SOLVERS)
def test_further_sets_hold(model, truth, solver) -> None:
    mass = sum(link.phi[0] for link in model.robot.links)
    sets = (Known("Fv@j1", 0.2), TotalMass(mass - 0.01, mass + 0.01), Bounds("m.l2", 3.0))
    found = fit(model, poor(model, truth, 4), Constrained(Within("full", sets), solver=solver))
    assert found.value("Fv@j1") == pytest.approx(0.2, abs=1e-7)
    assert found.links is not None
    masses = [phi[0] for phi in found.links.values()]
    assert sum(masses) == pytest.approx(mass, abs=0.01 + 1e-6)
    assert found.links["l2"][0] >= 3.0 - 1e-6
    assert found.certificate is not None and found.certificate.optimal
    with pytest.raises(FitError, match=r"no robot satisfies.*"):
        fit(model, poor(model, truth, 4), Constrained(Within("full", (TotalMass(-2.0, -1.0),))))


def test_the_covariance_is_along_the_active_constraints_only(model, truth) -> None:
    data = poor(model, truth, 4)
    prior = Prior(model.robot, spread=3.0)
    # Of independent errors, for which least squares is efficient: only then is this so for all.
    known = Within("full", (Known("Fv@j1", 0.2),))
    held = fit(model, data, Constrained(known, prior, errors="independent"))
    free = fit(model, data, Constrained(Within("none"), prior, errors="independent"))
    for one in (held, free):
        values = np.linalg.eigvalsh(one.covariance)
        assert values[0] >= -1e-12 * values[-1] and values[-1] > 0
    index = held.names.index("Fv@j1")
    np.testing.assert_allclose(held.covariance[index], 0.0, atol=1e-15)
    assert free.covariance[index, index] > 0
    more = np.linalg.eigvalsh(free.covariance - held.covariance)
    assert more[0] >= -1e-9 * more[-1], "constraints add no uncertainty"
    told = " ".join(held.notes)
    assert "on the boundary" in told and "1 other constraints" in told
    assert any("No constraint is active" in note for note in free.notes)


def test_data_and_prior_together_know_more_than_the_data(model, truth) -> None:
    data = Dataset((synthetic(model, truth, 7, rate_hz=100.0, torque_std=0.3),), QUIET)
    alone = fit(model, data, LeastSquares())
    narrow, wide = (
        fit(model, data, Constrained(Within("none"), Prior(model.robot, spread=spread)))
        for spread in (0.1, 1e3)
    )
    assert any("No constraint is active" in note for note in wide.notes)
    sigma = [np.sqrt(np.diag(one.covariance)) for one in (narrow, wide, alone)]
    np.testing.assert_allclose(sigma[1], sigma[2], rtol=0.02)
    assert np.all(sigma[0] < sigma[1]) and np.any(sigma[0] < 0.8 * sigma[1])


def test_it_is_compared_with_projecting_later(constrained: Estimate) -> None:
    told = next(note for note in constrained.notes if note.startswith("Torque error"))
    for words in ("this fit", "without constraints", "under X'X", "link by link"):
        assert words in told
    assert "constrained least squares" in constrained.method
    assert "lower bound" in constrained.summary()


def test_weighting_none_takes_joints_as_equally_noisy(model, truth) -> None:
    data = poor(model, truth, 3).of_joints(model.robot.names)
    plain = fit(model, data, Constrained(weighting="none"))
    weighted = fit(model, data, Constrained())
    assert plain.certificate is not None and plain.certificate.optimal
    assert not np.allclose(plain.values, weighted.values, rtol=1e-6)
    assert not plain.inconsistent_links()


def test_estimates_are_saved_with_their_links(constrained: Estimate, tmp_path: Path) -> None:
    loaded = load_estimate(constrained.save(tmp_path / "fit.json"))
    assert constrained.links is not None and loaded.links is not None
    for name, phi in constrained.links.items():
        np.testing.assert_array_equal(loaded.links[name], phi)
    np.testing.assert_array_equal(loaded.values, constrained.values)
    np.testing.assert_array_equal(loaded.robot.theta, constrained.robot.theta)
    again = project(loaded)
    np.testing.assert_array_equal(again.values, constrained.values)


def test_a_constrained_estimate_can_be_projected_onto_less(model, truth) -> None:
    """Also where a constraint held parameters, of which there is no variance then."""
    within = Within("full", (Known("Fv@j1", 0.2),))
    found = fit(model, poor(model, truth, 4), Constrained(within))
    same = project(found, within=within)
    np.testing.assert_array_equal(same.values, found.values)
    mass = sum(phi[0] for phi in (found.links or {}).values())
    heavier = Within("full", (*within.sets, TotalMass(mass + 1, mass + 1)))
    moved = project(found, within=heavier)
    assert sum(link.phi[0] for link in moved.robot.links) == pytest.approx(mass + 1, abs=1e-6)
    assert moved.estimate.value("Fv@j1") == pytest.approx(0.2, abs=1e-7)
    assert moved.certificate.optimal
