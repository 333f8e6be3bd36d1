"""Stepwise regression: inputs enter and leave by partial F tests."""

from __future__ import annotations

import numpy as np
from scipy import special

from dynident.moments import SecondMoments
from dynident.regression.statistics_regressor import StatisticsRegressor

_DEPENDENT = (
    1e-10  # share of an input's squares that the chosen ones leave, below which it is theirs
)

_EXACT = 1e-12  # share of the output's squares below which nothing is left but rounding


class StepwiseRegression(StatisticsRegressor):
    """Forward selection with backward elimination (Draper and Smith 1981).

    Its tests are made after a search through all inputs: they are no evidence of an effect, and
    the coefficients of what was chosen are too large on average.

    Parameters
    ----------
    enter, leave : p-values of the partial F test below which an input enters, above which it
        leaves; `leave` is not below `enter`.
    max_iter : at most so many steps.
    fit_intercept : False for a regression through the origin.

    Attributes
    ----------
    chosen_ : numbers of the inputs in the model, in ascending order.
    n_iter_ : steps taken.
    """

    words = "stepwise regression"

    def __init__(
        self,
        enter: float = 0.05,
        leave: float = 0.10,
        max_iter: int = 1000,
        *,
        fit_intercept: bool = True,
    ) -> None:
        super().__init__(fit_intercept=fit_intercept)
        self.enter = enter
        self.leave = leave
        self.max_iter = max_iter

    def _solve(self, unit: SecondMoments, inputs: np.ndarray) -> None:
        for setting, least, most in (("enter", 1e-300, 0.999), ("max_iter", 1, np.inf)):
            self._require(setting, least, most)
        self._require("leave", self.enter, 0.999)
        chosen: list[int] = []
        self.n_iter_ = 0
        while self.n_iter_ < self.max_iter:
            if unit.residual(_at(unit, chosen, _solved(unit, chosen))) <= _EXACT * unit.power:
                break  # what is left is rounding: any input would explain it
            added = self._entering(unit, chosen)
            if added is None:
                break
            chosen.append(added)
            self.n_iter_ += 1
            while (removed := self._leaving(unit, chosen)) is not None:
                chosen.remove(removed)
                self.n_iter_ += 1
        self.chosen_ = inputs[sorted(chosen)]
        found = np.zeros(unit.inputs)
        found[chosen] = _solved(unit, chosen)
        self._set(self._in_units(found, inputs))

    def _entering(self, unit: SecondMoments, chosen: list[int]) -> int | None:
        """The input whose F test is clearest, if it is clear enough."""
        G, c = unit.gram, unit.cross
        weights = np.linalg.solve(G[np.ix_(chosen, chosen)], G[chosen]) if chosen else G[:0]
        own = np.diag(G) - np.sum(G[chosen] * weights, axis=0)
        along = c - weights.T @ c[chosen]
        free = own > _DEPENDENT * np.diag(G)
        free[chosen] = False
        gain = np.where(free, along**2 / np.where(free, own, 1.0), 0.0)
        if not gain.any():
            return None
        best = int(np.argmax(gain))
        left = unit.residual(_at(unit, chosen, _solved(unit, chosen))) - gain[best]
        p = self._p_value(unit, gain[best], left, len(chosen) + 1)
        return best if p < self.enter else None

    def _leaving(self, unit: SecondMoments, chosen: list[int]) -> int | None:
        """The chosen input whose F test is least clear, if it is not clear any more."""
        if len(chosen) < 2:
            return None
        found = _solved(unit, chosen)
        loss = found**2 / np.diag(np.linalg.inv(unit.gram[np.ix_(chosen, chosen)]))
        worst = int(np.argmin(loss))
        left = unit.residual(_at(unit, chosen, found))
        p = self._p_value(unit, loss[worst], left, len(chosen))
        return chosen[worst] if p > self.leave else None

    def _p_value(self, unit: SecondMoments, gain: float, left: float, used: int) -> float:
        freedom = self._freedom(unit, used)
        if freedom <= 0:
            return 1.0
        F = max(gain, 0.0) * freedom / max(left, _EXACT * unit.power)
        return float(special.fdtrc(1, freedom, F))


def _solved(unit: SecondMoments, chosen: list[int]) -> np.ndarray:
    return np.linalg.solve(unit.gram[np.ix_(chosen, chosen)], unit.cross[chosen])


def _at(unit: SecondMoments, chosen: list[int], values: np.ndarray) -> np.ndarray:
    found = np.zeros(unit.inputs)
    found[chosen] = values
    return found
