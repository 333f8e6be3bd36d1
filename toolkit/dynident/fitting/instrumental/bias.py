"""The bias that instruments leave: what encoder noise does to columns that bend within it.

E[tanh(v + n)] is not tanh(v): the regressor of dry friction is wrong in the mean, not only in the
single sample, and no instrument removes that. In a loop n is more than the encoder's noise behind
the filters: the robot follows that noise, and trembles at frequencies that the filters then hide.
How much it makes is found by simulating the loop with noise of the measured size, or, where no loop
is known, adding it to the instruments' own motion; their parameters are known, and estimated again.

Sampling leaves a bias of its own: held torques and central differences do not match to the last
digit. Where the instruments come with the torque of their simulation, it is known too.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from dynident.errors import SimulationError
from dynident.fitting.instrumental.normal_equations import InstrumentalSolution
from dynident.fitting.instrumental.simulated_run import SimulatedRun
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import Dataset, Recording

_PAIRS = 3
_SEED = 0


@dataclass(frozen=True, eq=False)
class ExpectedBias:
    """What noise of the encoders does to an estimate in the mean.

    Attributes
    ----------
    values : (p,) mean error of the draws.
    uncertainty : (p,) standard error of that mean.
    sampling : (p,) error of an estimate from the simulated torque and motion, without any noise;
        NaN where the instruments' torque is not simulated.
    """

    values: np.ndarray
    uncertainty: np.ndarray
    sampling: np.ndarray


def expected_bias(
    model: Model,
    values: np.ndarray,
    instruments: Dataset,
    solution: InstrumentalSolution,
    position_std: np.ndarray,
    simulated: np.ndarray | None = None,
    run: SimulatedRun | None = None,
) -> ExpectedBias:
    """Estimate from the instruments' own motion under encoder noise, and average the errors.

    Parameters
    ----------
    model : Model
    values : (p,) the estimate.
    instruments : recordings behind V.
    solution : the estimate's weights.
    position_std : (n,) encoder noise, rad or m.
    simulated : (p,) values whose simulation the instruments are; None where they are none.
    run : the simulation behind the instruments; None where no loop is known.

    Returns
    -------
    The mean error of the estimates under noise, and what sampling alone does.
    """
    kept = list(solution.basis.independent)
    truth = values if simulated is None else simulated
    sums = _Sums(model, solution, 2 * _PAIRS)
    for recording, noisy in zip(
        instruments.recordings, _draws(instruments, position_std, run), strict=True
    ):
        sums.add(recording, instruments, truth, noisy)
    # With the torque V values, the error is -(V' O^-1 W)^-1 V' O^-1 (W - V) values.
    errors = -np.linalg.solve(sums.crossed, sums.shifted[:, :, None])[:, :, 0]
    pairs = errors.reshape(_PAIRS, 2, -1).mean(axis=1)
    bias, uncertainty, sampling = (np.zeros(model.size) for _ in range(3))
    bias[kept] = pairs.mean(axis=0)
    uncertainty[kept] = np.std(pairs, axis=0, ddof=1) / np.sqrt(_PAIRS)
    if simulated is None:
        sampling[:] = np.nan
    else:
        sampling[kept] = np.linalg.solve(sums.crossed.mean(axis=0), sums.sampled)
    return ExpectedBias(bias, uncertainty, sampling)


def _draws(
    instruments: Dataset, position_std: np.ndarray, run: SimulatedRun | None
) -> list[list[Recording]]:
    """Noisy versions of each recording, with the mirror image of each: what is odd cancels."""
    if run is not None:
        with suppress(SimulationError):
            drawn = run.disturbed(position_std, _PAIRS, _SEED)
            # The windows, and what else an instrument is, are those of the instruments.
            return [
                [one.replace(q=version.q, tau=version.tau) for version in versions]
                for one, *versions in zip(instruments.recordings, *drawn, strict=True)
            ]
    found = []
    for one in instruments.recordings:
        rngs = [np.random.default_rng((_SEED, draw)) for draw in range(_PAIRS)]
        noise = [position_std * rng.standard_normal(one.q.shape) for rng in rngs]
        found.append([one.replace(q=one.q + sign * x) for x in noise for sign in (1.0, -1.0)])
    return found


class _Sums:
    """Products of instruments and noisy regressors, over all rows."""

    def __init__(self, model: Model, solution: InstrumentalSolution, draws: int) -> None:
        rank = solution.rank
        self._model, self._kept = model, list(solution.basis.independent)
        self._weights = solution.weights
        self.crossed = np.zeros((draws, rank, rank))
        self.shifted = np.zeros((draws, rank))
        self.sampled = np.zeros(rank)

    def add(
        self, clean: Recording, dataset: Dataset, values: np.ndarray, noisy: list[Recording]
    ) -> None:
        """Add the rows of a recording, clean and under each draw of noise."""
        prepared = [sample(one, dataset.filter) for one in (clean, *noisy)]
        torque, start = [one.tau for one in prepared], 0
        blocks = (one.columns(self._model, values) for one in prepared)
        for V, *drawn in zip(*blocks, strict=True):
            stop = start + len(V)
            rows = slice(start, stop)
            left = torque[0][rows] - V @ values
            start = stop
            instruments = V[:, :, self._kept] * (self._weights**2)[:, None]
            self.sampled += np.einsum("tij,ti->j", instruments, left)
            for draw, W in enumerate(drawn):
                self.crossed[draw] += np.einsum(
                    "tij,tik->jk", instruments, W[:, :, self._kept], optimize=True
                )
                # Less what sampling does without noise: that is counted apart.
                error = W @ values - torque[draw + 1][rows] + left
                self.shifted[draw] += np.einsum("tij,ti->j", instruments, error)
