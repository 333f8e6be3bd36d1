"""What the scatter between consecutive pieces of the data says of a regression.

Filtered noise is not independent from row to row, nor between the joints of one instant: what the
pieces contribute to the normal equations is, if they are long against the filter. The pieces are
equally long, and each is known by its triangular factor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.moments.factors import TriangularFactors


def sandwich(pieces: TriangularFactors, coefficients: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Return the covariance of corrected least squares from the scatter between pieces, (p, p).

    Parameters
    ----------
    pieces : factors of [inputs, output], piece by piece.
    coefficients : (p,) of corrected least squares.
    psi : (p, p) input noise of a row.

    Notes
    -----
    White, "Maximum likelihood estimation of misspecified models" (1982), by clusters of rows.
    """
    X, y = pieces.R[:, :, :-1], pieces.R[:, :, -1]
    count = len(X)
    M = np.einsum("kri,krj->ij", X, X) - pieces.rows * psi
    scores = np.einsum("kri,kr->ki", X, y - X @ coefficients)
    scores = scores + np.outer(pieces.counts, psi @ coefficients)
    inverse = np.linalg.inv(M)
    return inverse @ (scores.T @ scores) @ inverse * count / max(count - 1, 1)


@dataclass(frozen=True)
class OutputNoise:
    """What the input noise leaves of the residual's variance.

    Attributes
    ----------
    variance : per row; may come out negative.
    sigma : its standard deviation, from the scatter between the pieces.
    """

    variance: float
    sigma: float


def output_noise(
    pieces: TriangularFactors, coefficients: np.ndarray, psi: np.ndarray
) -> OutputNoise:
    """Return the output's noise: the variance of y - X b, less what input noise makes of it.

    Parameters
    ----------
    pieces, coefficients, psi : as of `sandwich`.
    """
    each = pieces.residual_norms(coefficients) ** 2 / np.maximum(pieces.counts, 1)
    left = each - coefficients @ psi @ coefficients
    sigma = float(np.std(left, ddof=1) / np.sqrt(len(left))) if len(left) > 1 else np.inf
    return OutputNoise(float(np.mean(left)), sigma)
