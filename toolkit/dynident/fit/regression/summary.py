"""A factor regression in words and tables: what was found, and what it is worth."""

from __future__ import annotations

import numpy as np

from dynident.fit.regression.joint_factors import LEAST_RELIABILITY, JointFactorRegression
from dynident.tables import Table, number


def summary(regression: JointFactorRegression) -> tuple[Table, ...]:
    """Return a fitted regression as a table of its inputs, and its caveats."""
    names = regression.input_names()
    sigma_true = regression.sigma_true_
    rows = tuple(
        (
            name,
            number(regression.coef_noisy_[m], 5),
            number(regression.sigma_noisy_[m], 3),
            number(regression.coef_true_[m], 5),
            number(sigma_true[m], 3),
            number(regression.reliability_[m], 3),
            "given" if regression.known_[m] else "start and prior",
            _word(regression, m),
        )
        for m, name in enumerate(names)
    )
    columns = (
        "input",
        "b_noise",
        "sigma",
        "b_true",
        "sigma",
        "reliability",
        "which is",
        "",
    )
    return (Table("Regression with noisy inputs", columns, rows, _notes(regression)),)


def _word(regression: JointFactorRegression, m: int) -> str:
    if regression.constant_[m]:
        return "constant"
    return "pruned" if regression.pruned_[m] else ""


def _notes(regression: JointFactorRegression) -> tuple[str, ...]:
    names = regression.input_names()
    rounds = f"{regression.n_iter_} rounds, bound {regression.bounds_[-1]:.9g} nats"
    notes = [
        f"Converged: {rounds}."
        if regression.converged_
        else f"Not converged: {rounds}, and the last one still gained "
        f"{regression.bounds_[-1] - regression.bounds_[-2]:.2g}. Raise max_iter.",
        "b_noise predicts the output of inputs with noise; b_true is the law for inputs without.",
    ]
    unknown = ~regression.known_ & ~regression.constant_
    if np.any(unknown):
        words = "all inputs" if unknown.all() else _listed(names, unknown)
        notes.append(
            f"The noise of {words} was not given. The data do not tell it: their b_true is what "
            "start and prior say, and has no interval."
        )
    elif not regression.independent_:
        notes.append(
            "The inputs are not independent, as this model has them: b_true is not what corrected "
            "least squares finds, which allows for correlation. It has no intervals; use that."
        )
    if np.any(regression.pruned_ & ~regression.constant_):
        which = _listed(names, regression.pruned_ & ~regression.constant_)
        notes.append(f"Pruned, since they explain no more than noise (b_true zero): {which}.")
    low = regression.reliability_ < LEAST_RELIABILITY
    low &= ~(regression.known_ | regression.pruned_ | regression.constant_)
    if np.any(low):
        notes.append(
            f"Reliability below {LEAST_RELIABILITY:g} by the prior alone, b_true therefore held at "
            f"{1 / LEAST_RELIABILITY:g} b_noise: {_listed(names, low)}."
        )
    if regression.basis_ is not None and regression.basis_.dependent:
        lost = ", ".join(regression.basis_.names[i] for i in regression.basis_.dependent)
        notes.append(f"Not told on their own, being combinations of other inputs: {lost}.")
    return tuple(notes)


def _listed(names: list[str], which: np.ndarray) -> str:
    return ", ".join(name for name, here in zip(names, which, strict=True) if here)
