"""Linear least squares as a method of `fit`, ordinary or weighted per joint."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from dynident.arguments import checked
from dynident.clusters import over_recordings
from dynident.errors import FitError
from dynident.fitting.estimate import DataSource, Estimate
from dynident.fitting.fixed_point import FixedPoint, not_converged
from dynident.fitting.linear_solution import LinearSolution, solve_factors
from dynident.fitting.sampling import sample
from dynident.fitting.uncertainty.expected_bias import held
from dynident.fitting.uncertainty.input_bias import input_bias
from dynident.fitting.uncertainty.lack_of_fit import lack_of_fit, scattered, widened
from dynident.fitting.uncertainty.lagged_rows import factors_with_columns, lagged_columns
from dynident.fitting.uncertainty.row_errors import row_errors
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, combine, factorise
from dynident.recording import (
    Dataset,
    Filter,
    Recording,
    RowCount,
    count_rows,
    default_filter,
    rows_in_words,
    uniform,
)
from dynident.threads import single_threaded

_ROUNDS = 30  # of columns that depend on the model's own values, until they settle
_TOLERANCE = 1e-9


@checked
@dataclass(frozen=True)
class LeastSquares:
    """Least squares for models that are linear in their parameters.

    Attributes
    ----------
    weighting : "joint" divides each joint's rows by the standard deviation of its residual in the
        ordinary fit (weighted least squares of the identification literature); "none" is ordinary
        least squares.
    errors : "correlated" measures how the errors of rows hang together, for rows behind a low-pass
        do, and takes one more pass over them; "independent" is the textbook's covariance, as in
        published tables.
    """

    weighting: Literal["joint", "none"] = "joint"
    errors: Literal["correlated", "independent"] = "correlated"
    name: ClassVar[str] = "least squares"

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are what they are.

        Raises
        ------
        FitError
            If there are fewer equations than parameters, or the torque is zero throughout.
        """
        estimate, solution = self.without_bias(model, dataset)
        return estimate if self.errors == "independent" else with_bias(estimate, dataset, solution)

    @single_threaded
    def without_bias(self, model: Model, dataset: Dataset) -> tuple[Estimate, LinearSolution]:
        """As `fit`, before the bias that noise of the positions leaves is in sigma.

        Returns
        -------
        The estimate, and the solution that it is of.
        """
        if not dataset.recordings:
            raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
        columns = None
        if self.errors == "correlated" and not model.needs_values:
            columns = lagged_columns(dataset)
            factors = factors_with_columns(model, dataset, columns)
        else:
            factors = _factors(model, dataset)
        solution = solve_factors(model, factors, self.weighting)
        if model.needs_values:
            model, factors, solution = self._iterate(model, dataset, solution.values)
        estimate = estimate_of(self.name, self.weighting, model, dataset, factors, solution)
        if self.errors == "independent":
            return estimate, solution
        found = row_errors(model, dataset, solution.values, solution, columns)
        covariance, words, headline = found.covariance, found.words, ""
        judged = lack_of_fit(model, dataset, solution.values)
        if judged is not None:
            headline = judged.headline
        if judged is not None and judged.beyond_noise:
            other, words = scattered(model, dataset, solution.values, solution)
            covariance = widened(covariance, other)
        kept = list(solution.basis.independent)
        whole = np.zeros_like(solution.covariance)
        whole[np.ix_(kept, kept)] = covariance
        estimate = replace(estimate, covariance=whole, sigma_words=words, headline=headline)
        return estimate, solution

    def _iterate(
        self, model: Model, dataset: Dataset, values: np.ndarray
    ) -> tuple[Model, TriangularFactors, LinearSolution]:
        """Fit with columns at the values fitted before, until both agree."""
        fixed_point = FixedPoint()
        for _ in range(_ROUNDS):
            model = model.at(values)
            factors = _factors(model, dataset, values)
            solution = solve_factors(model, factors, self.weighting)
            change = np.linalg.norm(solution.values - values) / np.linalg.norm(values)
            if change <= _TOLERANCE:
                break
            values = fixed_point.following(model, values, solution.values)
        else:
            solution = replace(solution, notes=(*solution.notes, not_converged(float(change))))
        return model.at(solution.values), factors, solution


def _factors(model: Model, dataset: Dataset, values: np.ndarray | None = None) -> TriangularFactors:
    """Factors of all rows, with columns that depend on the fitted model at values (p,)."""
    return combine(
        [*over_recordings(dataset.recordings, _factors_of, model, dataset.filter, values)]
    )


def _factors_of(
    recording: Recording, model: Model, settings: Filter | None, values: np.ndarray | None
) -> TriangularFactors:
    """Factors of a recording's rows."""
    return factorise(sample(recording, settings).rows(model, values))


def with_bias(estimate: Estimate, dataset: Dataset, solution: LinearSolution) -> Estimate:
    """Return an estimate whose sigma holds the bias that noise of the positions leaves.

    Parameters
    ----------
    estimate, solution : of `LeastSquares.without_bias`.
    dataset : what was fitted.

    Returns
    -------
    The same where the recordings are too short to tell.
    """
    bias = input_bias(estimate.model, dataset, solution.values, solution, estimate.sigma)
    if bias is None:
        return estimate
    notes = (*estimate.notes, bias.note) if bias.note else estimate.notes
    return replace(
        estimate,
        covariance=held(estimate.covariance, bias.values),
        sigma_words=bias.words(estimate.sigma_words),
        headline=" ".join(filter(None, (estimate.headline, bias.headline))),
        notes=notes,
    )


def estimate_of(
    name: str,
    weighting: str,
    model: Model,
    dataset: Dataset,
    factors: TriangularFactors,
    solution: LinearSolution,
) -> Estimate:
    """Assemble an `Estimate` from a solution.

    Parameters
    ----------
    name : of the method, for the report.
    weighting : "joint" or "none".
    model : that was fitted.
    dataset : whose recordings count.
    factors : of all rows.
    solution : of the same rows.

    Returns
    -------
    With errors as shares of the measured torque.
    """
    norms = factors.torque_norms
    residuals = factors.residual_norms(solution.values)
    words = "ordinary" if weighting == "none" else "weighted per joint"
    return Estimate(
        model=model,
        values=solution.values,
        covariance=solution.covariance,
        basis=solution.basis,
        torque_std=solution.torque_std,
        joint_errors=residuals / np.where(norms > 0, norms, np.nan),
        error=float(np.linalg.norm(residuals) / np.linalg.norm(norms)),
        condition_number=solution.condition_number,
        rows=factors.rows,
        method=f"{name}, {words}",
        status="solved",
        notes=solution.notes,
        sources=sources_of(dataset),
    )


def rows_of_recordings(dataset: Dataset) -> RowCount:
    """Count the decimated rows of a dataset that are used, and those that are not."""
    total = RowCount()
    for recording in dataset.recordings:
        settings = dataset.filter or default_filter(recording.rate_hz)
        total = total + count_rows(uniform(recording), settings)
    return total


def sources_of(dataset: Dataset) -> tuple[DataSource, ...]:
    """The files behind a dataset."""
    found = []
    for recording in dataset.recordings:
        recording = uniform(recording)
        settings = dataset.filter or default_filter(recording.rate_hz)
        file, digest = recording.provenance.file, recording.provenance.sha256
        words = f"{settings.description}; {rows_in_words(recording, settings)}"
        found.append(DataSource(recording.name or file, digest, words))
    return tuple(found)
