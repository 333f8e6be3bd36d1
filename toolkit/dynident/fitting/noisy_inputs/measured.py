"""Noise of the inputs: what noisy positions add to X'X, measured on a repeated motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.errors import FitError
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.reversals.standing_joints import without_stops
from dynident.fitting.sampling import rows, sample
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset, periods
from dynident.threads import single_threaded


@dataclass(frozen=True, eq=False)
class InputNoise:
    """What noise of the inputs adds to X'X.

    Attributes
    ----------
    gram : (p, p) N Psi, in units of the torque noise as `Metric.matrix` is.
    share : (p,) of each parameter's squared column: how much of it is noise.
    names : of the parameters.
    rows : equations, N: of all joints.
    """

    gram: np.ndarray
    share: np.ndarray
    names: tuple[str, ...]
    rows: int

    def per_row(self, names: tuple[str, ...]) -> np.ndarray:
        """Return Psi, the covariance of one row's noise, (p, p).

        Raises
        ------
        FitError
            If it belongs to other parameters.
        """
        if names != self.names:
            what = f"the input noise is that of {len(self.names)} other parameters"
            raise FitError(what, remedy="take it from the model that is fitted")
        return self.gram / self.rows


@single_threaded
def input_noise(model: Model, dataset: Dataset, values: np.ndarray | None = None) -> InputNoise:
    """Estimate the input noise from recordings whose excitation repeats.

    Two repetitions of the same motion have the same noiseless columns, so that half the Gram
    matrix of their difference is the noise of either. In a closed loop the robot answers the
    noise: what it truly does differently each time is counted as noise, and overstates it.

    Parameters
    ----------
    model : its columns.
    dataset : recordings, of which some state a period.
    values : (p,) at which columns that depend on the fit are taken.

    Returns
    -------
    The noise of the p columns, scaled up to all rows.

    Raises
    ------
    FitError
        If no recording repeats.
    """
    dataset = without_stops(model, dataset)
    factors = factorise(rows(model, dataset, values))
    std = solve_factors(model, factors).torque_std
    p = model.size
    total = factors.pooled(1.0 / std)[:p, :p]
    gram, seen, used = np.zeros((p, p)), 0, 0
    for recording in dataset.recordings:
        sampled = sample(recording, dataset.filter)
        columns = np.concatenate(list(sampled.columns(model, values)))
        used += int(sampled.counting.sum())
        if recording.period is None:
            continue
        folded = periods(len(columns), sampled.rate_hz, recording.period, recording.where)
        if folded.count < 2:
            continue
        # Rows that do not count in one repetition tell nothing of the noise in the others.
        counting = np.asarray(folded.fold(sampled.counting).all(axis=0))
        repeated = folded.fold(columns / std[:, None]) * counting[:, :, None]
        difference = (repeated - repeated.mean(axis=0)).reshape(-1, p)
        # P repetitions around their own mean hold P - 1 times the noise.
        gram += difference.T @ difference * folded.count / (folded.count - 1)
        seen += folded.count * int(counting.sum())
    if not seen:
        raise FitError("no recording repeats", remedy="state its period, or give the input noise")
    gram *= used / seen
    size = np.sum(total**2, axis=0)
    share = np.divide(np.diag(gram), size, out=np.zeros(p), where=size > 0)
    return InputNoise(gram, share, model.names, factors.rows)
