"""Lines in the spectrum of a residual over positions: shapes between those of a grid, or beyond it.

Over a travel L two waves of the position can be told apart where their phases per metre or radian
differ by about pi / L. A grid that is as dense as that would cost more than all other candidates; a
spectrum over the positions costs next to nothing and says where a line may be. What it names is
then judged as any shape is, and every line that it could have named counts as tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynident.effects.effect import Effect
from dynident.robot import Robot

_HIGHEST = 12
"""Lines that are named: the highest, since unlike the fit a spectrum does not weight the rows."""
_BINS = 8
"""Bins of position in the shortest wave: what lies in one is out of phase by 45 degrees at most."""
_BETWEEN = 4
"""Values of the spectrum for each line that can be told from its neighbours."""
_MOVING = 1e-3
"""Of its highest speed, with which a joint moves at least."""
_LONGEST = 250.0
"""Travel in m or rad beyond which no spectrum is taken: it would fill the memory, and a length that
long is more likely one in mm."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PositionLines:
    """Where lines over the position of a joint are looked for.

    Attributes
    ----------
    effect : of which they are shapes.
    grid : the values of its shape that are tried in any case.
    low, high : limits of the phase per unit of position.
    width : by how much two lines must differ to be told apart.
    """

    effect: Effect
    grid: tuple[float, ...]
    low: float
    high: float
    width: float

    @classmethod
    def of(
        cls, effect: Effect, robot: Robot, motion: tuple[np.ndarray, np.ndarray], rate_hz: float
    ) -> PositionLines | None:
        """Return where lines are looked for along a motion.

        Beyond the grid no further than rows can show them that are as fast as half of those in
        which the joint moves: at a thousandth of its highest speed and more.

        Parameters
        ----------
        effect : at a joint.
        robot : whose joint it is.
        motion : positions (T,) and velocities (T,) of the joint, in rad or m and s.
        rate_hz : of the rows.

        Returns
        -------
        None for an effect without such shapes, and along a motion of which no spectrum is taken.
        """
        limits, (q, v) = effect.lines_over_position(robot), motion
        travel = float(np.ptp(q))
        if limits is None or not 0 < travel <= _LONGEST:
            return None
        grid = effect.shape_parameters(robot)[0].grid
        speed = np.abs(v)
        moving = speed[speed > _MOVING * speed.max()]
        shown = max(grid[-1], math.pi * rate_hz / float(np.median(moving))) if len(moving) else 0.0
        low, high = limits[0], min(limits[1], shown)
        return cls(effect=effect, grid=grid, low=low, high=high, width=math.pi / travel)

    @property
    def inside(self) -> list[float]:
        """Values of the grid between the limits."""
        return [x for x in self.grid if self.low <= x <= self.high]

    @property
    def tried(self) -> int:
        """Shapes within the grid that count as tried: its own, and lines that could be named."""
        end = max(self.low, min(self.high, self.grid[-1]))
        more = math.ceil((end - self.low) / self.width)
        return len(self.grid) - len(self.inside) + max(len(self.inside), more)

    @property
    def beyond(self) -> int:
        """Lines beyond the grid that the spectrum could name."""
        return max(0, math.ceil((self.high - max(self.low, self.grid[-1])) / self.width))

    def highest(self, q: np.ndarray, residual: np.ndarray) -> tuple[Effect, ...]:
        """Return the effect with the shapes at which the spectrum of a residual is highest.

        Parameters
        ----------
        q : (T,) positions of the joint, in rad or m.
        residual : (T,) there, zero in rows that do not count.

        Returns
        -------
        Highest first; none where the grid is near enough to every line.
        """
        known = self.inside
        near = len(known) > 1 and self.width >= np.diff(known).max()
        if near or not self.low < self.high:
            return ()
        at, power = self._spectrum(q, residual)
        seen = at >= self.low
        at, power = at[seen], power[seen]
        inner = power[1:-1]
        peaks = 1 + np.flatnonzero((inner > power[:-2]) & (inner >= power[2:]))
        first = peaks[np.argsort(-power[peaks], kind="stable")][:_HIGHEST]
        return tuple(self.effect.shaped(float(at[one])) for one in first)

    def _spectrum(self, q: np.ndarray, e: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Phases per unit of position, and the power of a residual at them."""
        travel = float(np.ptp(q))
        bins = math.ceil(_BINS * self.high * travel / (2.0 * math.pi)) + 1
        size = travel / (bins - 1)
        number = np.rint((q - q.min()) / size).astype(int)
        along = np.bincount(number, weights=e - e.mean(), minlength=bins)
        length = max(bins, math.ceil(2.0 * math.pi * _BETWEEN / (self.width * size)))
        power = np.abs(np.fft.rfft(along, length)) ** 2
        at = 2.0 * math.pi * np.arange(len(power)) / (length * size)
        within = at <= self.high
        return at[within], power[within]
