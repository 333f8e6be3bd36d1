"""Which terms of the library take most off the residual: all of them at once, on moments.

Terms are evaluated on the rows of the regression, whose motion is low-passed already: that is not
quite the low-passed term, and near enough to choose which few are then evaluated as effects are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

from dynident.diagnosis.proposals.term_library import Factor, LibraryTerm
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.model_columns import model_columns
from dynident.evidence.runs import Run
from dynident.formulas import Formula, Signal, evaluate, parse_formula
from dynident.moments.second_moments import SecondMoments

_AT_ONCE = 48  # terms
_MOST_FACTORS = 3


@dataclass(frozen=True, kw_only=True)
class Screened:
    """A term, and what it would take off the residual.

    Attributes
    ----------
    term : the term.
    drop : of the squared, whitened, noise-free residual.
    penalised : drop less the price of its columns, of the library and of its factors.
    """

    term: LibraryTerm
    drop: float
    penalised: float


def screen(
    evidence: Evidence,
    fitted: EvidenceFit,
    joint: int,
    terms: Sequence[LibraryTerm],
    *,
    beside: int = 0,
) -> tuple[Screened, ...]:
    """Return the terms that would bring more than they cost, best first.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them, in the metric in which terms are
        compared.
    joint : column of the joint at which they act.
    terms : that are tried.
    beside : terms that were tried before, and led to these.

    Notes
    -----
    With C the columns of a term, X the model's and y the torque: B solves the regression of C on X,
    G = C'C - (C'X) B, m = C'y - B'X'y, and the drop is m' G^-1 m.
    """
    products = _Products(terms)
    rows = [
        [one.factors(products) for one in _TermRows.of(evidence, fitted, r, joint)]
        for r in range(len(evidence.runs))
    ]
    drops = np.concatenate(
        [
            _drops(evidence, fitted, joint, rows, products.some(start, start + _AT_ONCE))
            for start in range(0, len(terms), _AT_ONCE)
        ]
    )
    count = Counter(products.sizes.tolist())
    criteria = evidence.criteria.proposals
    priced = []
    for term, size, drop in zip(terms, products.sizes.tolist(), drops.tolist(), strict=True):
        price = size * np.log(fitted.rows) + 2.0 * np.log(beside + count[size])
        price += criteria.factor_price * term.price
        priced.append(Screened(term=term, drop=drop, penalised=drop - float(price)))
    priced.sort(key=lambda one: -one.penalised)
    return tuple(one for one in priced if one.penalised > 0)


class _Products:
    """Terms as products of rows: of the columns of their factors, which many have in common.

    Parameters
    ----------
    terms : of up to three factors each.

    Attributes
    ----------
    factors : each once.
    sizes : (m,) number of columns of each term.
    starts : (m + 1,) where its columns begin among those of all terms.
    rows : (3, K) which rows are multiplied for each column; row 0 is for ones.
    """

    def __init__(self, terms: Sequence[LibraryTerm]) -> None:
        self.factors: dict[Factor, int] = {}
        places: list[tuple[int, ...]] = []
        sizes, free = [], 1
        for term in terms:
            sizes.append(term.size)
            for one in term.factors:
                if one not in self.factors:
                    self.factors[one] = free
                    free += len(one.texts)
            columns = (
                range(self.factors[one], self.factors[one] + len(one.texts)) for one in term.factors
            )
            for at in product(*columns):
                places.append((*at, *(0,) * (_MOST_FACTORS - len(at))))
        self.sizes = np.array(sizes, dtype=int)
        self.starts = np.concatenate([[0], np.cumsum(self.sizes)])
        self.rows = np.array(places, dtype=int).reshape(-1, _MOST_FACTORS).T

    def some(self, first: int, last: int) -> _SomeProducts:
        """Return those of some terms."""
        sizes = self.sizes[first:last]
        start = self.starts[first]
        return _SomeProducts(sizes=sizes, rows=self.rows[:, start : start + sizes.sum()])


@dataclass(frozen=True, eq=False, kw_only=True)
class _SomeProducts:
    """Some of the terms of `_Products`.

    Attributes
    ----------
    sizes : (m,) number of columns of each.
    rows : (3, K) which rows are multiplied for each column.
    """

    sizes: np.ndarray
    rows: np.ndarray

    def columns(self, factors: np.ndarray) -> np.ndarray:
        """Columns of the terms, (T, K), of the rows of their factors (R, T)."""
        first, *others = self.rows
        found = factors[first]
        for places in others:
            if places.any():
                found *= factors[places]
        return found.T


def _drops(
    evidence: Evidence,
    fitted: EvidenceFit,
    joint: int,
    rows: Sequence[Sequence[np.ndarray]],
    terms: _SomeProducts,
) -> np.ndarray:
    """What each of some terms takes off, (m,)."""
    starts = np.cumsum(terms.sizes) - terms.sizes
    sizes = sorted(set(terms.sizes.tolist()))
    alike = [np.flatnonzero(terms.sizes == size) for size in sizes]
    places = [starts[which][:, None] + np.arange(k) for which, k in zip(alike, sizes, strict=True)]
    with_model: list[SecondMoments] = []
    with_own: list[list[SecondMoments]] = [[] for _ in alike]
    for stack, known in zip(evidence.stacks, fitted.white, strict=True):
        signals = [[[terms.columns(one)] for one in rows[r]] for r in stack.numbers]
        white = stack.whitened(signals, joint, fitted.noise[joint])
        with_model.append(known[joint].moments_with(white))
        for own, at in zip(with_own, places, strict=True):
            of_each = white[:, at]  # products of two terms are not needed
            own.append(stack.moments(of_each, of_each))
    beside = SecondMoments.stacked(with_model).pooled().signal
    p = len(fitted.values)
    back = fitted.solution.project(beside[:p])
    moment = beside[p] - back.T @ fitted.pooled.signal[:p, p]
    found, least = np.zeros(len(terms.sizes)), evidence.criteria.proposals.least_left
    for which, at, some in zip(alike, places, with_own, strict=True):
        own = SecondMoments.stacked(some).pooled().signal
        left = own - np.einsum("pmi,pmj->mij", beside[:p, at], back[:, at])
        found[which] = _taken_off(own, left, moment[at], least)
    return found


def _taken_off(own: np.ndarray, left: np.ndarray, moment: np.ndarray, least: float) -> np.ndarray:
    """What columns take off, of which at least a share must be left beside the model.

    Parameters
    ----------
    own, left : (m, k, k) products of the columns of each term, and of what is left of them.
    moment : (m, k) of what is left of them with the residual.
    least : share.

    Returns
    -------
    (m,); zero where columns are zero or no numbers.
    """
    scale = np.sqrt(np.clip(np.diagonal(own, axis1=1, axis2=2), 0.0, None))
    sound = np.isfinite(own).all(axis=(1, 2)) & (scale > 0).all(axis=1)
    scale = scale[sound]
    size, turn = np.linalg.eigh(left[sound] / (scale[:, :, None] * scale[:, None, :]))
    along = np.einsum("mij,mi->mj", turn, moment[sound] / scale)
    found = np.zeros(len(own))
    found[sound] = np.divide(along**2, size, out=np.zeros_like(size), where=size > least).sum(
        axis=1
    )
    return found


@lru_cache(maxsize=4096)
def _formulas(factor: Factor) -> tuple[Formula, ...]:
    """The columns of a factor, read; each recording asks for them."""
    return tuple(parse_formula(text) for text in factor.columns())


@dataclass(frozen=True, eq=False)
class _TermRows:
    """The rows of one replicate, of which formulas take their values.

    Attributes
    ----------
    run, place : the run, and which of its replicates.
    names : of the joints.
    joint : of the law.
    widths : of dry friction, (n,).
    load : (T,) predicted torque of that joint.
    """

    run: Run
    place: int
    names: tuple[str, ...]
    joint: int
    widths: np.ndarray
    load: np.ndarray

    @classmethod
    def of(cls, evidence: Evidence, fitted: EvidenceFit, run: int, joint: int) -> list[_TermRows]:
        columns = model_columns(evidence, fitted.model, run, joint, fitted.values)
        whose = evidence.runs[run]
        return [
            cls(
                run=whose,
                place=place,
                names=fitted.model.robot.names,
                joint=joint,
                widths=fitted.model.friction_widths,
                load=one[:, :-1] @ fitted.values,
            )
            for place, one in enumerate(columns)
        ]

    def factors(self, products: _Products) -> np.ndarray:
        """Columns of all factors, (R, T), after one of ones."""
        found = np.ones((1 + sum(len(one.texts) for one in products.factors), len(self.load)))
        for factor, first in products.factors.items():
            for row, formula in enumerate(_formulas(factor), first):
                found[row] = evaluate(formula, self)
        return found

    def signal(self, signal: Signal) -> Any:
        sampled = self.run.replicates[self.place]
        j = self.joint if signal.joint is None else self.names.index(signal.joint)
        match signal.quantity:
            case "t":
                return sampled.t + sampled.recording.start
            case "load":
                return self.load
        return getattr(sampled, signal.quantity)[:, j]

    def parameter(self, name: str) -> Any:
        raise AssertionError(f"a term has no parameter: {name}")

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        width = max(
            float(self.widths[self.joint if one is None else self.names.index(one)])
            for one in joints
        )
        return np.tanh(speed / width)
