"""How far a recording tells an effect from its rivals, and whether that decides which one it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from dynident.criteria import DEFAULTS
from dynident.tables import finite, number, percent

DECIDES = 6.5
"""Standard deviations that decide. The diagnosis compares the squared residuals that two effects
leave: x standard deviations apart they differ by x^2, with a standard deviation of 2 x. Nine times
in ten that is beyond 1.96 of these, the conventional level, where x / 2 > 1.96 + 1.28."""
ALIKE = DEFAULTS.search.alike
"""Share of what an effect explains up to which a diagnosis names what explains the rest with it,
however many standard deviations that share is, unless it has more parameters."""
NEVER = 0.1
"""Standard deviations below which no length of such a motion does."""
MOST_TIMES = 1000.0
SURE = 0.9
"""Chance from which on a recording is said to decide, whatever the size of the effect may be."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """What recordings tell of the nearest rival of an effect.

    Attributes
    ----------
    sigma : standard deviations by which the effect is told from it.
    share : of what the effect explains beside the model, which the rival cannot.
    share_alike : the same of the nearest of those rivals that have no more parameters, or columns
        that a diagnosis takes at a first guess; 1 where there is none.
    """

    sigma: float
    share: float
    share_alike: float

    @property
    def beyond(self) -> float:
        """By how much, of what a decision needs, that is exceeded; below zero it is not reached."""
        return float(self.beyond_of(*np.array([self.sigma, self.share_alike])))

    @staticmethod
    def beyond_of(sigma: np.ndarray, share_alike: np.ndarray) -> np.ndarray:
        """Return `beyond` of many.

        Parameters
        ----------
        sigma, share_alike : (d,) as of one.

        Returns
        -------
        (d,).
        """
        return np.minimum(sigma / DECIDES, share_alike / ALIKE) - 1.0


@dataclass(frozen=True, kw_only=True)
class Predicted:
    """What a designed recording will tell, as the recordings so far leave the effect's values open.

    Attributes
    ----------
    interval : standard deviations between which that lies, with 95 %: the recording has noise, and
        the effect may be larger or smaller; None where its size is not known.
    chance : with which it decides.
    """

    interval: tuple[float, float] | None
    chance: float


@dataclass(frozen=True, kw_only=True)
class Separation:
    """How far an effect stands from what the model with one of its rivals can imitate.

    Attributes
    ----------
    first, others : the effect that is taken for true, and its rivals.
    advice : the usual experiment that shows the first, in words.
    recorded, usual : standard deviations, by the recordings so far; by these and a usual motion of
        the same length as the design.
    predicted : what the design will tell, as far as the size of the first is known.
    told : what it tells if the first has the size that the recordings so far say.
    worth : length of usual motion that separates as far, over that of the design; infinite beyond a
        thousand.
    enough : length of the designed motion that decides, over what was asked for; likewise.
    """

    first: str
    others: tuple[str, ...]
    advice: str
    recorded: float
    usual: float
    predicted: Predicted
    told: Told
    worth: float
    enough: float

    @property
    def designed(self) -> float:
        """Standard deviations, by the recordings so far and the designed one."""
        return self.told.sigma

    @property
    def decides(self) -> bool:
        """Whether their residuals will differ beyond chance nine times in ten, and by enough."""
        return self.told.beyond > 0 and self.predicted.chance >= SURE

    def sentence(self, length: float) -> str:
        """Say what the recording is worth, in plain words.

        Parameters
        ----------
        length : s, of the designed recording.
        """
        others = " and ".join(self.others)
        words = (
            f"{length:g} s of this tell {self.first} from {others} by {number(self.designed, 3)} "
            f"standard deviations ({self._as_known()}); the recordings so far by "
            f"{number(self.recorded, 3)}"
        )
        if self.designed < NEVER:
            return (
                f"{words}. No motion within the limits tells them apart: another experiment might"
                f"{f', {self.advice}' if self.advice else ''}, or a load, another base, a sensor."
            )
        needs = f"{length * self.worth:.0f} s" if np.isfinite(self.worth) else "far longer"
        words += f"; a usual motion needs {needs}."
        if self.decides:
            return words
        if self.told.beyond > 0:
            return f"{words} That may not decide: the effect may be smaller than it seems so far."
        if not np.isfinite(self.enough):
            return f"{words} That may not decide, however long it is: {self._alike()}."
        if self.told.sigma < DECIDES and self.told.share_alike > ALIKE:
            return (
                f"{words} That does not decide: {DECIDES:g}, from which on the residuals that they "
                f"leave differ beyond chance nine times in ten, take {number(self.enough, 2)} "
                "times as long."
            )
        return (
            f"{words} That may not decide: {self._alike()}; it is predicted to decide from "
            f"{number(self.enough, 2)} times that length on."
        )

    def _as_known(self) -> str:
        """Between which limits that lies, in words."""
        if self.predicted.interval is None:
            return "if it is as large as it seems, which the recordings so far do not tell"
        low, high = (number(one, 3) for one in self.predicted.interval)
        return f"95 %: {low} to {high}"

    def _alike(self) -> str:
        """Why many standard deviations may not decide."""
        if self.told.share_alike <= ALIKE:
            return (
                f"all but {percent(self.told.share_alike, 2)} of what it explains is imitated, and "
                f"up to {percent(ALIKE, 1)} a diagnosis may name both"
            )
        return "too little of it is beyond the noise"

    def to_dict(self) -> dict[str, Any]:
        """The separation as JSON has it; what is infinite is null."""
        return {
            "first": self.first,
            "others": list(self.others),
            "recorded": self.recorded,
            "designed": self.designed,
            "interval": self.predicted.interval and list(self.predicted.interval),
            "chance": self.predicted.chance,
            "usual": self.usual,
            "share": self.told.share,
            "share_alike": self.told.share_alike,
            "decides": self.decides,
            "worth": finite(self.worth),
            "enough": finite(self.enough),
        }


def times_until(reached: Callable[[float], float]) -> float:
    """Return how many times as long a motion is to be until something is not below zero.

    Parameters
    ----------
    reached : of a multiple of the motion's length, and increasing.

    Returns
    -------
    Infinite where a thousand times are not enough; zero where none is needed.
    """
    if reached(MOST_TIMES) < 0:
        return float("inf")
    if reached(0.0) >= 0:
        return 0.0
    return float(brentq(lambda k: reached(float(k)), 0.0, MOST_TIMES))  # type: ignore[arg-type]
