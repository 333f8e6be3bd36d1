"""Essential parameters: a model without what the data hardly show.

Khalil, Gautier, Lemoine, "Identification of the payload inertial parameters of industrial
manipulators", ICRA 2007: the parameter of the largest relative standard deviation is dropped,
the rest is estimated again, and so on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.linear_solution import solve_columns, solve_factors
from dynident.model import Model
from dynident.moments.factors import TriangularFactors
from dynident.tables import Table, number, percent, relative

LARGEST_RELATIVE_SIGMA = 0.3


@dataclass(frozen=True, eq=False, kw_only=True)
class EssentialParameters:
    """What is left when parameters with a large relative standard deviation are dropped.

    Attributes
    ----------
    names, values, sigma : (r,) of the parameters kept.
    dropped : names, in the order in which they were dropped.
    error_before, error_after : relative torque error with all parameters, and with these.
    """

    names: tuple[str, ...]
    values: np.ndarray
    sigma: np.ndarray
    dropped: tuple[str, ...]
    error_before: float
    error_after: float

    def table(self) -> Table:
        """Values and standard deviations of what is kept."""
        rows = tuple(
            (name, number(value, 6), number(sigma, 3), relative(value, sigma))
            for name, value, sigma in zip(self.names, self.values, self.sigma, strict=True)
        )
        note = (
            f"Dropped: {', '.join(self.dropped) or 'nothing'}. Relative error "
            f"{percent(self.error_before)} with all, {percent(self.error_after)} with these."
        )
        columns = ("parameter", "value", "sigma", "relative")
        return Table("Essential parameters", columns, rows, (note,))


def essential_parameters(
    model: Model, factors: TriangularFactors, largest: float = LARGEST_RELATIVE_SIGMA
) -> EssentialParameters:
    """Drop parameters, one at a time, until every relative standard deviation is below a limit.

    Source: Khalil, Gautier and Lemoine, ICRA 2007.

    Parameters
    ----------
    model, factors : the columns, by name, and their sufficient statistics.
    largest : relative standard deviation above which a parameter is dropped.

    Returns
    -------
    What is left, with the torque errors before and after.

    Raises
    ------
    FitError
        As `solve_factors`.
    """
    full = solve_factors(model, factors)
    R = factors.pooled(1.0 / full.torque_std)
    kept, dropped = list(full.basis.independent), []
    while True:
        found = solve_columns(R, kept, factors.rows)
        values = found.values
        sigma = np.sqrt(found.variance * np.sum(found.inverse**2, axis=1))
        with np.errstate(divide="ignore"):
            shares = sigma / np.abs(values)
        worst = int(np.argmax(shares))
        if shares[worst] <= largest or len(kept) == 1:
            break
        dropped.append(model.names[kept.pop(worst)])
    norm = float(np.linalg.norm(factors.torque_norms))
    everything = np.zeros(model.size)
    everything[kept] = values
    return EssentialParameters(
        names=tuple(model.names[i] for i in kept),
        values=values,
        sigma=sigma,
        dropped=tuple(dropped),
        error_before=float(np.linalg.norm(factors.residual_norms(full.values))) / norm,
        error_after=float(np.linalg.norm(factors.residual_norms(everything))) / norm,
    )
