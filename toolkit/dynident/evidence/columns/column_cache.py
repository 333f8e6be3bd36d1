"""Columns that were evaluated, by all that they depend on: nothing is ever invalidated.

Four kinds of columns are kept, each as long as something can ask for it again. Those that follow
from the motion alone live as long as the motion, put together joint by joint for its rows as long
as the recording whose rows these are. Those that depend on the fit belong to a
linearisation, the model and the values at which they were taken; the latest one is kept, and with
another one goes all that belongs to an older. Those of a first look live as long as that look.
Of shapes that are tried once, a search from other beginnings tries many again: the latest are kept.
What was worked out of the columns is kept as well, as long as the same fit to the same runs is
asked about.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from dynident.fitting.sampling import Sampled
from dynident.recording import Motion

_LATEST = 2**26
"""Bytes of columns of shapes that were tried last."""


class FirstLook:
    """A first look at candidates, by its identity; see `Evidence.first_look`."""


Kept = dict[Hashable, Any]
"""Columns, or what columns are made of, by what they depend on besides their scope."""


class Tried:
    """Columns of shapes that were tried last; the oldest make room for others."""

    def __init__(self, most: int = _LATEST) -> None:
        self._most, self._size = most, 0
        self._columns: OrderedDict[Hashable, np.ndarray] = OrderedDict()

    def get(self, key: Hashable) -> np.ndarray | None:
        """Return what is kept under a key, or None."""
        if key in self._columns:
            self._columns.move_to_end(key)
        return self._columns.get(key)

    def put(self, key: Hashable, columns: np.ndarray) -> None:
        """Keep columns under a new key."""
        self._columns[key] = columns
        self._size += columns.nbytes
        while self._size > self._most:
            self._size -= self._columns.popitem(last=False)[1].nbytes


class ColumnCache:
    """What was evaluated of a robot along motions; shared by all evidence of one model."""

    def __init__(self) -> None:
        self._of_motions: WeakKeyDictionary[Motion, Kept] = WeakKeyDictionary()
        self._of_rows: WeakKeyDictionary[Sampled, Kept] = WeakKeyDictionary()
        self._of_looks: WeakKeyDictionary[FirstLook, Kept] = WeakKeyDictionary()
        self._linearisation: Hashable = None
        self.tried = Tried()
        self._linearised: Kept = {}
        self._asked: tuple[object, ...] = ()
        self._answers: Kept = {}

    def along(self, motion: Motion) -> Kept:
        """Return what follows from a motion alone."""
        return self._of_motions.setdefault(motion, {})

    def rows_of(self, sampled: Sampled) -> Kept:
        """Return what follows from the motion alone and is put together for a recording's rows."""
        return self._of_rows.setdefault(sampled, {})

    def at(self, linearisation: Hashable) -> Kept:
        """Return what depends on a linearisation; what belongs to an older one is gone."""
        if linearisation != self._linearisation:
            self._linearisation, self._linearised = linearisation, {}
        return self._linearised

    def seen_in(self, look: FirstLook) -> Kept:
        """Return what a first look has evaluated."""
        return self._of_looks.setdefault(look, {})

    def answers_of(self, *asked: object) -> Kept:
        """Return what was worked out of these very objects; what was of others is gone."""
        same = len(asked) == len(self._asked)
        if not same or any(one is not two for one, two in zip(asked, self._asked, strict=True)):
            self._asked, self._answers = asked, {}
        return self._answers
