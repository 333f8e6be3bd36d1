"""How much a motion tells: pivots of the information matrix of its columns.

With whitened columns Z, those of interest last, the squared pivots of the Cholesky factor of Z'Z
that belong to these are what is left of each beside all columns before it. Their product is the
determinant of the information about them with the others estimated as well (a Schur complement):
of all columns, the D criterion; of the torque of an effect beside the model with a rival, the
squared distance of the two in standard deviations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.columns.mapped import mapped
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")
Objective = Literal["D", "A"]
RIDGE = 1e-8
"""Added to the diagonal of the scaled information while a motion is sought: what nothing shows must
not make the loss infinite."""
ROUNDING = 1e-11
"""Of the largest eigenvalue of a scaled information: what is less is rounding."""
_HIDDEN = 1e-6  # of a parameter's direction that may lie where nothing is seen


@dataclass(frozen=True, eq=False, kw_only=True)
class Information:
    """What is asked of a motion.

    Attributes
    ----------
    columns : of the model, then of the rivals, then of interest.
    mix : (m, k) combinations of the columns that are meant, those of interest last.
    last : how many these are; k for all.
    weight : (n,) of each joint: rows that the recording will have, over the variance of their
        noise.
    prior : (k, k) information that recordings bring already.
    scale : (k,) sizes of the combinations.
    objective : "D", the determinant, or "A", the sum of the variances.
    """

    columns: ColumnFunction
    mix: np.ndarray
    last: int
    weight: np.ndarray
    prior: np.ndarray
    scale: np.ndarray
    objective: Objective = "D"

    def matrix(self, t: np.ndarray, motion: tuple[np.ndarray, ...]) -> np.ndarray:
        """Information of a recording of a motion, (k, k).

        Parameters
        ----------
        t : (T,) s, instants that stand for all rows of the recording.
        motion : q, v, a, (T, n) each.
        """
        found = self.columns.along(t, *motion) @ self.mix
        weighted = found * np.sqrt(self.weight / len(t))[None, :, None]
        rows = weighted.reshape(-1, found.shape[2])
        return rows.T @ rows

    def about(self, matrix: np.ndarray) -> np.ndarray:
        """Information about what is of interest, all else estimated too, (last, last)."""
        size = self.scale[len(self.scale) - self.last :]
        return self.scaled_about(matrix) * np.outer(size, size)

    def scaled_about(self, matrix: np.ndarray) -> np.ndarray:
        """`about` in units of the scales; zero where rounding is all that is left."""
        scaled = (matrix + self.prior) / np.outer(self.scale, self.scale)
        first = len(scaled) - self.last
        rest, cross, own = scaled[:first, :first], scaled[:first, first:], scaled[first:, first:]
        if not first:
            return own
        known, turn = np.linalg.eigh(rest)
        kept = known > ROUNDING * max(known[-1], 0.0)
        along = turn[:, kept].T @ cross
        left = own - along.T @ (along / known[kept][:, None])
        gone = np.diag(left) <= ROUNDING * np.diag(own)
        return np.where(gone[:, None] | gone[None, :], 0.0, left)

    def sigma(self, matrix: np.ndarray) -> np.ndarray:
        """Standard deviations of what is of interest, (last,); infinite where nothing shows one.

        Parameters
        ----------
        matrix : information of a motion; that of the recordings so far is added.
        """
        values, turn = np.linalg.eigh(self.scaled_about(matrix))
        seen = values > ROUNDING * max(values[-1], 0.0)
        variance = np.sum(turn[:, seen] ** 2 / values[seen], axis=1)
        hidden = np.sum(turn[:, ~seen] ** 2, axis=1) > _HIDDEN
        size = self.scale[len(self.scale) - self.last :]
        return np.where(hidden, np.inf, np.sqrt(variance) / size)

    def loss(self, matrix: np.ndarray) -> float:
        """What is minimised, of the information of a motion with that of the recordings."""
        scaled = self.scaled_about(matrix) + RIDGE * np.eye(self.last)
        if self.objective == "A":
            return float(np.log(np.trace(np.linalg.inv(scaled))))
        return self.unit - float(np.linalg.slogdet(scaled)[1])

    @property
    def unit(self) -> float:
        """What of the loss follows from the scales, and no motion changes.

        A determinant holds their product, by which losses of several questions are compared; the
        sum of variances is in units of them.
        """
        if self.objective == "A":
            return 0.0
        return -2 * float(np.sum(np.log(self.scale[len(self.scale) - self.last :])))

    @property
    def terms(self) -> int:
        """How many logarithms the loss is the sum of."""
        return self.last if self.objective == "D" else 1


class LossAlong:
    """The loss of a motion with what was recorded, and its slopes by the motion.

    Columns and their slopes are CasADi's, instant by instant; products and factors of the
    information are LAPACK's. All of it in CasADi took three times as long for seven joints.

    Parameters
    ----------
    information : what is asked.
    instants : at which motions are given, T.
    """

    def __init__(self, information: Information, instants: int) -> None:
        self._asked, columns, size = information, information.columns, len(information.scale)
        x, seed = ca.SX.sym("x", 3 * columns.n + 1), ca.SX.sym("seed", size, columns.n)
        # Mixed instant by instant: a product of large matrices costs as much as the columns do.
        mix = ca.sparsify(ca.DM(information.mix / information.scale)).T
        weight = ca.diag(ca.DM(np.sqrt(information.weight / instants)))
        rows = ca.densify(mix @ columns.function(x) @ weight)
        rows, back = ca.cse([rows, ca.densify(ca.jtimes(rows, x, seed, True))])
        self._rows = ca.Function("rows", [x], [rows])
        self._back = ca.Function("back", [x, seed], [back])
        self._prior = information.prior / np.outer(information.scale, information.scale)
        self._prior += RIDGE * np.eye(size)

    def __call__(self, inputs: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the loss, and its slopes by the inputs.

        Both are NaN where the information is not positive definite, or not finite.

        Parameters
        ----------
        inputs : (T, 3 n + 1), q, v, a and the time.

        Returns
        -------
        The loss, and its slopes (T, 3 n + 1).
        """
        (rows,) = mapped(self._rows, inputs[:, None])
        flat = rows.reshape(-1, rows.shape[2])
        with np.errstate(over="ignore", invalid="ignore"):
            information = flat.T @ flat + self._prior
        try:
            loss, by_information = self._of_factor(cholesky(information, lower=True))
        except (np.linalg.LinAlgError, ValueError):  # the latter of what is not finite
            return np.nan, np.full(inputs.shape, np.nan)
        seed = (2 * flat @ by_information).reshape(rows.shape)
        (slopes,) = mapped(self._back, inputs[:, None], seed)
        return loss, slopes[:, 0]

    def _of_factor(self, factor: np.ndarray) -> tuple[float, np.ndarray]:
        """The loss, and its slopes by the information (k, k), of its lower factor (k, k).

        The last block F of the factor is that of the information about what is of interest with all
        else estimated too. With U the last rows of the inverse of the factor, minus U'U are the
        slopes of -2 log det F; with V the last columns of U'U, -VV' / tr those of the logarithm of
        the trace tr of the last block of V, the variances.
        """
        asked = self._asked
        own = slice(len(factor) - asked.last, None)
        last = np.eye(len(factor))[:, own]
        turned = solve_triangular(factor, last, lower=True, trans=1)
        if asked.objective == "A":
            variances = float(np.sum(turned[own] ** 2))
            by_variance = turned @ turned[own].T
            return float(np.log(variances)), -by_variance @ by_variance.T / variances
        pivots = np.log(np.diag(factor)[own])
        return asked.unit - 2 * float(np.sum(pivots)), -turned @ turned.T
