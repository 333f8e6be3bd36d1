"""A factor regression in words and tables: what was found, and what it is worth.

In: a fitted regression, known by its attributes alone. Out: its tables.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from dynident.regression.corrected import LEAST_SHARE, CorrectedLeastSquares
from dynident.regression.factor_analysis import LEAST_RELIABILITY
from dynident.robot import BaseParameters
from dynident.tables import Table, number

_AGREES = 3.0  # standard deviations of corrected least squares


class FittedFactors(Protocol):
    """What the tables show of a fitted regression; see `JointFactorRegression`."""

    words: str
    coef_noisy_: np.ndarray
    coef_true_: np.ndarray
    sigma_true_: np.ndarray
    reliability_: np.ndarray
    known_: np.ndarray
    constant_: np.ndarray
    pruned_: np.ndarray
    basis_: BaseParameters | None
    corrected_: CorrectedLeastSquares | None
    bounds_: np.ndarray
    n_iter_: int
    ending_: str
    converged_: bool
    left_: float
    drift_: float

    def input_names(self) -> list[str]:
        """Return the names of the inputs."""
        ...


def factor_tables(regression: FittedFactors) -> tuple[Table, ...]:
    """Return a fitted regression as a table of its inputs, with its caveats."""
    names, corrected = regression.input_names(), regression.corrected_
    relevance = getattr(regression, "relevance_", None)
    rows = []
    for m, name in enumerate(names):
        row = [
            name,
            number(regression.coef_noisy_[m], 5),
            number(regression.coef_true_[m], 5),
            number(regression.sigma_true_[m], 3),
            number(regression.reliability_[m], 3),
            "given" if regression.known_[m] else "start, prior",
        ]
        row += [] if relevance is None else [number(relevance[m], 3)]
        if corrected is not None:
            row += [number(corrected.coef_[m], 5), number(corrected.sigma_[m], 3)]
        rows.append((*row, _word(regression, m)))
    columns = ["input", "b_noise", "b_true", "sigma", "reliability", "which is"]
    columns += [] if relevance is None else ["alpha"]
    columns += [] if corrected is None else ["corrected", "sigma"]
    title = regression.words[0].upper() + regression.words[1:]
    return (Table(title, (*columns, ""), tuple(rows), _notes(regression)),)


def _word(regression: FittedFactors, m: int) -> str:
    if regression.constant_[m]:
        return "constant"
    return "pruned" if regression.pruned_[m] else ""


def _notes(regression: FittedFactors) -> tuple[str, ...]:
    names, corrected = regression.input_names(), regression.corrected_
    notes = [
        _ended(regression),
        "b_noise predicts the output of inputs with noise; b_true is the law for inputs without.",
    ]
    if hasattr(regression, "relevance_"):
        notes.append("alpha is the precision of an input's prior: large where it is switched off.")
    unknown = ~regression.known_ & ~regression.constant_
    if np.any(unknown):
        words = "all inputs" if unknown.all() else _listed(names, unknown)
        notes.append(
            f"The noise of {words} was not given. Means and covariances do not tell it: b_true is "
            "what start and prior say, and has no sigma."
        )
    elif corrected is None:
        notes.append(
            "Taking the noise off leaves nothing in some direction: the data cannot carry "
            "corrected least squares, and b_true has no sigma."
        )
    else:
        notes.append(_beside(regression))
    if np.any(regression.pruned_):
        which = _listed(names, regression.pruned_)
        notes.append(f"Pruned, since they explain no more than noise (b_true zero): {which}.")
    low = (regression.reliability_ < LEAST_RELIABILITY) & unknown & ~regression.pruned_
    if np.any(low) and hasattr(regression, "relevance_"):
        notes.append(
            f"Reliability below {LEAST_RELIABILITY:g} by the prior alone, b_true therefore held at "
            f"{1 / LEAST_RELIABILITY:g} b_noise: {_listed(names, low)}."
        )
    if regression.basis_ is not None and regression.basis_.dependent:
        lost = ", ".join(regression.basis_.names[i] for i in regression.basis_.dependent)
        notes.append(f"Not identified on their own, being combinations of other inputs: {lost}.")
    return tuple(notes)


def _ended(regression: FittedFactors) -> str:
    bounds = regression.bounds_
    rounds = f"{regression.n_iter_} rounds, bound {bounds[-1]:.9g} nats"
    if regression.converged_:
        return f"Iterations {regression.ending_}: {rounds}."
    if regression.drift_ > 0:
        return (
            f"Iterations {regression.ending_} of the bound: {rounds}; for {regression.left_:.2g} "
            f"nats more a reliability would move by {regression.drift_:.2g}, and b_true with it "
            "(half a nat is worth one standard deviation). Lower tol to go on."
        )
    last = (
        f", and the last one still gained {bounds[-1] - bounds[-2]:.2g}" if len(bounds) > 1 else ""
    )
    return f"Not converged: {rounds}{last}. Raise max_iter."


def _beside(regression: FittedFactors) -> str:
    """What corrected least squares says of b_true."""
    corrected = regression.corrected_
    assert corrected is not None
    varied = ~regression.constant_
    sigma = np.where(varied & (corrected.sigma_ > 0), corrected.sigma_, 1.0)
    apart = float(np.max(np.abs(corrected.coef_ - regression.coef_true_) / sigma, initial=0.0))
    words = (
        f"Corrected least squares, which allows inputs to be correlated, stands beside it: "
        f"{100 * corrected.signal_share_:.3g} % of the worst direction is signal, condition number "
        f"{corrected.condition_number_:.3g}. b_true differs from it by up to {apart:.2g} of its "
    )
    words += "sigma." if apart < _AGREES else "sigma: the inputs are not independent. Prefer it."
    if corrected.signal_share_ < LEAST_SHARE * corrected.signal_share_doubt_:
        words += " So little signal is hardly known: intervals along that direction are too narrow."
    return words


def _listed(names: list[str], which: np.ndarray) -> str:
    return ", ".join(name for name, here in zip(names, which, strict=True) if here)
