"""The metric of a projection: what data know, less input noise, weighted by relevance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chains import (
    QUIET,
    noisy_estimate,
    recorded,
)
from dynident.constraints import ParameterSpace
from dynident.errors import FitError
from dynident.fitting import Estimate, Metric, Prior, given_estimate, project
from dynident.recording import Dataset

# --- the metric ----------------------------------------------------------------------------------


def test_the_metric_of_an_estimate_is_that_of_its_data(chain_estimate: Estimate) -> None:
    robot = chain_estimate.model.robot
    data = Dataset((recorded(robot),), QUIET)
    one = Metric.of_estimate(chain_estimate)
    other = Metric.of_data(chain_estimate.model, data)
    assert one.rank == other.rank == len(chain_estimate.basis.independent)
    size = np.sqrt(np.diag(other.matrix))
    # The covariance is scaled by the residual once more: of weighted equations, nearly one.
    np.testing.assert_allclose(
        one.matrix / np.outer(size, size), other.matrix / np.outer(size, size), atol=0.05
    )
    a, b = (project(chain_estimate, metric=m) for m in (one, other))
    np.testing.assert_allclose(a.values, b.values, atol=0.05 * np.max(np.abs(a.values)))
    assert a.misfit == pytest.approx(b.misfit, rel=0.1)


def test_a_full_metric_over_all_standard_parameters() -> None:
    """Of full rank, what is nearest is the same whatever the prior believes."""
    model, _, x_hat = noisy_estimate(3, 1, 0.1, 100)
    space = ParameterSpace.of(model)
    rows = np.random.default_rng(0).normal(size=(60, space.size)) / space.scale * 1e4
    metric = Metric.of_matrix(rows.T @ rows, space.names, rows=60)
    estimate = given_estimate(model.robot, model)
    bodies = {f"l{k}": x_hat[10 * k : 10 * k + 10] for k in range(3)}
    values = np.concatenate([model.base.coordinates(x_hat[:30]), x_hat[30:]])
    estimate = replace(estimate, links=bodies, values=values)
    found = project(estimate, metric=metric)
    other = project(estimate, Prior(model.robot, "quadratic", 3.0), metric)
    np.testing.assert_allclose(found.x, other.x, atol=1e-5)
    assert found.misfit is not None and found.misfit > 0
    assert "of the noise" in str(found.changes())
    step = rows @ (found.x - x_hat)
    assert found.misfit == pytest.approx(np.linalg.norm(step) / np.sqrt(60), rel=1e-6)


def test_input_noise_comes_off_the_metric() -> None:
    """X'X of rows with noise is X'X without, plus N Psi: that is taken off again."""
    rng = np.random.default_rng(2)
    names = ("a", "b", "c")
    clean = rng.normal(size=(20000, 3)) * [1.0, 0.5, 2.0]
    Psi = np.diag([0.3, 0.0, 0.1])
    noisy = clean + rng.normal(size=clean.shape) * np.sqrt(np.diag(Psi))
    metric = Metric.of_matrix(noisy.T @ noisy, names, noise_std=0.1, rows=len(clean))
    corrected = metric.corrected(len(clean) * Psi / 0.1**2)
    want = clean.T @ clean / 0.1**2
    np.testing.assert_allclose(corrected.matrix, want, atol=0.02 * np.max(want))
    assert abs(metric.matrix[0, 0] / want[0, 0] - 1.3) < 0.02, "it was there"
    assert not corrected.notes and "less input noise" in corrected.source


def test_more_noise_than_signal_is_noted_and_leaves_the_rest_alone() -> None:
    M = np.array([[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 4.0]])
    metric = Metric.of_matrix(M, ("a", "b", "c"))
    for taken in (1.0 - 1e-12, 1.0, 1.5, 10.0):
        left = metric.corrected(np.diag([taken, 0.0, 0.0]))
        assert "1 of 3 directions" in left.notes[0] and "prior decides" in left.notes[0]
        assert np.linalg.eigvalsh(left.matrix)[0] >= -1e-12
        assert left.matrix[2, 2] == pytest.approx(4.0)
        assert left.matrix[1, 1] == pytest.approx(1.0, abs=0.02)
        assert left.matrix[0, 0] < 0.02
    with pytest.raises(FitError, match="N Psi"):
        metric.corrected(np.eye(2))


def test_what_is_irrelevant_stays_at_zero(chain_estimate: Estimate) -> None:
    names = chain_estimate.names
    off = ("Fv@j1", next(n for n in names if n.startswith("Ixy")))
    weights = [0.0 if name in off else 1.0 for name in names]
    metric = Metric.of_estimate(chain_estimate).weighted(weights)
    assert metric.irrelevant == tuple(n for n in names if n in off)
    found = project(chain_estimate, metric=metric)
    for name in off:
        assert abs(chain_estimate.value(name)) > 1e-3
        assert found.estimate.value(name) == pytest.approx(0.0, abs=1e-9)
    assert found.certificate.optimal and not found.estimate.inconsistent_links()
    assert any("kept at zero" in note for note in found.notes)
    for wrong in (np.ones(2), -np.ones(len(names)), np.full(len(names), np.nan)):
        with pytest.raises(FitError, match="relevance"):
            Metric.of_estimate(chain_estimate).weighted(wrong)


@pytest.mark.parametrize(
    ("M", "words"),
    [
        (np.eye(3), r"shape \(3, 3\) does not fit 2"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "does not fit"),
        (np.array([[1.0, 0.5], [0.0, 1.0]]), "not symmetric"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "negative direction.*X'X"),
        (np.diag([1.0, -1.0]), "negative direction"),
    ],
)
def test_matrices_that_are_no_metric_are_refused(M, words) -> None:
    with pytest.raises(FitError, match=words):
        Metric.of_matrix(M, ("a", "b"))


def test_metrics_of_something_else_are_refused(chain_estimate: Estimate) -> None:
    p = len(chain_estimate.names)
    others = tuple(f"x{k}" for k in range(p))
    for metric in (Metric.of_matrix(np.eye(2), ("a", "b")), Metric.of_matrix(np.eye(p), others)):
        with pytest.raises(FitError, match="not those of the estimate"):
            project(chain_estimate, metric=metric)
    with pytest.raises(FitError, match="no covariance"):
        Metric.of_estimate(given_estimate(chain_estimate.model.robot))
    with pytest.raises(FitError, match="noise_std"):
        Metric.of_matrix(np.eye(2), ("a", "b"), noise_std=0.0)
