"""Estimators: from a model and recordings to an `Estimate`.

In: a `Model` and a `Dataset`. `fit` refines the shape parameters of effects and hands the rest to a
`Method`: `LeastSquares`, `Constrained` (physically consistent links), `IV` (instrumental variables)
or `Regression` (noise in the inputs). Out: an `Estimate`, that prints, saves and writes its robot;
`project` moves one to the nearest possible robot. A new estimator is one class, see `Method`.
"""

from __future__ import annotations

from dynident.fitting.consistent.constrained import Constrained
from dynident.fitting.consistent.metric import Metric
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.projection import Projection, project
from dynident.fitting.essential import EssentialParameters, essential_parameters
from dynident.fitting.estimate import DataSource, Estimate
from dynident.fitting.estimate_file import load_estimate
from dynident.fitting.fit_model import Method, fit
from dynident.fitting.fleet import Fleet, RobotComparison, compare_robots, fit_fleet
from dynident.fitting.given import given_estimate
from dynident.fitting.history import Convergence
from dynident.fitting.instrumental import IV, Filtered, SimulatedLoop, SwappedPeriods
from dynident.fitting.least_squares import LeastSquares
from dynident.fitting.linear_solution import LinearSolution, solve_factors
from dynident.fitting.noisy_inputs import Regression
from dynident.fitting.noisy_inputs.encoder_noise import encoder_noise
from dynident.fitting.noisy_inputs.measured import InputNoise, input_noise
from dynident.fitting.parameter_file import GivenParameters, read_parameters
from dynident.fitting.row_objective import refine_shapes, shaped_effects
from dynident.fitting.sampling import Sampled, rows, sample

__all__ = [
    "IV",
    "Constrained",
    "Convergence",
    "DataSource",
    "EssentialParameters",
    "Estimate",
    "Filtered",
    "Fleet",
    "GivenParameters",
    "InputNoise",
    "LeastSquares",
    "LinearSolution",
    "Method",
    "Metric",
    "Prior",
    "Projection",
    "Regression",
    "RobotComparison",
    "Sampled",
    "SimulatedLoop",
    "SwappedPeriods",
    "compare_robots",
    "encoder_noise",
    "essential_parameters",
    "fit",
    "fit_fleet",
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
