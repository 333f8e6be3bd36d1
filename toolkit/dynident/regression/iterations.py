"""Rounds of variational EM until hardly anything is left to gain, faster where they creep.

Along a reliability that the data hardly identify, EM takes ten thousand rounds and more. Near
where it goes it is a linear iteration whose errors shrink by factors between 0 and 1, and Chebyshev
polynomials of it gain with the square of their degree what rounds gain one by one. A leap of that
kind is kept where the bound is higher after it; how much leaps still gain decides when to stop.

Golub and Varga, "Chebyshev semi-iterative methods, successive overrelaxation iterative methods, and
second order Richardson iterative methods", Numerische Mathematik 3 (1961). Schemes that take their
steps from the last differences (SQUAREM) are no faster, and their paths are chaotic: inputs in
another order or unit, whose rounding differs, would get another answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from dynident.moments import SecondMoments
from dynident.regression.factor_analysis import LEAST_VARIANCE, Gamma, Loadings, Posterior

_PATIENCE = 5
"""Leaps in a row that gain next to nothing: one may just have been unlucky."""
_NOTHING = 1e-3  # of the tolerance: a leap that gains no more is neither right nor wrong
_DEGREES = (2, 32)  # of a leap, least and most
_LITTLE = 0.05  # nats, where half a nat is worth one standard deviation
_STILL = 0.01  # change of a reliability, below which b_true does not depend on the end
_MATTERS = 0.01  # of the largest coefficient of standardised inputs
_FAR = (64, 128, 256, 512)  # degrees of leaps that are only looked at
_GROWTH, _RETREAT = 1.3, 2.0  # of the degree, after a leap that was right and one that was not
_LOGARITHM = 80.0  # largest, of a variance that a leap may ask for


class AnalysisEnding(Enum):
    """How the iterations ended."""

    CONVERGED = "converged"
    FLAT = "ended on a flat ridge"
    ROUNDING = "ended in rounding"
    ROUNDS_EXHAUSTED = "not converged"


@dataclass(frozen=True, eq=False, kw_only=True)
class Analysis:
    """Where the iterations ended.

    Attributes
    ----------
    factors : in the units of the statistics.
    coefficients : (d,) of E[y | x] under the factors' posterior; with wz, wx uncertain it differs
        from `factors.noisy` by their variances.
    rounds : how many there were, those of leaps counted.
    bounds : lower bound of the log evidence in nats, of every plain round and every leap; the last
        one is that of `factors`. In plain joint factor analysis the log-likelihood itself.
    ending : whether they ended by themselves.
    left : nats that are seen to be left where they ended; NaN where it was not looked for.
    drift : how far a reliability would go on for them, at most; NaN where it was not looked for.
    """

    factors: Loadings
    coefficients: np.ndarray
    rounds: int
    bounds: np.ndarray
    ending: AnalysisEnding
    left: float = np.nan
    drift: float = np.nan

    @property
    def bound(self) -> float:
        """The last bound, nats."""
        return float(self.bounds[-1])


def analyse(
    statistics: SecondMoments,
    start: Loadings,
    prior: Gamma | None,
    known: np.ndarray,
    *,
    rounds: int,
    tolerance: float,
) -> Analysis:
    """Iterate until hardly anything is left to gain.

    What is left is estimated from what leaps gain, in proportion to the square of their degree up
    to the largest, which is worth two thousand rounds of slow progress. Rounds do not show it:
    where they creep, the difference between two gains is rounding.

    Along a reliability that the data do not identify, a hundred thousand rounds may still be left.
    Leaps much longer than is stable look how far that is, and are not taken.

    Parameters
    ----------
    statistics : standardised.
    start : where to begin.
    prior : of the relevance; None for maximum likelihood (plain joint factor analysis).
    known : (d,) bool, inputs whose noise px is what the start says.
    rounds : at most so many.
    tolerance : nats that a leap of the largest degree may still gain.

    Returns
    -------
    The factors where the iterations ended, with the bounds on their way and how they ended.
    """
    here = Posterior(start, statistics)
    bounds, used, in_a_row, degree, little_gained = [here.bound(prior)], 0, 0, _DEGREES[0], 0
    ending, left, drift = AnalysisEnding.ROUNDS_EXHAUSTED, np.nan, np.nan
    while used < rounds:
        here = Posterior(here.updated(prior, known), statistics)
        bounds.append(here.bound(prior))
        used, in_a_row = used + 1, in_a_row + 1
        gain = bounds[-1] - bounds[-2]
        if gain <= here.rounding:
            at_rest = abs(gain) <= here.rounding < tolerance
            ending = AnalysisEnding.CONVERGED if at_rest else AnalysisEnding.ROUNDING
            break
        if in_a_row < 2 or used + degree > rounds:
            continue
        used, in_a_row = used + degree, 0
        # Gains that grow are those of a saddle that is being left.
        growing = gain - (bounds[-2] - bounds[-3]) > here.rounding
        with np.errstate(all="ignore"):  # it may go anywhere: its bound decides
            (there,) = _leaps(here, prior, known, (degree,))
            won = there.bound(prior) - bounds[-1]
        nothing = max(_NOTHING * tolerance, here.rounding)
        if not -nothing <= won < np.inf:
            degree = max(int(degree / _RETREAT), _DEGREES[0])
            continue
        little = won * (_DEGREES[1] / degree) ** 2 <= tolerance
        little_gained = little_gained + 1 if little and not growing else 0
        degree = min(int(_GROWTH * degree + 1), _DEGREES[1])
        if won > nothing:
            here = there
            bounds.append(bounds[-1] + won)
        if little_gained == _PATIENCE:
            ahead = _ahead(here, prior, known)
            left, drift = ahead.bound(prior) - here.bound(prior), _drift(here, ahead)
            flat = left > _LITTLE and drift > _STILL
            ending = AnalysisEnding.FLAT if flat else AnalysisEnding.CONVERGED
            break
    return Analysis(
        factors=here.factors,
        coefficients=here.b,
        rounds=used,
        bounds=np.array(bounds),
        ending=ending,
        left=left,
        drift=drift,
    )


def _ahead(here: Posterior, prior: Gamma | None, known: np.ndarray) -> Posterior:
    """Where the last leap ends before one that gains no more; here where the first does not.

    What a leap gains grows with its degree until it goes too far: then a longer one gains nothing.
    """
    best, highest = here, here.bound(prior)
    with np.errstate(all="ignore"):
        for there in _leaps(here, prior, known, _FAR):
            bound = there.bound(prior)
            if not highest < bound < np.inf:
                break
            best, highest = there, bound
    return best


def _drift(here: Posterior, there: Posterior) -> float:
    """Largest change of a reliability, among inputs that matter."""
    size = np.abs(here.b)
    matters = size > _MATTERS * size.max(initial=0.0)
    change = np.abs(there.factors.reliability - here.factors.reliability)
    return float(np.max(change, where=matters, initial=0.0))


def _leaps(
    here: Posterior, prior: Gamma | None, known: np.ndarray, degrees: tuple[int, ...]
) -> Iterator[Posterior]:
    """Apply T_n(2 M - 1) for the linear map M that a round is near its end; n are the degrees.

    They rise, and the way to each leads through those before it. Far from there a leap may end
    anywhere, out of the numbers as well: then its bound is no number.
    """
    # The weights have no variance in plain joint factor analysis.
    positive = _VARIANCES if prior is None else _POSITIVE

    def place(coordinates: np.ndarray) -> Posterior:
        return Posterior(_factors(coordinates, positive, here.factors, known), here.statistics)

    last = _coordinates(here.factors, positive)
    now, reached = 2 * _coordinates(here.updated(prior, known), positive) - last, 1
    for degree in degrees:
        for _ in range(degree - reached):
            after = _coordinates(place(now).updated(prior, known), positive)
            last, now = now, 2 * (2 * after - now) - last
        reached = degree
        yield place(now)


_VARIANCES = ("pz", "px")
_POSITIVE = ("wz_var", "wx_var", "relevance", *_VARIANCES)


def _coordinates(factors: Loadings, positive: tuple[str, ...]) -> np.ndarray:
    """Return weights, and logarithms of what is positive."""
    sizes = [getattr(factors, name) for name in positive]
    d = len(factors.wz)
    coordinates = np.concatenate([factors.wz, factors.wx, *sizes, [factors.py]])
    np.log(coordinates[2 * d :], out=coordinates[2 * d :])
    return coordinates


def _factors(
    coordinates: np.ndarray, positive: tuple[str, ...], like: Loadings, known: np.ndarray
) -> Loadings:
    """Return the factors at coordinates, with known noise and what those do not hold as `like`."""
    d = len(like.wz)
    wz, wx = coordinates[:d], coordinates[d : 2 * d]
    # Not np.clip: for few numbers its checks cost more than the rest of this.
    logs = np.minimum(np.maximum(coordinates[2 * d :], -_LOGARITHM), _LOGARITHM)
    sizes = np.exp(logs)
    parts = {name: sizes[k * d : (k + 1) * d] for k, name in enumerate(positive)}
    pz = np.maximum(parts.pop("pz"), LEAST_VARIANCE)
    px = np.where(known, like.px, np.maximum(parts.pop("px"), LEAST_VARIANCE))
    py = max(float(sizes[-1]), LEAST_VARIANCE)
    return Loadings(
        wz=wz,
        wx=wx,
        wz_var=parts.get("wz_var", like.wz_var),
        wx_var=parts.get("wx_var", like.wx_var),
        relevance=parts.get("relevance", like.relevance),
        pz=pz,
        px=px,
        py=py,
    )
