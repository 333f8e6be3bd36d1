"""The parts of a robot: joints, links, and the description they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dynident.errors import RobotError

Array = NDArray[np.float64]
KINDS = ("revolute", "prismatic")
GRAVITY = (0.0, 0.0, -9.81)
_REACH = {"revolute": np.pi, "prismatic": 1.0}
_SPEED = {"revolute": 3.0, "prismatic": 1.0}
_ACCELERATION = 10.0


def frozen(values: object, shape: tuple[int, ...], what: str) -> Array:
    """Return a read-only double array.

    Parameters
    ----------
    values : array_like
    shape : tuple of int
        That it has to have.
    what : str
        For messages.

    Raises
    ------
    RobotError
        If it has another shape.
    """
    array = np.array(values, dtype=float)
    if array.shape != shape:
        raise RobotError(f"has shape {array.shape} where {shape} is needed", what)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False, kw_only=True)
class Joint:
    """A moving joint.

    Attributes
    ----------
    name : str
    kind : str
        "revolute" (q in rad, torque in N m) or "prismatic" (q in m, force in N).
    parent : int
        Index in `Robot.joints` of the joint that carries this one; -1 for the world.
    R, p : (3, 3), (3,) ndarray
        Placement of this joint's frame in the parent's joint frame (the world for -1) at q = 0;
        p in m. The joint frame moves with the joint: its origin is on the axis, its
        orientation is that of the child link's frame (in a URDF it *is* the child link's frame).
    axis : (3,) ndarray
        Unit vector in the joint frame.
    lower, upper : float
        Position limits, rad or m; infinite where the description states none.
    velocity, effort : float
        Limits of speed (rad/s, m/s) and torque (N m, N); infinite where none is stated or the
        stated one is not positive (a common way of saying "unknown").
    child : str
        Name of the link that the joint drives; if empty, the first link it carries.
    continuous : bool
        Whether the description says that a revolute joint turns without end. Of one that only has
        no limits that is not known.
    """

    name: str
    kind: str
    parent: int
    R: Array
    p: Array
    axis: Array
    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf
    child: str = ""
    continuous: bool = False

    def __post_init__(self) -> None:
        where = f"joint '{self.name}'"
        if self.kind not in KINDS:
            raise RobotError(f"is of kind '{self.kind}'", where, f"use one of {', '.join(KINDS)}")
        object.__setattr__(self, "R", frozen(self.R, (3, 3), f"{where}, R"))
        object.__setattr__(self, "p", frozen(self.p, (3,), f"{where}, p"))
        axis = np.array(self.axis, dtype=float)
        length = float(np.linalg.norm(axis))
        if not np.isfinite(length) or length < 1e-12:
            raise RobotError("has an axis without direction", where, "state a nonzero axis")
        # Normalised only when needed, so that a unit axis keeps its digits.
        axis = axis if abs(length - 1.0) < 1e-15 else axis / length
        object.__setattr__(self, "axis", frozen(axis, (3,), f"{where}, axis"))
        if not (np.all(np.isfinite(self.R)) and np.all(np.isfinite(self.p))):
            raise RobotError("has a placement that is not finite", where)


@dataclass(frozen=True, eq=False, kw_only=True)
class Link:
    """A rigid body of the description, carried by a joint.

    Attributes
    ----------
    name : str
    joint : int
        Index in `Robot.joints` of the joint that moves it; -1 if it is fixed to the world.
    R, p : (3, 3), (3,) ndarray
        Placement of the link's frame in that joint's frame (the world for -1); p in m.
    phi : (10,) ndarray
        Inertial parameters in the link's frame (`dynident.inertia.PARAMETERS`), exactly as the
        description states them, broken ones (negative, NaN) included.
    source : str
        Where phi comes from: "inertial element", "geometry" (MJCF bodies whose inertia follows
        from their shapes), "absent" (zeros: the description says nothing), or "set" (changed
        since by `Robot.with_theta`).
    """

    name: str
    joint: int
    R: Array
    p: Array
    phi: Array
    source: str = "inertial element"

    def __post_init__(self) -> None:
        where = f"link '{self.name}'"
        object.__setattr__(self, "R", frozen(self.R, (3, 3), f"{where}, R"))
        object.__setattr__(self, "p", frozen(self.p, (3,), f"{where}, p"))
        object.__setattr__(self, "phi", frozen(self.phi, (10,), f"{where}, phi"))


@dataclass(frozen=True)
class Description:
    """The text a robot was read from.

    Attributes
    ----------
    path : str
        Its file, for messages.
    format : str
        "urdf", "sdf" or "mjcf".
    text : str
    """

    path: str
    format: str
    text: str

    def __repr__(self) -> str:
        return f"{self.format} '{self.path}'"


def random_motion(joints: Sequence[Joint], seed: int, samples: int) -> tuple[Array, Array, Array]:
    """Draw a motion, uniform within the limits.

    Parameters
    ----------
    joints : sequence of Joint
        Where a limit is missing (or leaves no room) q is within pi rad or 1 m, the speed within
        3 rad/s or 1 m/s; accelerations are within 10 rad/s^2 or m/s^2.
    seed, samples : int

    Returns
    -------
    q, v, a : (samples, n), in rad or m, and per s and s^2.
    """
    rng = np.random.default_rng(seed)
    spans = np.array([_span(joint) for joint in joints])
    speed = np.array([min(_SPEED[joint.kind], joint.velocity) for joint in joints])
    shape = (samples, len(joints))
    q = rng.uniform(spans[:, 0], spans[:, 1], shape)
    v = rng.uniform(-speed, speed, shape)
    a = rng.uniform(-_ACCELERATION, _ACCELERATION, shape)
    return q, v, a


def _span(joint: Joint) -> tuple[float, float]:
    """Return where the joint may go: its limits, completed where one is missing."""
    reach = _REACH[joint.kind]
    lower, upper = joint.lower, joint.upper
    if not np.isfinite(lower):
        lower = min(-reach, upper - 2.0 * reach) if np.isfinite(upper) else -reach
    if not np.isfinite(upper):
        upper = max(reach, lower + 2.0 * reach)
    return (lower, upper) if upper - lower >= 1e-3 * reach else (-reach, reach)
