"""How well each combination of a model's parameters is known: the metric of a projection."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.sampling import rows
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset
from dynident.threads import single_threaded

_NOTHING = 1e-12  # of the largest information: less is rounding
_HELD = 1e-3  # of what all data together know of a parameter alone


@dataclass(frozen=True, eq=False)
class Metric:
    """The quadratic form |R (values - estimate)|^2 on a model's parameters, in units of noise.

    R'R is X'X over the variance of the torque noise: what a data set knows (Ting et al., RSS 2006,
    equation 8). A projection under it moves the parameters where the data do not mind.

    Attributes
    ----------
    R : (r, p).
    names : (p,) the model's parameters.
    rows : number of equations behind it.
    source : where it comes from, in words.
    irrelevant : names of parameters found irrelevant: they stay at zero.
    notes : caveats.
    """

    R: np.ndarray
    names: tuple[str, ...]
    _: KW_ONLY
    rows: int
    source: str
    irrelevant: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @staticmethod
    def of_matrix(
        M: ArrayLike, names: tuple[str, ...], noise_std: float = 1.0, rows: int = 0
    ) -> Metric:
        """The metric M = X'X of rows that have noise of the same standard deviation.

        Parameters
        ----------
        M : (p, p) array_like
            Symmetric, without negative eigenvalues beyond rounding.
        names : of the parameters.
        noise_std : of the equations, N m or N.
        rows : number of equations.

        Returns
        -------
        The metric whose R'R is M over the variance of the noise.

        Raises
        ------
        FitError
            If M is no such matrix.
        """
        M = np.asarray(M, dtype=float)
        if M.shape != (len(names), len(names)) or not np.all(np.isfinite(M)):
            raise FitError(f"a metric of shape {M.shape} does not fit {len(names)} parameters")
        remedy = "it must be X'X of some data, or Metric.corrected"
        size = np.sqrt(np.abs(np.diag(M)))
        if np.any(np.abs(M - M.T) > 1e-8 * np.outer(size, size)):
            raise FitError("the metric is not symmetric", remedy=remedy)
        root, lost = _root(M, size)
        if lost > 1e-8:
            what = f"the metric has a negative direction ({lost:.1g} of the largest)"
            raise FitError(what, remedy=remedy)
        if not 0 < noise_std < np.inf:
            raise FitError(f"noise_std = {noise_std:g}", remedy="choose it above 0")
        return Metric(root / noise_std, tuple(names), rows=rows, source="given matrix")

    @staticmethod
    def of_estimate(estimate: Estimate) -> Metric:
        """The information that an estimate has: the inverse of its covariance.

        Raises
        ------
        FitError
            If it has no covariance.
        """
        kept = list(estimate.basis.independent)
        covariance = estimate.covariance[np.ix_(kept, kept)]
        std = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
        if not len(kept) or not np.any(std > 0):
            what = "the estimate has no covariance to take a metric from"
            raise FitError(what, remedy="give a metric: Metric.of_data(model, recordings)")
        # What a constraint holds has no variance: it is known better than by any data.
        std = np.where(std > 0, std, _HELD / estimate.basis.scale[kept])
        covariance = covariance + np.diag(np.where(np.diag(covariance) > 0, 0.0, std**2))
        values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
        values = np.maximum(values, _NOTHING * values[-1])
        information = (vectors / np.sqrt(values)).T / std
        R = information @ estimate.basis.combination
        return Metric(R, estimate.names, rows=estimate.rows, source="covariance of the estimate")

    @staticmethod
    @single_threaded
    def of_data(model: Model, dataset: Dataset, values: np.ndarray | None = None) -> Metric:
        """Return the metric of recordings: X'X, each joint in units of its residual.

        Parameters
        ----------
        model : its p parameters are those of the metric.
        dataset : the recordings, with their filter.
        values : (p,) at which columns that depend on the predicted torque are taken.

        Raises
        ------
        FitError
            As `solve_factors`.
        """
        factors = factorise(rows(model, dataset.of_joints(model.robot.names), values))
        solution = solve_factors(model, factors)
        p = model.size
        R = factors.pooled(1.0 / solution.torque_std)[:p, :p]
        return Metric(R, model.names, rows=factors.rows, source="X'X of the recordings")

    @cached_property
    def matrix(self) -> np.ndarray:
        """M = R'R, (p, p)."""
        return self.R.T @ self.R

    @cached_property
    def rank(self) -> int:
        """Number of combinations of parameters that it knows (columns of unit norm, 1e-8)."""
        size = np.linalg.norm(self.R, axis=0)
        values = np.linalg.svd(self.R / np.where(size > 0, size, 1.0), compute_uv=False)
        return int(np.sum(values > 1e-8 * values.max(initial=0.0)))

    def corrected(self, input_noise: ArrayLike) -> Metric:
        """The metric of noiseless inputs, M - N Psi.

        The X'X that was observed contains what noise of the inputs (positions, and hence the
        regressor) adds to it; for prediction from noiseless inputs that has to come off.

        Parameters
        ----------
        input_noise : (p, p) array_like
            N Psi: the expected X'X of the inputs' noise alone, in units of noise as M is, see
            `fit.input_noise`.

        Raises
        ------
        FitError
            If its shape is wrong.

        Notes
        -----
        Where more is taken off than was there, nothing is known: those directions get weight
        zero, and a note says how many they are.
        """
        noise = np.asarray(input_noise, dtype=float)
        if noise.shape != self.matrix.shape or not np.all(np.isfinite(noise)):
            what = f"input noise of shape {noise.shape} for {len(self.names)} parameters"
            raise FitError(what, remedy="give the (p, p) matrix N Psi")
        difference = self.matrix - noise
        size = np.sqrt(np.diag(self.matrix))
        size[size == 0] = 1.0
        negative = int(np.sum(np.linalg.eigvalsh(difference / np.outer(size, size)) < -1e-9))
        notes = self.notes
        if negative:
            notes = (
                *notes,
                f"In {negative} of {len(size)} directions the inputs hold no more than their "
                "noise: the metric there is zero, and the prior decides.",
            )
        root, _ = _root(difference, size)
        return replace(self, R=root, source=f"{self.source}, less input noise", notes=notes)

    def weighted(self, relevance: ArrayLike) -> Metric:
        """The metric W M W with a weight for each parameter, as the slides have it.

        Parameters
        ----------
        relevance : (p,) array_like
            1 for relevant parameters, 0 for those found irrelevant, which stay at zero.

        Raises
        ------
        FitError
            If a weight is negative, or their number is wrong.
        """
        weights = np.asarray(relevance, dtype=float)
        if weights.shape != (len(self.names),) or not np.all(weights >= 0):
            what = f"relevance weights of shape {weights.shape} for {len(self.names)} parameters"
            raise FitError(what, remedy="give one weight of at least 0 for each")
        off = tuple(name for name, w in zip(self.names, weights, strict=True) if w == 0)
        source = f"{self.source}, weighted by relevance"
        return replace(self, R=self.R * weights, source=source, irrelevant=off)


def _root(M: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, float]:
    """R with R'R = M where M is not negative, and the most negative eigenvalue, relative.

    What is negative is decided in units of the columns' size (p,): a parameter of which a
    correction leaves next to nothing would otherwise be blown up, and what it shares with others.
    """
    size = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(0.5 * (M + M.T) / np.outer(size, size))
    lost = float(-values[0] / max(values[-1], np.finfo(float).tiny))
    return (vectors * np.sqrt(np.clip(values, 0.0, None))).T * size, lost
