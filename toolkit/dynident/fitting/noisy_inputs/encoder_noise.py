"""Noise of the encoders, carried through filter, differentiation and regressor."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.errors import FitError
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.noisy_inputs.measured import InputNoise
from dynident.fitting.reversals.standing_joints import without_stops
from dynident.fitting.sampling import rows, sample
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset, Recording, uniform
from dynident.threads import single_threaded


@single_threaded
def encoder_noise(
    model: Model,
    dataset: Dataset,
    values: np.ndarray | None = None,
    *,
    draws: int = 4,
    seed: int = 0,
) -> InputNoise:
    """Carry the stated noise of the encoders into the columns of the regression.

    Noise is drawn anew onto the filtered positions and goes the way of the measurement: low-pass,
    differences, regressor, low-pass, decimation. What it changes in the columns is the input
    noise, summed along the trajectory, with whatever the filters make of its colour.

    It is exact to first order, where what the filter left of the recording's own noise does not
    matter. In a closed loop the robot moves with a part of the noise; that part is not independent
    of the torque, as `CorrectedLeastSquares` has it.

    Parameters
    ----------
    model : its columns.
    dataset : recordings with their stated noise.
    values : (p,) at which columns that depend on the fit are taken.
    draws : realisations for each recording.
    seed : of the draws.

    Returns
    -------
    The noise of the p columns, summed over all rows.

    Raises
    ------
    FitError
        If no noise of the positions is stated.
    """
    stated = dataset.noise
    if stated is None:
        remedy = "state position_std in [noise], or take the noise from repetitions"
        raise FitError("the noise of the encoders is not stated", remedy=remedy)
    rng = np.random.default_rng(seed)
    dataset = without_stops(model, dataset)
    factors = factorise(rows(model, dataset, values))
    std = solve_factors(model, factors).torque_std
    p = model.size
    total = factors.pooled(1.0 / std)[:p, :p]
    gram = np.zeros((p, p))
    for recording in dataset.recordings:
        smooth = _smooth(recording, dataset)
        clean = list(_columns(model, smooth, dataset, values))
        for _ in range(draws):
            noise = stated.position_std * rng.standard_normal(smooth.q.shape)
            noisy = _columns(model, smooth.replace(q=smooth.q + noise), dataset, values)
            for one, other in zip(clean, noisy, strict=True):
                difference = ((other - one) / std[:, None]).reshape(-1, p)
                gram += difference.T @ difference / draws
    size = np.sum(total**2, axis=0)
    share = np.divide(np.diag(gram), size, out=np.zeros(p), where=size > 0)
    return InputNoise(gram, share, model.names, factors.rows)


def _smooth(recording: Recording, dataset: Dataset) -> Recording:
    """Return the recording with its filtered positions, as near as it comes to the true ones."""
    recording = uniform(recording)
    motion = sample(recording, dataset.filter).motion
    q = np.array(recording.q)
    q[motion.first : motion.first + motion.samples] = motion.q
    return recording.replace(q=q)


def _columns(
    model: Model, recording: Recording, dataset: Dataset, values: np.ndarray | None
) -> Iterator[np.ndarray]:
    return sample(recording, dataset.filter).columns(model, values)
