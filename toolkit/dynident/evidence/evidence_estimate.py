"""The fit of a diagnosis as an `Estimate`: sigma holds its shapes, its widths and its noise."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from dynident.errors import FitError
from dynident.evidence.evidence import Evidence, noise_source
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_recordings
from dynident.evidence.model_columns import rows_of_run
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import sources_of
from dynident.fitting.uncertainty.granted_effects import with_granted_effects
from dynident.fitting.uncertainty.row_errors import row_covariance
from dynident.fitting.uncertainty.shape_errors import with_shape_errors
from dynident.model import Model
from dynident.moments.factors import RANK_TOLERANCE
from dynident.recording import Dataset
from dynident.recording.dataset import NoiseSource
from dynident.robot import base_parameters

_METHODS: dict[NoiseSource, str] = {
    "replicates": "instrumental variables from the repeated periods, noise whitened",
    "given": "least squares corrected for the stated noise, noise whitened",
    "unknown": "least squares, weighted per joint",
}
_WHITENED = "sigma holds the noise, with its colour; what the model lacks is not in it."


def estimate_of(evidence: Evidence, fitted: EvidenceFit, train: Dataset) -> Estimate:
    """Return the fit as an `Estimate` that takes no shape and no friction width as known.

    Parameters
    ----------
    evidence : of the training recordings.
    fitted : a model as it fits them.
    train : these recordings, for the filter of their rows and their provenance.
    """

    def again(wider: Model) -> Estimate:
        return _estimate(evidence, fit_evidence(evidence, wider, fitted), train)

    given, own = evidence.model.friction_widths, fitted.model.friction_widths
    sought = [
        joint
        for joint, stated, found in zip(fitted.model.robot.names, given, own, strict=True)
        if found != stated
    ]
    found = with_shape_errors(_estimate(evidence, fitted, train), again, sought)
    return with_granted_effects(found, again)


def _estimate(evidence: Evidence, fitted: EvidenceFit, train: Dataset) -> Estimate:
    """The fit of the diagnosis as an `Estimate`, at the shapes and widths that it has."""
    judged = on_recordings(evidence, fitted)
    model = fitted.model
    # Rows that span what the data show: not the directions in which the columns are noise.
    shown = fitted.solution.basis.T @ fitted.pooled.gram
    basis = base_parameters(shown, model.names, RANK_TOLERANCE)
    kept, combination = list(basis.independent), basis.combination
    covariance = np.zeros((model.size, model.size))
    whole, words = fitted.covariance, _WHITENED if fitted.noise_known else ""
    measured = all(run.columns_from == "recording" for run in evidence.runs)
    if measured and not fitted.noise_known:
        # Nothing has whitened these rows: their errors hang together as the filters make them.
        recordings = tuple(run.recording for run in evidence.runs)
        with suppress(FitError):
            whole, errors = row_covariance(
                model,
                replace(train, recordings=recordings),
                fitted.values,
                [run.certain_rows for run in evidence.runs],
                lambda run: rows_of_run(evidence, model, run, fitted.values),
            )
            words = errors.words
    covariance[np.ix_(kept, kept)] = combination @ whole @ combination.T
    return Estimate(
        model=model,
        values=basis.lift(basis.coordinates(fitted.values), model.given_values()),
        covariance=covariance,
        basis=basis,
        torque_std=judged.residual_rms,
        joint_errors=judged.joint_errors,
        error=judged.error,
        condition_number=float(np.linalg.cond(shown[:, kept])),
        rows=fitted.rows,
        method=_method(evidence),
        status="solved",
        notes=(),
        sources=sources_of(train),
        sigma_words=words,
    )


def _method(evidence: Evidence) -> str:
    """How the model was fitted, in words."""
    if evidence.runs[0].columns_from == "simulation":
        return "instrumental variables from the simulated closed loop"
    return _METHODS[noise_source(evidence, None)]
