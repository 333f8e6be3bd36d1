"""Which terms of the library take most off the residual: all of them at once, on moments.

Terms are evaluated on the rows of the regression, whose motion is low-passed already: that is not
quite the low-passed term, and near enough to choose which few are then evaluated as effects are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import reduce
from operator import mul
from typing import Any

import numpy as np

from dynident.diagnosis.proposals.term_library import Factor, LibraryTerm
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.model_columns import model_columns
from dynident.evidence.runs import Run
from dynident.formulas import Signal, evaluate, parse_formula
from dynident.moments.second_moments import SecondMoments

_AT_ONCE = 48  # terms; the products of two of them are not needed, and grow with the square


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
    rows = [_TermRows.of(evidence, fitted, r, joint) for r in range(len(evidence.runs))]
    found = []
    for start in range(0, len(terms), _AT_ONCE):
        found += _screened(evidence, fitted, joint, rows, terms[start : start + _AT_ONCE])
    count = {size: sum(t.size == size for t in terms) for size in {t.size for t in terms}}
    criteria = evidence.criteria.proposals
    priced = []
    for term, drop in found:
        price = term.size * np.log(fitted.rows) + 2.0 * np.log(beside + count[term.size])
        price += criteria.factor_price * term.price
        priced.append(Screened(term=term, drop=drop, penalised=drop - float(price)))
    priced.sort(key=lambda one: -one.penalised)
    return tuple(one for one in priced if one.penalised > 0)


def _screened(
    evidence: Evidence,
    fitted: EvidenceFit,
    joint: int,
    rows: Sequence[list[_TermRows]],
    terms: Sequence[LibraryTerm],
) -> list[tuple[LibraryTerm, float]]:
    with_model, with_self = [], []
    for r, (run, replicates) in enumerate(zip(evidence.runs, rows, strict=True)):
        signals = [[one.columns(term) for term in terms] for one in replicates]
        white = run.whitened_parts(signals, joint, fitted.noise[joint])
        with_model.append(fitted.white[r][joint].moments_with(white))
        with_self.append(run.moments(white, white))
    beside = SecondMoments.stacked(with_model).pooled().signal
    own = SecondMoments.stacked(with_self).pooled().signal
    p = len(fitted.values)
    back = fitted.solution.project(beside[:p])
    left = own - beside[:p].T @ back
    moment = beside[p] - back.T @ fitted.pooled.signal[:p, p]
    least, found, start = evidence.criteria.proposals.least_left, [], 0
    for term in terms:
        part = slice(start, start + term.size)
        start = part.stop
        found.append((term, _drop(own[part, part], left[part, part], moment[part], least)))
    return found


def _drop(own: np.ndarray, left: np.ndarray, moment: np.ndarray, least: float) -> float:
    """What columns take off, of which at least a share must be left beside the model."""
    scale = np.sqrt(np.clip(np.diag(own), 0.0, None))
    if not np.all(np.isfinite(own)) or not np.all(scale > 0):
        return 0.0
    size, turn = np.linalg.eigh(left / np.outer(scale, scale))
    along = turn.T @ (moment / scale)
    kept = size > least
    return float(np.sum(along[kept] ** 2 / size[kept]))


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
    known: dict[str, np.ndarray] = field(default_factory=dict)
    factors: dict[Factor, np.ndarray] = field(default_factory=dict)

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

    def columns(self, term: LibraryTerm) -> np.ndarray:
        """Columns of a term, (T, k)."""
        return reduce(mul, (self._columns_of(factor) for factor in term.factors))

    def _columns_of(self, factor: Factor) -> np.ndarray:
        """Columns of a factor, (T, k), which many terms have in common."""
        if factor not in self.factors:
            values = [self._value(text) for text in factor.columns()]
            size = len(self.load)
            self.factors[factor] = np.stack([np.broadcast_to(v, size) for v in values], axis=1)
        return self.factors[factor]

    def _value(self, text: str) -> np.ndarray:
        if text not in self.known:
            self.known[text] = np.asarray(evaluate(parse_formula(text), self), dtype=float)
        return self.known[text]

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
