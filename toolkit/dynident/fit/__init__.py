"""Estimators: from a model and recordings to an `Estimate`."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from dynident.fit.constrained import Constrained
from dynident.fit.encoder_noise import encoder_noise
from dynident.fit.essential import EssentialParameters, essential_parameters
from dynident.fit.estimate import Estimate, Source
from dynident.fit.estimate_file import load_estimate
from dynident.fit.factors import Factors, factorise
from dynident.fit.given import given_estimate
from dynident.fit.history import Convergence
from dynident.fit.input_noise import InputNoise, input_noise
from dynident.fit.instrumental import IV, Filtered, SimulatedLoop, SwappedPeriods
from dynident.fit.least_squares import LeastSquares, Solution, solve_factors
from dynident.fit.metric import Metric
from dynident.fit.parameter_file import GivenParameters, read_parameters
from dynident.fit.prior import Prior
from dynident.fit.projection import Projection, project
from dynident.fit.regression import Regression
from dynident.fit.sampling import Sampled, rows, sample
from dynident.fit.shapes import refine_shapes, shaped_effects
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.threads import single_threaded


class Method(Protocol):
    """An estimator: it fits a model whose shape parameters are fixed."""

    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit the model to the recordings."""
        ...


@single_threaded
def fit(model: Model, data: Dataset | Recording, method: Method | None = None) -> Estimate:
    """Identify the parameters of a model.

    Shape parameters of effects are refined first, by variable projection; the linear parameters
    follow from the method.

    Parameters
    ----------
    model : the robot and its effects.
    data : recordings with their filter; a single recording takes the default filter.
    method : default: least squares, weighted per joint.

    Raises
    ------
    FitError
        If the data cannot carry the model.
    RecordingError
        If a recording does not suit its filter.
    """
    dataset = Dataset((data,)) if isinstance(data, Recording) else data
    method = method or LeastSquares()
    if not shaped_effects(model):
        return method.fit(model, dataset)
    shaped = refine_shapes(model, dataset)
    estimate = method.fit(shaped.model, dataset)
    return replace(estimate, status=f"{estimate.status}, {shaped.status}")


__all__ = [
    "IV",
    "Constrained",
    "Convergence",
    "EssentialParameters",
    "Estimate",
    "Factors",
    "Filtered",
    "GivenParameters",
    "InputNoise",
    "LeastSquares",
    "Method",
    "Metric",
    "Prior",
    "Projection",
    "Regression",
    "Sampled",
    "SimulatedLoop",
    "Solution",
    "Source",
    "SwappedPeriods",
    "encoder_noise",
    "essential_parameters",
    "factorise",
    "fit",
    "given_estimate",
    "input_noise",
    "load_estimate",
    "project",
    "read_parameters",
    "refine_shapes",
    "rows",
    "sample",
    "shaped_effects",
    "solve_factors",
]
