"""What a motion leaves free: a clearance, and boxes that points of the robot stay in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.experiment_design.geometry.clearance import Clearance
from dynident.experiment_design.geometry.surroundings import StayBox
from dynident.experiment_design.motion_limits import above_instants

_STEP = 1e-5  # rad or m, of a slope


@dataclass(frozen=True, eq=False)
class RoomCut:
    """A bound on the position at an instant, by which room is made near a known position.

    Attributes
    ----------
    t : s.
    slope : (n,) of the room, m per rad or m.
    least : of slope @ q(t).
    """

    t: float
    slope: np.ndarray
    least: float


@dataclass(frozen=True, eq=False)
class Workspace:
    """Where a robot may be.

    Attributes
    ----------
    clearance : that is kept, if any.
    boxes : that points stay in.
    """

    clearance: Clearance | None = None
    boxes: tuple[StayBox, ...] = ()

    @property
    def is_free(self) -> bool:
        """Whether the robot may be anywhere."""
        return self.clearance is None and not self.boxes

    def rooms(self, q: np.ndarray) -> np.ndarray:
        """Return the room to each boundary along a motion, (T, k) m; below 0 where one is crossed.

        Parameters
        ----------
        q : (T, n) rad or m.
        """
        found = [box.room(q) for box in self.boxes]
        if self.clearance is not None:
            found.append(self.clearance.along(q) - self.clearance.margin)
        return np.stack(found, axis=1) if found else np.full((len(q), 1), np.inf)

    def admits(self, q: np.ndarray) -> bool:
        """Whether no boundary is crossed along a motion (T, n), between its instants neither.

        Parameters
        ----------
        q : (T, n) rad or m, at instants that are evenly spaced over a period.
        """
        for box in self.boxes:  # before distances, which are costly
            if not _is_kept(box.room(q)):
                return False
        clearance = self.clearance
        return clearance is None or _is_kept(clearance.along(q) - clearance.margin)

    def cuts(self, t: np.ndarray, q: np.ndarray) -> list[RoomCut]:
        """Return bounds that move a motion away from where it crosses a boundary.

        At each instant with less room than its neighbours, the room as a linear function of the
        position.

        Parameters
        ----------
        t : (T,) s, of a period.
        q : (T, n).
        """
        room = self.rooms(q)
        lowest = (room <= np.roll(room, 1, axis=0)) & (room < np.roll(room, -1, axis=0))
        found = []
        for k, which in np.argwhere(lowest & (room < 0)):
            steps = _STEP * np.eye(q.shape[1])
            ahead, behind = (self.rooms(q[k] + one)[:, which] for one in (steps, -steps))
            slope = (ahead - behind) / (2 * _STEP)
            if np.any(slope):
                found.append(
                    RoomCut(float(t[k]), slope, float(slope @ q[k]) - float(room[k, which]))
                )
        return found

    def in_words(self) -> str:
        """What is kept, for messages."""
        found = [] if self.clearance is None else [f"stays {self.clearance.margin:g} m clear"]
        found += ["stays in its boxes"] if self.boxes else []
        return " and ".join(found)


def _is_kept(room: np.ndarray) -> bool:
    return bool(np.all(room - above_instants(room) >= 0))
