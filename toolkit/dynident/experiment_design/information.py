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

from dynident.experiment_design.column_function import ColumnFunction
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

    def loss_function(self, instants: int) -> Any:
        """Return the loss, of a motion and of what is recorded together, as CasADi's function.

        Parameters
        ----------
        instants : at which the motion is given, T.

        Returns
        -------
        casadi.Function of q, v, a and the time, (3 n + 1, T): the loss, and its slopes by them.
        """
        x = ca.SX.sym("x", 3 * self.columns.n + 1)
        # Mixed instant by instant: a product of large matrices costs as much as the columns do.
        mix = ca.sparsify(ca.DM(self.mix / self.scale)).T
        own = mix @ self.columns.function(x) @ ca.diag(ca.DM(np.sqrt(self.weight / instants)))
        inputs = ca.MX.sym("inputs", 3 * self.columns.n + 1, instants)
        rows = ca.Function("told", [x], [ca.densify(own)]).map(instants)(inputs)
        prior = self.prior / np.outer(self.scale, self.scale) + RIDGE * np.eye(len(self.scale))
        loss = self._factor_loss()(rows @ rows.T + ca.DM(prior))
        return ca.Function("loss", [inputs], [loss, ca.gradient(loss, inputs)])

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

    def _factor_loss(self) -> Any:
        """The loss of an information matrix, (k, k)."""
        size = len(self.scale)
        matrix = ca.SX.sym("M", size, size)
        factor = ca.chol((matrix + matrix.T) / 2).T
        first = size - self.last
        own = factor[first:, first:]
        if self.objective == "A":
            inverse = ca.solve(own, ca.SX.eye(self.last))
            loss = ca.log(ca.sumsqr(inverse))
        else:
            loss = self.unit - 2 * ca.sum1(ca.log(ca.diag(own)))
        return ca.Function("loss", [matrix], [loss])
