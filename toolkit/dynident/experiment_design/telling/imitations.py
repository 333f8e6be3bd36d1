"""What rivals can imitate of an effect's torque, each in the shape in which it imitates most.

The search for a motion needs columns that do not change: there the rivals, in a few shapes each,
may be mixed as they please. A diagnosis adds one of them, and seeks its shape: what is said of a
motion is worked out with one rival at a time, in shapes from bound to bound.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from dynident.effects import Effect, ShapeParameter
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.information import ROUNDING
from dynident.experiment_design.telling.predictions import TellingForms
from dynident.experiment_design.telling.separation import Told
from dynident.model import Model
from dynident.robot import Robot

_MOST_SHAPES = 200  # of a rival
_BETWEEN = 4  # shapes, from one of the grid to the next
_AT_ONCE = 4000  # instants: columns of all shapes are large
_UNSEEN = 1e-7  # of the largest column: it makes no torque


@dataclass(frozen=True, eq=False)
class TellingMoments:
    """Products of whitened columns over some rows; those of other rows add up.

    Attributes
    ----------
    shared : (p + k, p + k) of the model's columns and, last, those of the effect.
    cross : (p + k, m) of these with the columns of all rivals in all shapes.
    own : (r, l, l) of the columns of each rival and shape; zero where it has fewer than l.
    """

    shared: np.ndarray
    cross: np.ndarray
    own: np.ndarray

    def __add__(self, other: TellingMoments) -> TellingMoments:
        return TellingMoments(
            self.shared + other.shared,
            self.cross + other.cross,
            self.own + other.own,
        )

    def __mul__(self, factor: float) -> TellingMoments:
        return TellingMoments(factor * self.shared, factor * self.cross, factor * self.own)


@dataclass(frozen=True, eq=False, kw_only=True)
class Imitations:
    """An effect that is taken for true, the model without it, and what may be taken for it.

    Attributes
    ----------
    model, values : without any of the effects, and its parameters (p,).
    columns : of the model, of further effects, and last of the effect.
    effect_values : of the effect, (k,).
    std : (n,) of the noise.
    rivals : each rival in each of its shapes.
    shapes : number of shape parameters of the effect.
    carries_payload : whether the payload of the model is on board.
    """

    model: Model
    values: np.ndarray
    columns: ColumnFunction
    effect_values: np.ndarray
    std: np.ndarray
    rivals: tuple[Effect, ...]
    shapes: int
    carries_payload: bool = False

    def moments(
        self, t: np.ndarray, motion: tuple[np.ndarray, ...], rows: float | None = None
    ) -> TellingMoments:
        """Return the moments of a motion.

        Parameters
        ----------
        t : (T,) s.
        motion : q, v, a, (T, n) each.
        rows : of each joint that the instants stand for; None for one each.
        """
        parts = np.array_split(np.arange(len(t)), -(-len(t) // _AT_ONCE))
        total = self._of_rows(t[parts[0]], [one[parts[0]] for one in motion])
        for part in parts[1:]:
            total = total + self._of_rows(t[part], [one[part] for one in motion])
        return total if rows is None else total * (rows / len(t))

    def _of_rows(self, t: np.ndarray, motion: Sequence[np.ndarray]) -> TellingMoments:
        every = self.columns.along(t, *motion)
        size, last = len(self.values), len(self.effect_values)
        first = self._white(np.delete(every, np.s_[size:-last], axis=2))
        crossed, own = [], np.zeros((len(self.rivals), self._most, self._most))
        block = self.model.block(t, *motion, carries_payload=self.carries_payload)
        for place, rival in enumerate(self.rivals):
            found = rival.columns(self.model.ready(rival, block, self.values))
            white, count = self._white(found), found.shape[2]
            crossed.append(first.T @ white)
            own[place, :count, :count] = white.T @ white
        return TellingMoments(first.T @ first, np.hstack(crossed), own)

    def _white(self, columns: np.ndarray) -> np.ndarray:
        return (columns / self.std[None, :, None]).reshape(-1, columns.shape[2])

    @property
    def _counts(self) -> list[int]:
        return [len(one.parameters(self.model.robot)) for one in self.rivals]

    @property
    def _is_larger(self) -> np.ndarray:
        """Whether a rival has more parameters, and columns that a diagnosis sees as they are, (r,).

        A diagnosis names no such rival that explains less, beyond chance.
        """
        sizes = np.array(self._counts) + [len(one.shape) for one in self.rivals]
        own = len(self.effect_values) + self.shapes
        return (sizes > own) & [one.is_exact for one in self.rivals]

    @property
    def _most(self) -> int:
        return max(self._counts)

    def told(self, moments: TellingMoments) -> Told:
        """Return what some rows tell of the rival that imitates the effect best."""
        return self.forms(moments).told(self.effect_values)

    def forms(self, moments: TellingMoments) -> TellingForms:
        """Return what some rows tell of an effect of any values."""
        shared, cross, p = moments.shared, moments.cross, len(self.values)
        size = np.sqrt(np.diag(shared)[:p])
        size = np.where(size > 0, size, 1.0)
        known, turn = np.linalg.eigh(shared[:p, :p] / np.outer(size, size))
        kept = known > ROUNDING * max(known[-1], 0.0) if len(known) else np.zeros(0, bool)
        # Whitened coordinates of what the model takes away from the others.
        cleared = (turn[:, kept] / np.sqrt(known[kept])).T / size
        of_effect, of_rivals = cleared @ shared[:p, p:], cleared @ cross[:p]
        whole = shared[p:, p:]
        alone, beside = whole - of_effect.T @ of_effect, cross[p:] - of_effect.T @ of_rivals
        torque = float(self.effect_values @ whole @ self.effect_values)
        largest = np.sqrt(max(np.diag(shared)[:p].max(initial=0.0), torque))
        left, start = [], 0
        for count, products in zip(self._counts, moments.own, strict=True):
            at = slice(start, start + count)
            start += count
            own = products[:count, :count] - of_rivals[:, at].T @ of_rivals[:, at]
            sizes = np.sqrt(np.diag(products)[:count])
            seen = sizes > _UNSEEN * largest
            own, sizes = own[np.ix_(seen, seen)], sizes[seen]
            left.append(alone - _explained(own, beside[:, at][:, seen], sizes))
        return TellingForms(
            whole=whole,
            alone=alone,
            left=np.array(left),
            larger=self._is_larger,
        )


def _explained(own: np.ndarray, beside: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Squares that columns explain, from their products with themselves and with others, (k, k)."""
    if not len(size):
        return np.zeros((len(beside), len(beside)))
    values, turn = np.linalg.eigh(own / np.outer(size, size))
    seen = values > ROUNDING
    along = (beside / size) @ turn[:, seen] / np.sqrt(values[seen])
    return along @ along.T


def shapes_of(rivals: Sequence[Effect], robot: Robot) -> tuple[Effect, ...]:
    """Return each rival as it is, and in shapes from bound to bound."""
    return tuple(shaped for rival in rivals for shaped in _shapes_of(rival, robot))


def _shapes_of(rival: Effect, robot: Robot) -> Iterator[Effect]:
    yield rival
    shapes = rival.shape_parameters(robot)
    if not shapes:
        return
    axes = [_finer(one) for one in shapes]
    every = [one for one in product(*axes) if one != tuple(rival.shape)]
    step = max(1, -(-len(every) // _MOST_SHAPES))
    for shape in dict.fromkeys((*every[::step], every[-1])):
        yield rival.shaped(*shape)


def _finer(shape: ShapeParameter) -> list[float]:
    """Values of a grid and its bounds, and some between each two, up to which a search goes."""
    known = np.array([shape.coordinate(x) for x in sorted({shape.lower, *shape.grid, shape.upper})])
    between = np.linspace(known[:-1], known[1:], _BETWEEN + 1, endpoint=False).ravel()
    return [shape.at(x) for x in (*between.tolist(), float(known[-1]))]
