"""How far a recording tells an effect from its rivals, and whether that decides which one it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from dynident.criteria import DEFAULTS
from dynident.tables import finite, number, percent

DECIDES = DEFAULTS.search.told_apart
"""Standard deviations that decide, where x / 2 > 1.96 + 1.28: the diagnosis compares the squared
residuals that two effects leave."""
ALIKE = DEFAULTS.search.alike
"""Share of what an effect explains up to which a diagnosis names what explains the rest with it,
however many standard deviations that share is, unless it has more parameters."""
NEVER = 0.1
"""Standard deviations below which no length of such a motion does."""
MOST_TIMES = 1000.0
_ROUGH = 0.1  # of a prediction, from which on its standard deviation is told


@dataclass(frozen=True, kw_only=True)
class Told:
    """What recordings tell of the nearest rival of an effect.

    Attributes
    ----------
    sigma : standard deviations by which the effect is told from it.
    share : of what the effect explains beside the model, which the rival cannot.
    share_alike : the same of the nearest rival with no more parameters; 1 where all have more.
    """

    sigma: float
    share: float
    share_alike: float

    @property
    def beyond(self) -> float:
        """By how much, of what a decision needs, that is exceeded; below zero it is not reached."""
        return min(self.sigma / DECIDES, self.share_alike / ALIKE) - 1.0


@dataclass(frozen=True, kw_only=True)
class Separation:
    """How far an effect stands from what the model with one of its rivals can imitate.

    Attributes
    ----------
    first, others : the effect that is taken for true, and its rivals.
    advice : the usual experiment that shows the first, in words.
    recorded, designed, usual : standard deviations, by the recordings so far; by these and the
        designed recording; by these and a usual motion of the same length.
    designed_sigma : standard deviation of what is predicted for the design, as the recordings so
        far tell the values of the first.
    share, share_alike : with the designed recording, of what the effect explains beside the model,
        which the nearest rival cannot; and which the nearest with no more parameters cannot.
    worth : length of usual motion that separates as far, over that of the design; infinite beyond a
        thousand.
    enough : length of the designed motion that decides, over what was asked for; likewise.
    """

    first: str
    others: tuple[str, ...]
    advice: str
    recorded: float
    designed: float
    usual: float
    designed_sigma: float
    share: float
    share_alike: float
    worth: float
    enough: float

    @property
    def decides(self) -> bool:
        """Whether their residuals will differ beyond chance nine times in ten, and by enough."""
        return self.told.beyond > 0

    @property
    def interval(self) -> tuple[float, float]:
        """Standard deviations between which the designed recording tells, with 95 %.

        It has noise, of one standard deviation, and the effect may be larger or smaller than the
        recordings so far say.
        """
        half = 1.96 * float(np.hypot(1.0, self.designed_sigma))
        return max(self.designed - half, 0.0), self.designed + half

    @property
    def told(self) -> Told:
        """What the recordings tell with the designed one."""
        return Told(sigma=self.designed, share=self.share, share_alike=self.share_alike)

    def sentence(self, length: float) -> str:
        """Say what the recording is worth, in plain words.

        Parameters
        ----------
        length : s, of the designed recording.
        """
        others = " and ".join(self.others)
        low, high = (number(one, 2) for one in self.interval)
        rough = self.designed_sigma > _ROUGH * self.designed
        known = f" ({low} to {high}, as far as its size is known)" if rough else ""
        words = (
            f"{length:g} s of this tell {self.first} from {others} by {number(self.designed, 3)} "
            f"standard deviations{known}; the recordings so far by {number(self.recorded, 3)}"
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
        if not np.isfinite(self.enough):
            return f"{words} That may not decide, however long it is: {self._alike()}."
        if self.share_alike <= ALIKE:
            return (
                f"{words} That may not decide: {self._alike()}; it is predicted to decide from "
                f"{number(self.enough, 2)} times that length on."
            )
        return (
            f"{words} That does not decide: {DECIDES:g}, from which on the residuals that they "
            f"leave differ beyond chance nine times in ten, take {number(self.enough, 2)} times as "
            "long."
        )

    def _alike(self) -> str:
        """Why many standard deviations may not decide."""
        if self.share_alike > ALIKE:
            return "too little of it is beyond the noise"
        return (
            f"all but {percent(self.share_alike, 2)} of what it explains is imitated, and up to "
            f"{percent(ALIKE, 1)} a diagnosis may name both"
        )

    def to_dict(self) -> dict[str, Any]:
        """The separation as JSON has it; what is infinite is null."""
        return {
            "first": self.first,
            "others": list(self.others),
            "recorded": self.recorded,
            "designed": self.designed,
            "interval": [finite(one) for one in self.interval],
            "usual": self.usual,
            "share": self.share,
            "share_alike": self.share_alike,
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
