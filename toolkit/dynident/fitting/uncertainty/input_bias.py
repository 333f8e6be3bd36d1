"""The bias that noise of the positions leaves in least squares.

A regressor W of noisy positions differs by D from the columns X of the true motion, and least
squares are (W'W)^-1 W'(W - D) times the truth in the mean: not the truth, as W and D go together.
D has two parts. What the filters leave of the encoders' noise makes columns longer, and parameters
smaller (errors in variables). And what the filters hide of the true motion, the trembling of a
robot that follows its encoders, has blunted its dry friction, while the columns' is sharp.

Both are found by doing to the recorded motion what was done to it: noise of the measured size is
added, behind the same filters, and so is the trembling that the recorded torque makes.

Source: the regression calibration of R. J. Carroll, D. Ruppert, L. A. Stefanski and C. M.
Crainiceanu, "Measurement Error in Nonlinear Models" (2006), chapters 3 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.clusters import over_recordings
from dynident.errors import RecordingError
from dynident.fitting.linear_solution import LinearSolution
from dynident.fitting.uncertainty.expected_bias import listed, reported
from dynident.fitting.uncertainty.noisy_part import NoisyPart
from dynident.model import Model
from dynident.recording import Dataset, Recording, default_filter, suited_instead
from dynident.tables import number

_MOST = 16384
"""Samples, of all recordings, along which the bias is looked for."""
_BEYOND = 2.0
"""Standard deviations from which the first line says it: 95 % intervals of the noise alone would
then miss the truth every other time."""
_ROUGH = 3.0
"""Standard deviations from which what is not known of the bias is as large as the noise: it is
foretold to about a third (measured on simulated two-link arms that follow their encoders)."""
_LEAST = 0.1
"""Share of signal in a direction below which the correction is not carried on: there the bias is
nine times what is left at least."""
_NAMED = 4


@dataclass(frozen=True, eq=False, kw_only=True)
class InputBias:
    """Expected errors of a least squares estimate for the noise of its positions.

    Attributes
    ----------
    model : of p parameters.
    values : (p,) expected error; zero where a parameter is not identified.
    trembling : (p,) the part of it that filters hide.
    sigma : (p,) standard deviations without it; NaN where a parameter is not identified.
    position_std : (n,) of the encoders' noise, rad or m.
    cutoff_hz : of the positions' low-pass; None without one.
    suited_hz : the one that suits the recordings, where a bias is to be said and `cutoff_hz` is far
        below it; else None.
    """

    model: Model
    values: np.ndarray
    trembling: np.ndarray
    sigma: np.ndarray
    position_std: np.ndarray
    cutoff_hz: float | None
    suited_hz: float | None = None

    @property
    def ratio(self) -> np.ndarray:
        """Size of the bias in standard deviations, (p,)."""
        size = np.abs(self.values)
        return np.divide(size, self.sigma, out=np.zeros_like(size), where=self.sigma > 0)

    @property
    def headline(self) -> str:
        """What is to be read before any number; empty where the bias is not beyond the noise."""
        worst = [i for i in np.argsort(-self.ratio) if self.ratio[i] > _BEYOND]
        if not worst:
            return ""
        more = f" and {len(worst) - _NAMED} more" if len(worst) > _NAMED else ""
        parts = [
            f"{self.model.names[i]} by {number(float(self.values[i]), 2)} {self.model.units[i]} "
            f"({number(float(self.ratio[i]), 2)} sigma)"
            for i in worst[:_NAMED]
        ]
        known = "sigma holds that"
        if self.ratio.max() > _ROUGH:
            known = "sigma holds that roughly, and gives no 95 % intervals"
        why, remedy = self._reason(worst[0])
        return f"{why}: {', '.join(parts)}{more}; {known}. {remedy}"

    @property
    def note(self) -> str:
        """The biases that are worth a word; empty where there are none."""
        which = reported(self.values, self.sigma)
        if not len(which):
            return ""
        each = zip(self.position_std, self.model.robot.units, strict=True)
        std = ", ".join(f"{number(x, 2)} {unit}" for x, unit in each)
        return (
            f"Expected bias, from encoder noise of the size in the positions ({std}; in sigma, not "
            f"subtracted): {listed(self.model, self.values, which)}."
        )

    def words(self, others: str) -> str:
        """What the standard deviations hold; `others` without the bias."""
        more = " The bias to be expected of noise in the positions is in sigma, too."
        return others + more if self.note else others

    def _reason(self, worst: int) -> tuple[str, str]:
        """Why the fit is biased, most of all in one parameter, a clause; and what mends that."""
        if np.abs(self.trembling[worst]) > np.abs(self.values[worst]) / 2:
            cutoff, suited = self.cutoff_hz, self.suited_hz
            if cutoff and suited:
                return (
                    "The low-pass of the positions hides motion, which biases this fit",
                    f"Remedy: leave position_cutoff_hz = {cutoff:.4g} out of [filter]; "
                    f"{suited:.3g} Hz suits these recordings.",
                )
            return (
                "The robot trembles under the noise of its encoders, which biases this fit",
                "No filter of the record undoes it: let the drive follow its encoders less (a "
                "lower gain on their differences).",
            )
        way = "lower position_cutoff_hz in [filter]"
        if not self.cutoff_hz:
            way = "state position_cutoff_hz in [filter]"
        return (
            "Noise in the positions biases this fit",
            f"Remedy: {way}, or take a method that allows for noisy positions (--method iv, or "
            "corrected with --input-noise encoders).",
        )


def input_bias(
    model: Model, dataset: Dataset, values: np.ndarray, solution: LinearSolution, sigma: np.ndarray
) -> InputBias | None:
    """Return the bias to be expected of a least squares estimate.

    Parameters
    ----------
    model : of p parameters.
    dataset : what was fitted; without stated noise that of the positions is measured in them.
    values : (p,) the estimate.
    solution : its weights and independent columns.
    sigma : (p,) its standard deviations.

    Returns
    -------
    None where the recordings are too short to tell.
    """
    most = _MOST // len(dataset.recordings)
    sums, stds = _NoiseProducts(model, values, solution), []
    settings = replace(dataset, recordings=())
    arguments = (model, settings, values, solution, most)
    try:
        for one, std in over_recordings(dataset.recordings, _products_of_recording, *arguments):
            sums.join(one)
            stds.append(std)
    except RecordingError:
        return None
    kept = list(solution.basis.independent)
    whole, noise_alone = (np.zeros(model.size) for _ in range(2))
    whole[kept] = sums.bias(sums.noise + sums.hidden)
    noise_alone[kept] = sums.bias(sums.noise)
    settings = dataset.filter or default_filter(dataset.recordings[0].rate_hz)
    found = InputBias(
        model=model,
        values=whole,
        trembling=whole - noise_alone,
        sigma=sigma,
        position_std=np.sqrt(np.mean(np.square(stds), axis=0)),
        cutoff_hz=settings.position_cutoff_hz,
    )
    if found.cutoff_hz is None or not found.headline:
        return found
    return replace(found, suited_hz=suited_instead(found.cutoff_hz, dataset.recordings))


def _products_of_recording(
    recording: Recording,
    model: Model,
    settings: Dataset,
    values: np.ndarray,
    solution: LinearSolution,
    most: int,
) -> tuple[_NoiseProducts, np.ndarray]:
    """Products of a recording's noisy columns, and the noise of its positions (n,)."""
    part = NoisyPart.of(model, settings, values, recording, most)
    sums = _NoiseProducts(model, values, solution)
    sums.add(part)
    return sums, part.position_std


class _NoiseProducts:
    """Weighted products W'D of noisy columns and what they are off, over all rows.

    With noise and with its mirror image columns are W = S +- H, so that the mean of W'D is that of
    S'(S - W0) + H'H, with the columns W0 that are seen, and of S'(W0 - X), with the true ones.
    """

    def __init__(self, model: Model, values: np.ndarray, solution: LinearSolution) -> None:
        self._model, self._values, self._solution = model, values, solution
        self._noise, self._hidden = (np.zeros((model.size, model.size)) for _ in range(2))

    def add(self, part: NoisyPart) -> None:
        """Add the rows of a recording, for both draws."""
        for columns in part.columns(self._model, self._values):
            every = [columns.mean, columns.half, columns.seen]
            every += [] if columns.true is None else [columns.true]
            # Joint by joint: of most columns a joint has none.
            for j, weight in enumerate(self._solution.weights):
                used = self._used([one[:, j] for one in every])
                mean, half, seen, *true = (one[:, j].T[used] for one in every)
                places, factor = np.ix_(used, used), weight**2 / part.share
                self._noise[places] += factor * (mean @ (mean - seen).T + half @ half.T)
                if true:
                    self._hidden[places] += factor * (mean @ (seen - true[0]).T)

    def join(self, other: _NoiseProducts) -> None:
        """Take in the rows of other recordings."""
        self._noise += other._noise
        self._hidden += other._hidden

    def _used(self, every: list[np.ndarray]) -> list[int]:
        """Numbers of the independent columns that are not zero in all of some rows (T, p) each."""
        begin = np.any([one[0] != 0.0 for one in every], axis=0)
        return [
            name
            for name in self._solution.basis.independent
            if begin[name] or any(one[:, name].any() for one in every)
        ]

    @property
    def noise(self) -> np.ndarray:
        """Of what noise adds to the columns, (r, r) in directions in which W'W is one."""
        return self._turned(self._noise)

    @property
    def hidden(self) -> np.ndarray:
        """Of what is hidden of the true motion, (r, r) in the same directions."""
        return self._turned(self._hidden)

    def _turned(self, products: np.ndarray) -> np.ndarray:
        kept, turn = list(self._solution.basis.independent), self._solution.inverse
        return turn.T @ products[np.ix_(kept, kept)] @ turn

    def bias(self, products: np.ndarray) -> np.ndarray:
        """Error (r,) of an estimate that is (1 - W'D) times the truth."""
        turn = self._solution.inverse
        found = np.linalg.solve(turn, self._solution.basis.coordinates(self._values))
        left, size, right = np.linalg.svd(np.eye(len(products)) - products)
        true = right.T @ ((left.T @ found) / np.maximum(size, _LEAST))
        return turn @ (found - true)
