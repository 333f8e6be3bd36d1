"""A joint that is faster than it can be while the others keep their limits: is that its position?

Motors that turn two joints, ratios and limits are wrong in one joint and right in the others. No
torque need tell: friction and rotors are the motors' own, and fit positions of motors better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.robot import Robot

WITHIN = 1.02
"""Times its limit that a drive may overshoot."""
_QUANTILE = 0.999  # of a speed, which stands for its largest
_BEYOND = 1.05  # times its limit that no drive does
_REACHED = 0.95  # of its limit that another joint has to reach for limits to be believed


@dataclass(frozen=True, kw_only=True)
class OverSpeed:
    """The one joint that is faster than its description allows.

    Attributes
    ----------
    joint : its name.
    reached, limit : rad/s or m/s.
    unit : of both.
    at_limit : names of joints that reach their limits and keep them.
    """

    joint: str
    reached: float
    limit: float
    unit: str
    at_limit: tuple[str, ...]

    @property
    def words(self) -> str:
        """What was seen, as the end of a sentence."""
        come, keep = ("come", "keep") if self.at_limit[1:] else ("comes", "keeps")
        its, them = ("theirs", "them") if self.at_limit[1:] else ("its own", "it")
        return (
            f"{self.joint} reaches {self.reached:.3g} {self.unit}, "
            f"{100 * (self.reached / self.limit - 1):.0f} % over its limit in the description, "
            f"while {', '.join(self.at_limit)} {come} near {its} and {keep} {them}"
        )

    @property
    def sentence(self) -> str:
        """What was seen, and what it may mean."""
        return (
            f"As the study reads positions, {self.words}. A motor that turns two joints, a "
            "wrong ratio or a wrong limit looks like that, and wrong positions may fit better than "
            "right ones: until it is settled, nothing that was found is certain."
        )


def over_speed(robot: Robot, v: np.ndarray) -> OverSpeed | None:
    """Look for the one joint that is faster than it can be.

    Parameters
    ----------
    robot : with its limits of speed.
    v : (T, n) speeds, rad/s or m/s.

    Returns
    -------
    None where no joint is, or several, or where no other joint shows that limits are the drives'.
    """
    limits = np.array([joint.velocity for joint in robot.joints])
    share = speed_reached(v) / limits
    over = np.flatnonzero(share > _BEYOND)
    others = np.delete(share, over)
    if len(over) != 1 or not len(others) or not _REACHED <= others.max() <= WITHIN:
        return None
    (i,) = over
    return OverSpeed(
        joint=robot.names[i],
        reached=float(share[i] * limits[i]),
        limit=float(limits[i]),
        unit="rad/s" if robot.kinds[i] == "revolute" else "m/s",
        at_limit=tuple(
            n for n, x in zip(robot.names, share, strict=True) if _REACHED <= x <= WITHIN
        ),
    )


def speed_reached(v: np.ndarray) -> np.ndarray:
    """Return the largest speed but for single rows, (T, ...) -> (...), of a sign or the other."""
    return np.quantile(np.abs(v), _QUANTILE, axis=0)
