"""How well the variances of an estimate are known, where the colour of its errors is measured.

A motion fills a few hertz. How much noise there is in so narrow a band is known from as many
values as the recording holds periods of it, and 1.96 such standard deviations hold less than 95 %.

Source: F. E. Satterthwaite, "An approximate distribution of estimates of variance components",
Biometrics Bulletin 2 (1946); the covariance of sample autocovariances is M. S. Bartlett's, "On the
theoretical specification and sampling properties of autocorrelated time-series", Supplement to the
Journal of the Royal Statistical Society 8 (1946).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, hankel, toeplitz
from scipy.special import ndtri, stdtrit

_TAIL = 0.975  # of intervals that are to hold 95 %
_LEAST = 3.0
"""Degrees of freedom that are granted at least: of fewer, intervals become those of no noise in
particular. Taste."""
_MOST = 1e6  # beyond which they make no difference


def widths(freedom: np.ndarray) -> np.ndarray:
    """Return factors of standard deviations so known that 1.96 of them hold 95 %."""
    return stdtrit(freedom, _TAIL) / ndtri(_TAIL)


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasuredSpectrum:
    """Autocovariances of n joints as sums of shapes with measured amounts.

    Attributes
    ----------
    seen : (n (K + 1), A) lagged sums of residuals, a pair of rows, for a unit of each amount.
    shapes : (n (K + 1), A) autocovariances for a unit of each amount.
    amounts : (A,), above zero.
    pairs : (n,) rows of each joint.
    count : what the lagged sums were divided by.
    """

    seen: np.ndarray
    shapes: np.ndarray
    amounts: np.ndarray
    pairs: np.ndarray
    count: float

    def freedom(self, products: np.ndarray) -> np.ndarray:
        """Return the degrees of freedom with which variances are known, (r,); at least 3.

        Parameters
        ----------
        products : (r, n (K + 1)) what each variance is for a unit of each autocovariance.
        """
        each = products @ self.shapes
        spread = each @ np.linalg.pinv(self.seen)
        own = np.sum((spread @ self._of_lagged_sums()) * spread, axis=1)
        variances = each @ self.amounts
        # Variances that depend on no amount are known.
        found = np.full(len(own), _MOST)
        np.divide(2.0 * variances**2, own, out=found, where=own > 0.0)
        return np.clip(found, _LEAST, _MOST)

    def _of_lagged_sums(self) -> np.ndarray:
        """Covariance of the lagged sums, a pair of rows, (n (K + 1), n (K + 1))."""
        autocovariances = (self.shapes @ self.amounts).reshape(len(self.pairs), -1)
        blocks = []
        for one, pairs in zip(autocovariances, self.pairs, strict=True):
            lags = len(one)
            both = np.concatenate([one[:0:-1], one])
            squares = np.convolve(both, both)[len(both) - 1 :]
            found = toeplitz(squares[:lags]) + hankel(
                squares[:lags], squares[lags - 1 : 2 * lags - 1]
            )
            blocks.append(found * pairs / self.count**2)
        return np.asarray(block_diag(*blocks))
