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

import lazy_loader
import numpy as np
from scipy.linalg import cho_solve, cholesky

from dynident.experiment_design.column_function import ColumnFunction

ca: Any = lazy_loader.load("casadi")
Objective = Literal["D", "A"]
RIDGE = 1e-8
"""Added to the diagonal of the scaled information: what nothing shows is then not infinite."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Information:
    """What is asked of a motion.

    Attributes
    ----------
    columns : of the model, then of the rivals, then of interest.
    mix : (m, k) combinations of the columns that are meant, those of interest last.
    last : how many these are; k for all.
    weight : (n,) of the rows of each joint: rows of the recording per instant, over the variance.
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
        """Information of a motion, (k, k), per row of `t` as many rows as its weight says.

        Parameters
        ----------
        t : (T,) s.
        motion : q, v, a, (T, n) each.
        """
        found = self.columns.along(t, *motion) @ self.mix
        weighted = found * np.sqrt(self.weight)[None, :, None]
        rows = weighted.reshape(-1, found.shape[2])
        return rows.T @ rows

    def about(self, matrix: np.ndarray) -> np.ndarray:
        """Information about what is of interest, all else estimated too, (last, last)."""
        scaled = self._scaled(matrix)
        first = len(scaled) - self.last
        rest, cross, own = scaled[:first, :first], scaled[:first, first:], scaled[first:, first:]
        if first:
            own = own - cross.T @ cho_solve((cholesky(rest, lower=True), True), cross)
        size = self.scale[first:]
        return own * np.outer(size, size)

    def loss(self, matrix: np.ndarray) -> float:
        """What is minimised, of the information of a motion with that of the recordings."""
        found = self.about(matrix)
        size = self.scale[len(self.scale) - self.last :]
        scaled = found / np.outer(size, size) + RIDGE * np.eye(self.last)
        if self.objective == "A":
            return float(np.log(np.trace(np.linalg.inv(scaled))))
        return -float(np.linalg.slogdet(scaled)[1])

    def symbolic_loss(self, columns: Any, instants: int) -> Any:
        """Return the loss of CasADi's columns, (m, n * instants)."""
        n = len(self.weight)
        weights = np.tile(np.sqrt(self.weight), instants)
        rows = (ca.DM(self.mix / self.scale).T @ columns) @ ca.diag(ca.DM(weights))
        assert rows.shape[1] == n * instants
        prior = self.prior / np.outer(self.scale, self.scale) + RIDGE * np.eye(len(self.scale))
        return self._factor_loss()(rows @ rows.T + ca.DM(prior))

    def _scaled(self, matrix: np.ndarray) -> np.ndarray:
        whole = (matrix + self.prior) / np.outer(self.scale, self.scale)
        return whole + RIDGE * np.eye(len(whole))

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
            loss = -2 * ca.sum1(ca.log(ca.diag(own)))
        return ca.Function("loss", [matrix], [loss])
