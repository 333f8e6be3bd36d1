"""Inertial parameters as solids that can be drawn: the ellipsoid with the same ten numbers.

A solid ellipsoid of uniform density with semi-axes a has the second moments m a^2 / 5 about its
centre. Ten parameters that a rigid body can have therefore belong to exactly one such ellipsoid;
for others a mean square extent is negative, or there is no mass to speak of.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dynident.inertia import margins, to_com
from dynident.robot import Robot
from dynident.robot.poses import poses


@dataclass(frozen=True, eq=False, kw_only=True)
class Solid:
    """A body's inertia as an ellipsoid of uniform density, or what of it exists.

    Attributes
    ----------
    body : name.
    joint : (3,) origin of its joint frame, m; where it is marked if it has no centre.
    centre : (3,) centre of mass, m; NaN where there is none to draw (mass not positive).
    axes : (3, 3) principal directions, one a column.
    mean_square : (3,) mean of the squared distance of the mass from the planes through the
        centre across each axis, m^2, ascending: the principal second moments over the mass.
        Negative for what no body can have, NaN without a centre.
    fault : what is impossible about it, in words; empty for a possible body.
    """

    body: str
    joint: np.ndarray
    centre: np.ndarray
    axes: np.ndarray
    mean_square: np.ndarray
    fault: str

    @property
    def semi_axes(self) -> np.ndarray:
        """(3,) of the ellipsoid, m: sqrt(5 mean_square), 0 where that is imaginary."""
        return np.sqrt(5.0 * np.clip(self.mean_square, 0.0, None))

    @property
    def imaginary(self) -> np.ndarray:
        """(3,) sqrt(-5 mean_square) of the axes that are imaginary, m; 0 for the real ones."""
        return np.sqrt(5.0 * np.clip(-self.mean_square, 0.0, None))

    @property
    def drawable(self) -> bool:
        """Whether there is a centre of mass to draw something at."""
        return bool(np.all(np.isfinite(self.centre)))

    def moved(self, R: np.ndarray, p: np.ndarray) -> Solid:
        """Return the solid in frame A, from the one in frame B: x_A = R x_B + p."""
        joint, centre = R @ self.joint + p, R @ self.centre + p
        return Solid(
            body=self.body,
            joint=joint,
            centre=centre,
            axes=R @ self.axes,
            mean_square=self.mean_square,
            fault=self.fault,
        )


def solid(body: str, phi: ArrayLike) -> Solid:
    """Return the solid of ten inertial parameters (10,), in their frame; none is refused."""
    phi = np.asarray(phi, dtype=float)
    nothing, mass = np.full(3, np.nan), float(phi[0])
    # What is out of all proportion overflows, and is then not drawn.
    with np.errstate(over="ignore", invalid="ignore"):
        fault = _fault(phi)
        found = to_com(phi)
    # A body with nothing in it has no extent; any other needs a mass for its extent to mean much.
    if not np.all(np.isfinite(phi)) or not mass > 0.0:
        return Solid(
            body=body,
            joint=np.zeros(3),
            centre=nothing,
            axes=np.eye(3),
            mean_square=nothing,
            fault=fault,
        )
    inertia = found.inertia_com
    if not np.all(np.isfinite(inertia)):
        return Solid(
            body=body,
            joint=np.zeros(3),
            centre=nothing,
            axes=np.eye(3),
            mean_square=nothing,
            fault=fault,
        )
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    moments, axes = np.linalg.eigh(second)
    mean_square = moments / mass
    if fault and mean_square[0] < 0.0:
        fault = f"mean square {signed(mean_square[0])} m²"
    elif not fault:
        mean_square = np.clip(mean_square, 0.0, None)
    return Solid(
        body=body,
        joint=np.zeros(3),
        centre=found.com,
        axes=axes,
        mean_square=mean_square,
        fault=fault,
    )


def solids(robot: Robot, q: np.ndarray) -> tuple[Solid, ...]:
    """Solids of the moving bodies of a robot at posture q (n,), in the world's frame."""
    R, p = poses(robot, q)
    bodies = zip(robot.bodies, robot.theta.reshape(-1, 10), strict=True)
    return tuple(solid(body, phi).moved(R[k], p[k]) for k, (body, phi) in enumerate(bodies))


def signed(value: float) -> str:
    """A number of two digits with a true minus sign."""
    return f"{value:.2g}".replace("-", "\u2212")


def _fault(phi: np.ndarray) -> str:
    if not np.all(np.isfinite(phi)):
        return "not a number"
    if phi[0] < 0.0:
        return f"mass {signed(float(phi[0]))} kg"
    if margins(phi).consistent:
        return ""
    return "no mass, but moments" if phi[0] == 0.0 else "impossible"
