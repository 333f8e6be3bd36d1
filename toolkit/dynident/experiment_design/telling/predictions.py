"""What a motion is predicted to tell of an effect, of given values and of uncertain ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.experiment_design.information import ROUNDING
from dynident.experiment_design.telling.separation import Predicted, Told

_DRAWS = 1000
_SEED = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class TellingForms:
    """Squares, over the noise, as forms of the effect's k values c: c' M c.

    Attributes
    ----------
    whole : (k, k) of the effect's torque.
    alone : (k, k) of what of it the model cannot imitate.
    left : (r, k, k) of what of that a rival, in one of its shapes, cannot.
    larger : (r,) whether that rival has more parameters, and columns that a diagnosis sees as they
        are.
    """

    whole: np.ndarray
    alone: np.ndarray
    left: np.ndarray
    larger: np.ndarray

    def told(self, values: np.ndarray) -> Told:
        """Return what is told of the rival that imitates an effect of these values best.

        Parameters
        ----------
        values : (k,) of the effect.
        """
        sigma, share, alike = (float(one[0]) for one in self._of_each(values[None]))
        return Told(sigma=sigma, share=share, share_alike=alike)

    def predicted(self, values: np.ndarray, covariance: np.ndarray | None) -> Predicted:
        """Return what is predicted of an effect whose values are known as far as recordings go.

        By a thousand draws of the values, and of the noise of the recording to come, of one
        standard deviation.

        Parameters
        ----------
        values : (k,) of the effect.
        covariance : (k, k) of them; None where recordings do not tell them.
        """
        if covariance is None:
            return Predicted(interval=None, chance=0.0)
        random = np.random.default_rng(_SEED)
        sizes, axes = np.linalg.eigh(covariance)
        steps = axes * np.sqrt(np.clip(sizes, 0.0, None))
        drawn = values + random.standard_normal((_DRAWS, len(values))) @ steps.T
        sigma, _, alike = self._of_each(drawn)
        measured = np.abs(sigma + random.standard_normal(_DRAWS))
        low, high = np.quantile(measured, [0.025, 0.975])
        beyond = Told.beyond_of(sigma, alike)
        return Predicted(interval=(float(low), float(high)), chance=float(np.mean(beyond > 0)))

    def _of_each(self, values: np.ndarray) -> tuple[np.ndarray, ...]:
        """`Told`'s figures of each of many values (d, k), (d,) each."""
        whole, alone = (
            np.einsum("di,ij,dj->d", values, m, values) for m in (self.whole, self.alone)
        )
        least = ROUNDING * whole
        alone = np.where(alone > least, alone, 0.0)
        left = np.einsum("di,rij,dj->dr", values, self.left, values)
        left = np.where((left > least[:, None]) & (alone > 0)[:, None], left, 0.0)
        nearest = left.min(axis=1)
        alike = left[:, ~self.larger].min(axis=1, initial=np.inf)
        size = np.where(alone > 0, alone, 1.0)
        share_alike = np.where(alone > 0, np.minimum(alike / size, 1.0), 0.0)
        return np.sqrt(nearest), nearest / size, share_alike
