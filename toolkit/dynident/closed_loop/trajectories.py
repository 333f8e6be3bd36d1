"""Reference motions that excite a robot and repeat exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.errors import SimulationError
from dynident.robot import Robot

SHARE = 0.8
"""Share of a joint's limits that a random trajectory uses where nothing is said."""
UNLIMITED = {"revolute": (1.0, 2.0), "prismatic": (0.3, 0.5)}
"""Amplitude (rad, m) and speed (rad/s, m/s) where the joint states no limits either."""

MOST_HARMONICS = 200
"""Of a random trajectory; its peaks are looked for among points by the square of that."""


@dataclass(frozen=True, eq=False)
class Fourier:
    """A finite Fourier series for each joint.

    q(t) = centre + sum over k = 1 .. H of sine_k sin(k w t) + cosine_k cos(k w t), w = 2 pi/period
    (Swevers et al., "Optimal robot excitation and identification", 1997, without its integration).

    Attributes
    ----------
    period : s.
    centre : (n,) rad or m.
    sine, cosine : (n, H) rad or m.
    """

    period: float
    centre: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray

    def __post_init__(self) -> None:
        for name in ("centre", "sine", "cosine"):
            array = np.array(getattr(self, name), dtype=float)
            if not np.isfinite(array).all():
                raise SimulationError(f"{name} is not finite", "trajectory")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not (self.period > 0 and np.isfinite(self.period)):
            raise SimulationError(f"period = {self.period}", "trajectory", "choose it above 0")
        n = self.centre.size
        if self.centre.ndim != 1 or self.sine.shape != self.cosine.shape or len(self.sine) != n:
            raise SimulationError("shapes of centre, sine and cosine do not fit", "trajectory")

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.centre.size

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return position, velocity and acceleration at times t (T,) s, each (T, n)."""
        k = 2 * np.pi / self.period * np.arange(1, self.sine.shape[1] + 1)
        # Whole periods are taken off first, so that late times lose no digits.
        phase = np.remainder(np.asarray(t, dtype=float), self.period)[:, None] * k
        s, c = np.sin(phase), np.cos(phase)
        q = self.centre + s @ self.sine.T + c @ self.cosine.T
        v = (c * k) @ self.sine.T - (s * k) @ self.cosine.T
        a = -((s * k**2) @ self.sine.T + (c * k**2) @ self.cosine.T)
        return q, v, a

    @property
    def coefficients(self) -> dict[str, list]:
        """What a file has of it, by the names of its keys."""
        return {name: getattr(self, name).tolist() for name in ("centre", "sine", "cosine")}

    @classmethod
    def random(
        cls,
        robot: Robot,
        period: float,
        seed: int | Sequence[int],
        harmonics: int = 5,
        *,
        amplitude: float | Sequence[float] | None = None,
        speed: float | Sequence[float] | None = None,
        acceleration: float | Sequence[float] | None = None,
        centre: float | Sequence[float] | None = None,
    ) -> Fourier:
        """Return a random trajectory, each joint as large as its limits allow.

        The amplitudes of the harmonics are normal variates over k, which spreads the speed evenly
        over them.

        Parameters
        ----------
        robot : its joint limits are never exceeded.
        period : s.
        seed : of the amplitudes.
        harmonics : how many, at most `MOST_HARMONICS`.
        amplitude : rad or m, largest distance from the centre; default 80 % of the room.
        speed : rad/s or m/s, largest speed; default 80 % of the joint's limit.
        acceleration : rad/s^2 or m/s^2, largest acceleration; default no limit.
        centre : rad or m; default the middle of the joint's range, or 0 without one.

        Raises
        ------
        SimulationError
            If a setting is not positive, or beyond a joint's limits.
        """
        if not 1 <= harmonics <= MOST_HARMONICS:
            remedy = f"choose from 1 to {MOST_HARMONICS}"
            raise SimulationError(f"harmonics = {harmonics}", "trajectory", remedy)
        bounds = _Bounds.of(robot, centre, amplitude, speed, acceleration)
        rng = np.random.default_rng(seed)
        k = np.arange(1, harmonics + 1)
        sine, cosine = rng.standard_normal((2, robot.n, harmonics)) / k
        unit = cls(period, np.zeros(robot.n), sine, cosine)
        # 100 points in the shortest wave find the peaks to 0.05 %; the margin covers the rest.
        q, v, a = unit.at(np.arange(100 * harmonics) / (100 * harmonics) * period)
        scale = 0.999 * np.min(
            [
                bounds.amplitude / np.abs(q).max(0),
                bounds.speed / np.abs(v).max(0),
                bounds.acceleration / np.abs(a).max(0),
            ],
            axis=0,
        )
        return cls(period, bounds.centre, sine * scale[:, None], cosine * scale[:, None])


@dataclass(frozen=True)
class _Bounds:
    """Limits of a motion, each (n,)."""

    centre: np.ndarray
    amplitude: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray

    @classmethod
    def of(cls, robot: Robot, centre, amplitude, speed, acceleration) -> _Bounds:
        lower = np.array([joint.lower for joint in robot.joints])
        upper = np.array([joint.upper for joint in robot.joints])
        fastest = np.array([joint.velocity for joint in robot.joints])
        usual = np.array([UNLIMITED[joint.kind] for joint in robot.joints])
        limited = np.isfinite(lower) & np.isfinite(upper)
        middle = np.zeros(robot.n)
        middle[limited] = (lower[limited] + upper[limited]) / 2
        middle = _per_joint(centre, robot, "centre", middle)
        room = np.minimum(upper - middle, middle - lower)
        _within(room > 0, robot, "centre", "lies outside the joint's range")
        default = np.where(np.isfinite(room), SHARE * room, usual[:, 0])
        found = _per_joint(amplitude, robot, "amplitude", default)
        _within((found > 0) & (found <= room), robot, "amplitude", "leaves the joint's range")
        default = np.where(np.isfinite(fastest), SHARE * fastest, usual[:, 1])
        pace = _per_joint(speed, robot, "speed", default)
        _within((pace > 0) & (pace <= fastest), robot, "speed", "is beyond the joint's limit")
        push = _per_joint(acceleration, robot, "acceleration", np.full(robot.n, np.inf))
        _within(push > 0, robot, "acceleration", "is not positive")
        return cls(middle, found, pace, push)


def _per_joint(value, robot: Robot, name: str, default: np.ndarray) -> np.ndarray:
    if value is None:
        return default
    given = np.atleast_1d(np.asarray(value, dtype=float))
    if given.shape not in ((1,), (robot.n,)):
        remedy = "give one number, or one per joint"
        raise SimulationError(f"{given.size} for {robot.n} joints", f"trajectory.{name}", remedy)
    return np.broadcast_to(given, (robot.n,)).copy()


def _within(fine: np.ndarray, robot: Robot, name: str, what: str) -> None:
    for joint, ok in zip(robot.joints, fine, strict=True):
        if not ok:
            remedy = (
                f"the joint moves from {joint.lower:.4g} to {joint.upper:.4g}, "
                f"at {joint.velocity:.4g} a second or less"
            )
            raise SimulationError(what, f"trajectory.{name}, joint '{joint.name}'", remedy)
