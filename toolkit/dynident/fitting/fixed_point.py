"""Repetition of a fit whose columns depend on its result, until both agree."""

from __future__ import annotations

import numpy as np

from dynident.model import Model

_SHRUNK = 0.9
"""Share of the change before which a change has to stay below, or the next step is shorter."""
_SHORTEST = 0.1
_NEAR = 1e-2
"""Relative change of the values below which they are near their end."""
_PATIENCE = 5
"""Repetitions after which the change is to be smaller than in as many before; near the end, half
of what it was."""


class FixedPoint:
    """Where the columns are taken next, with shorter steps while the values swing.

    A step that does not shrink the change overshoots: a half of it does.
    """

    def __init__(self) -> None:
        self._share, self._change = 1.0, np.inf
        self._relative: list[float] = []

    @property
    def stalls(self) -> bool:
        """Whether values no longer come nearer to their end.

        Columns that change by steps with the values, as those of a gap whose link knocks, let them
        jump to and fro by a little for ever; angles that hardly any row tells, from turn to turn.
        """
        before, last = self._relative[:-_PATIENCE][-_PATIENCE:], self._relative[-_PATIENCE:]
        # It may grow first, until the steps are short enough.
        if len(before) < _PATIENCE:
            return False
        return min(last) > (0.5 if min(last) < _NEAR else 1.0) * min(before)

    def following(self, model: Model, at: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Return the values at which the columns are taken next.

        Parameters
        ----------
        model : which says how far values may move at once.
        at : (p,) where the columns were taken.
        found : (p,) what was fitted with them.

        Returns
        -------
        (p,)
        """
        step = model.relaxed(at, found) - at
        change = float(np.linalg.norm(step))
        if change > _SHRUNK * self._change:
            self._share = max(self._share / 2, _SHORTEST)
        self._change = change
        self._relative.append(change / max(float(np.linalg.norm(found)), np.finfo(float).tiny))
        return at + self._share * step


def not_converged(change: float) -> str:
    """Say that values did not converge; `change` is the last one, relative."""
    return (
        "The columns that depend on the parameters themselves have not converged: in the last "
        f"round the values still changed by {100 * change:.2g} %."
    )
