"""Repetition of a fit whose columns depend on its result, until both agree."""

from __future__ import annotations

import numpy as np

from dynident.model import Model

_FAST = 0.5
"""A change below this share of the one before is fast enough: the next step is as long."""
_SHORTEST = 0.1
_NEAR = 1e-2
"""Relative change of the values below which they are near their end."""
_PATIENCE = 5
"""Repetitions after which the change is to be smaller than in as many before; near the end, half
of what it was."""


class FixedPoint:
    """Where the columns are taken next, with shorter steps while the values swing.

    Where a change is not much smaller than the one before, the share of the next step is that at
    which, were values and changes on one line, the change would be zero (Irons and Tuck, A version
    of the Aitken accelerator for computer iteration, International Journal for Numerical Methods
    in Engineering, 1969). No step is longer than the plain one.
    """

    def __init__(self) -> None:
        self._share = 1.0
        self._at, self._step = np.zeros(0), np.zeros(0)
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
        step, before = model.relaxed(at, found) - at, self._step
        change = float(np.linalg.norm(step))
        if len(before) and change > _FAST * np.linalg.norm(before):
            # The caller may have gone another way than was said.
            turn, moved = step - before, at - self._at
            against = -float(moved @ turn)
            ideal = against / float(turn @ turn) if against > 0.0 else 1.0
            self._share = float(np.clip(ideal, _SHORTEST, 1.0))
        self._at, self._step = at, step
        self._relative.append(change / max(float(np.linalg.norm(found)), np.finfo(float).tiny))
        return at + self._share * step


def not_converged(change: float) -> str:
    """Say that values did not converge; `change` is the last one, relative."""
    return (
        "The columns that depend on the parameters themselves have not converged: in the last "
        f"round the values still changed by {100 * change:.2g} %."
    )
