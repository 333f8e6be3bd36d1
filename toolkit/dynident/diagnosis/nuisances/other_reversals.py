"""Laws of dry friction that are not the model's Fc tanh(v / w): as what each has more than that."""

from __future__ import annotations

from abc import abstractmethod
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial.hermite_e import hermegauss

from dynident.diagnosis.nuisances.friction_width import FrictionWidthColumn
from dynident.effects import Block, ShapeParameter
from dynident.tables import number

_WIDTHS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4)
_LEADS = (-8e-3, -4e-3, -2e-3, -1e-3, 0.0, 1e-3, 2e-3, 4e-3, 8e-3)
_RANGE = (0.02, 15.0)
"""Narrowest and widest law that is tried, over the model's width."""
LATEST = 0.01
"""s by which friction may reverse before the joint, or after it; a law that wants more is none."""
AT_ONCE = 5e-5
"""s, below which it reverses with the joint."""
TURNED = 3.0
"""Speed over the width at which dry friction has turned: tanh(3) is 0.995."""
_JITTERS, _DAMPINGS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0), (1.0, 3.0, 10.0, 30.0, 100.0)
_JITTER_RANGE, _DAMPING_RANGE = (0.1, 4.0), (0.1, 1000.0)
_NODES = 61  # of a quadrature over the jitter
_FAST = 20.0
"""Speed over the width at which no jitter that is tried brings a joint near its reversal."""


class OtherReversal(FrictionWidthColumn):
    """What dry friction of another law has more than the model's."""

    in_catalogue = False
    sign_of = "opposite spikes on both sides of zero velocity"
    experiment = "reverse {joint} at several accelerations"

    def at_joint(self, block: Block) -> np.ndarray:
        j = block.index(self.joint)
        width = float(np.broadcast_to(block.friction_width, len(block.names))[j])
        return self.direction(block.v[:, [j]], block.a[:, [j]], width) - block.direction(self.joint)

    @abstractmethod
    def direction(self, v: np.ndarray, a: np.ndarray, width: float) -> np.ndarray:
        """Friction over its level.

        Parameters
        ----------
        v, a : (T, 1) rad/s and rad/s^2, or m/s and m/s^2.
        width : of the model, rad/s or m/s.

        Returns
        -------
        (T, 1) from -1 to 1.
        """

    @property
    def lead_s(self) -> float:
        """By which it reverses before the joint."""
        return 0.0

    @abstractmethod
    def turned(self, fastest: float) -> float:
        """Speed over the model's width from which on it has turned.

        Parameters
        ----------
        fastest : usual highest acceleration over the model's width, 1/s.
        """

    @abstractmethod
    def in_words(self, width: float, unit: str) -> str:
        """The law, a clause; `width` is the model's, of a speed in `unit`."""


class SmoothReversal(OtherReversal):
    """Dry friction that reverses over k times the width, at another moment."""

    name = "smooth_reversal"
    law = "Fc (tanh((v + lead a)/(k w)) - tanh(v/w))"
    reverses_how = "reverses"

    def shape_parameters(self, robot):
        return (
            ShapeParameter("k", "1", _WIDTHS, lower=_RANGE[0], upper=_RANGE[1]),
            ShapeParameter("lead", "s", _LEADS, lower=-LATEST, upper=LATEST),
        )

    def direction(self, v: np.ndarray, a: np.ndarray, width: float) -> np.ndarray:
        return self.reversal((v + self.lead_s * a) / (self.shape[0] * width))

    @property
    def lead_s(self) -> float:
        return self.shape[1]

    def turned(self, fastest: float) -> float:
        return TURNED * max(self.shape[0], 1.0) + abs(self.lead_s) * fastest

    def in_words(self, width: float, unit: str) -> str:
        lead = self.lead_s
        words = f"{self.reverses_how} over {number(self.shape[0] * width, 2)} {unit}"
        if abs(lead) < AT_ONCE:
            return words
        when = "before" if lead > 0 else "after"
        return f"{words}, {number(1e3 * abs(lead), 2)} ms {when} the joint"

    @staticmethod
    def reversal(x: np.ndarray) -> np.ndarray:
        """Return a smoothed sign of x."""
        return np.tanh(x)


class StraightReversal(SmoothReversal):
    """The same of dry friction that goes through zero along a line."""

    name = "straight_reversal"
    law = "Fc (clip((v + lead a)/(k w), -1, 1) - tanh(v/w))"
    reverses_how = "reverses along a straight line"

    @staticmethod
    def reversal(x: np.ndarray) -> np.ndarray:
        return np.clip(x, -1.0, 1.0)


class DitheredReversal(OtherReversal):
    """Dry friction in the mean over a jitter of the speed, normally distributed.

    The jitter's variance is (s w)^2 / (1 + r / cosh(v/w)^2): where friction grows with the speed it
    damps the jitter, as white noise drives it in proportion to 1 / (damping of the loop and of
    friction). Where much of a large jitter is damped, friction may fall before it has turned.
    """

    name = "dithered_reversal"
    law = "Fc (mean of tanh((v + jitter)/w) - tanh(v/w))"

    def shape_parameters(self, robot):
        return (
            ShapeParameter("s", "1", _JITTERS, lower=_JITTER_RANGE[0], upper=_JITTER_RANGE[1]),
            ShapeParameter("r", "1", _DAMPINGS, lower=_DAMPING_RANGE[0], upper=_DAMPING_RANGE[1]),
        )

    def direction(self, v: np.ndarray, a: np.ndarray, width: float) -> np.ndarray:
        x, mean = _mean_over_jitter(*self.shape)
        return np.sign(v) * np.interp(np.abs(v) / width, x, mean)

    def turned(self, fastest: float) -> float:
        return TURNED + 2.0 * self.shape[0]

    def in_words(self, width: float, unit: str) -> str:
        s, r = self.shape
        away, at = (number(one * width, 2) for one in (s, s / np.sqrt(1.0 + r)))
        return (
            f"is the mean over a jitter of the speed, of {away} {unit} (standard deviation) away "
            f"from the reversal and {at} {unit} at it"
        )


@lru_cache(maxsize=64)
def _mean_over_jitter(s: float, r: float) -> tuple[np.ndarray, np.ndarray]:
    """Speeds over the width, and dry friction over its level there."""
    nodes, weights = _quadrature()
    x = np.linspace(0.0, _FAST, 500)
    jitter = s / np.sqrt(1.0 + r / np.cosh(x) ** 2)
    return x, np.tanh(x[:, None] + jitter[:, None] * nodes) @ weights


@cache
def _quadrature() -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a standard normal variable, but for those that add nothing, and their weights."""
    nodes, weights = hermegauss(_NODES)
    counting = weights > np.finfo(float).eps ** 2 * weights.max()
    return nodes[counting], weights[counting] / weights[counting].sum()


LAWS = (SmoothReversal, StraightReversal, DitheredReversal)
"""That are tried in the place of the model's."""
