"""`Robot`: a tree of joints and links with its given inertial parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dynident import files
from dynident.arguments import checked
from dynident.batch import JointTree
from dynident.errors import RobotError
from dynident.inertia import PARAMETERS, UNITS, frame_change
from dynident.robot.dynamics import Dynamics, TorqueDerivatives, pinocchio_model
from dynident.robot.formats.reading import read_tree
from dynident.robot.tree import GRAVITY, Array, Description, Joint, Link, frozen, random_motion


@checked
@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of moving joints, the links they carry, and gravity.

    Links that fixed (or locked) joints join move as one body: the ten parameters of each such
    *moving body*, in its joint's frame, are what the inverse dynamics depends on. A moving body
    is named after the link that its joint drives.

    Attributes
    ----------
    name : str
    joints : tuple of Joint
        In the order of all columns (q, v, a, tau). Each is `names[i]`.
    links : tuple of Link
    gravity : (3,) ndarray
        m/s^2, in the world's axes.
    description : Description or None
        The text it was read from, which `write` patches.
    locked : tuple of str
        Moving joints of the description that were not asked for: they stand at q = 0.
    """

    name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    _: KW_ONLY
    gravity: Array = GRAVITY  # type: ignore[assignment]
    description: Description | None = None
    locked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        gravity = frozen(self.gravity, (3,), "gravity")
        if not np.all(np.isfinite(gravity)):
            raise RobotError(f"gravity {gravity.tolist()} is not finite", self.name)
        object.__setattr__(self, "gravity", gravity)
        if not self.joints:
            raise RobotError("has no moving joint", self.name)
        for index, joint in enumerate(self.joints):
            seen = {index}
            while joint.parent != -1:
                if joint.parent in seen or not -1 <= joint.parent < self.n:
                    raise RobotError(f"joint '{joint.name}' has an impossible parent", self.name)
                seen.add(joint.parent)
                joint = self.joints[joint.parent]

    def __repr__(self) -> str:
        # Without the description's text, which would flood a notebook.
        form = f", from {self.description!r}" if self.description else ""
        return f"Robot('{self.name}': {self.n} joints, {len(self.links)} links{form})"

    @staticmethod
    def from_file(
        path: str | Path,
        joints: Sequence[str] | None = None,
        gravity: ArrayLike | None = None,
    ) -> Robot:
        """Read a robot description: URDF, SDF or MJCF, known by its root element.

        Parameters
        ----------
        path : str or Path
            The description.
        joints : sequence of str, optional
            Joints to keep, in the order of the columns; default: every moving joint in the order
            of the file. The others are locked at zero.
        gravity : (3,) array_like, optional
            m/s^2; default: what the description states (SDF, MJCF), else (0, 0, -9.81).

        Returns
        -------
        The robot, with its description for writing it back.

        Raises
        ------
        FileError
            If the file cannot be read.
        RobotError
            If it is no robot description, is broken, or has what is not supported: a floating
            base, closed chains, mimic joints, joints other than revolute, continuous, prismatic
            and fixed ones, several robots.

        Notes
        -----
        A root link that nothing attaches is welded to the world. Broken inertial *values*
        (negative, NaN) are kept as they are, for `dynident.inertia.margins` to judge. Friction,
        damping and rotor inertia that a description states are not read: they are effects.
        """
        return Robot.from_text(files.read_text(path), str(path), joints, gravity)

    @staticmethod
    def from_text(
        text: str,
        where: str = "robot description",
        joints: Sequence[str] | None = None,
        gravity: ArrayLike | None = None,
    ) -> Robot:
        """Read a robot description from its text.

        Parameters
        ----------
        text : str
        where : str
            Names it in messages.
        joints, gravity
            As in `from_file`.

        Returns
        -------
        The robot, with its description for writing it back.

        Raises
        ------
        RobotError
            As in `from_file`.
        """
        opened, tree = read_tree(text, where, None if joints is None else tuple(joints))
        if gravity is None:
            gravity = GRAVITY if opened.contents.gravity is None else opened.contents.gravity
        return Robot(
            name=opened.contents.name,
            joints=tree.joints,
            links=tree.links,
            gravity=gravity,  # type: ignore[arg-type]
            description=Description(where, opened.format.name, text),
            locked=tree.locked,
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each joint, "revolute" or "prismatic"."""
        return tuple(joint.kind for joint in self.joints)

    @property
    def stated_kinds(self) -> tuple[str, ...]:
        """The same, with "continuous" for those that are said to turn without end."""
        return tuple("continuous" if one.continuous else one.kind for one in self.joints)

    @property
    def continuous(self) -> tuple[str, ...]:
        """Names of the joints that are said to turn without end."""
        return tuple(one.name for one in self.joints if one.continuous)

    @property
    def position_limits(self) -> dict[str, tuple[float, float]]:
        """Lower and upper limit of each joint's position, rad or m; infinite where none is."""
        return {one.name: (one.lower, one.upper) for one in self.joints}

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each joint's position, "rad" or "m"."""
        return tuple("rad" if kind == "revolute" else "m" for kind in self.kinds)

    @property
    def torque_units(self) -> tuple[str, ...]:
        """Unit of each joint's torque or force, "N m" or "N"."""
        return tuple("N m" if kind == "revolute" else "N" for kind in self.kinds)

    @cached_property
    def driven(self) -> tuple[int, ...]:
        """Index in `links` of the link that each joint drives."""
        carried: dict[int, list[int]] = {}
        for index, link in enumerate(self.links):
            carried.setdefault(link.joint, []).append(index)
        found: list[int] = []
        for number, joint in enumerate(self.joints):
            if number not in carried:
                raise RobotError("carries no link", f"joint '{joint.name}'")
            child = [i for i in carried[number] if self.links[i].name == joint.child]
            found.append((child or carried[number])[0])
        return tuple(found)

    @property
    def tip(self) -> int:
        """Index of the joint with the most joints between it and the world; the last such one."""
        depths = []
        for joint in self.joints:
            depth = 0
            while joint.parent != -1:
                joint, depth = self.joints[joint.parent], depth + 1
            depths.append(depth)
        return max(range(self.n), key=lambda index: (depths[index], index))

    @property
    def ends(self) -> tuple[int, ...]:
        """Indices of the joints that carry no other joint: the tip, and the ends of branches."""
        carried = {joint.parent for joint in self.joints}
        return tuple(index for index in range(self.n) if index not in carried)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Name of each joint's moving body: the link that the joint drives."""
        return tuple(self.links[index].name for index in self.driven)

    @cached_property
    def theta(self) -> Array:
        """(10 n,) inertial parameters of the moving bodies, in their joint frames."""
        theta = np.zeros((self.n, 10))
        for link in self.links:
            if link.joint >= 0:
                theta[link.joint] += moved(link)
        theta.setflags(write=False)
        return theta.reshape(-1)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the entries of `theta`: "m.<body>", "mx.<body>", ..."""
        return tuple(f"{name}.{body}" for body in self.bodies for name in PARAMETERS)

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Units of the entries of `theta`."""
        return UNITS * self.n

    def with_theta(self, theta: ArrayLike) -> Robot:
        """Return a robot whose moving bodies have these parameters.

        The difference goes to the driven link of each moving body; links of a body whose ten
        numbers already are the asked ones stay untouched, to the bit.

        Parameters
        ----------
        theta : (10 n,) array_like
            In the order of `parameter_names`.

        Raises
        ------
        RobotError
            If the shape is wrong, or another link of a changed body is not finite.
        """
        theta = self._vector(theta)
        links = list(self.links)
        for joint, wanted in enumerate(theta.reshape(-1, 10)):
            if np.array_equal(wanted, self.theta[10 * joint : 10 * joint + 10], equal_nan=True):
                continue
            driven = self.driven[joint]
            rest = np.array(wanted)
            for index, link in enumerate(links):
                if link.joint == joint and index != driven:
                    if not np.all(np.isfinite(link.phi)):
                        raise RobotError(
                            "has inertial values that are not finite",
                            f"link '{link.name}'",
                            "fix its inertial element first",
                        )
                    rest -= moved(link)
            link = links[driven]
            back = frame_change(link.R.T, -link.R.T @ link.p)
            links[driven] = replace(link, phi=back @ rest, source="set")
        return replace(self, links=tuple(links))

    def with_links(self, phis: Mapping[str, ArrayLike]) -> Robot:
        """Return a robot in which these links have these inertial parameters.

        Parameters
        ----------
        phis : link name -> (10,) array_like
            In the link's own frame; links that are not named stay as they are.

        Raises
        ------
        RobotError
            If there is no such link, or a shape is wrong.
        """
        names = [link.name for link in self.links]
        for name in phis:
            if name not in names:
                raise RobotError(f"has no link '{name}'", self.name, f"links: {', '.join(names)}")
        links = (
            replace(link, phi=np.asarray(phis[link.name], dtype=float), source="set")
            if link.name in phis and not np.array_equal(phis[link.name], link.phi)
            else link
            for link in self.links
        )
        return replace(self, links=tuple(links))

    def with_gravity(self, gravity: ArrayLike) -> Robot:
        """Return the same robot under another gravity (3,), m/s^2 in the world's axes."""
        return replace(self, gravity=frozen(gravity, (3,), "gravity"))

    def pinocchio(self) -> Any:
        """Return a fresh `pinocchio.Model`: this tree, `theta` and gravity.

        Its joints are in depth-first order and carry the names of `names`.

        Raises
        ------
        RobotError
            If a moving body has no mass but a first moment, or is not finite: Pinocchio cannot
            hold it (`regressor` and `inverse_dynamics` can).
        """
        model = pinocchio_model(self.joints, self.gravity, self.theta, self.bodies)
        model.name = self.name
        return model

    @cached_property
    def _dynamics(self) -> Dynamics:
        return Dynamics(self.joints, self.gravity)

    @property
    def joint_tree(self) -> JointTree:
        """Its joints and gravity as functions of many samples are written from them."""
        return self._dynamics.tree

    def regressor(
        self,
        q: ArrayLike,
        v: ArrayLike,
        a: ArrayLike,
        *,
        columns: Sequence[int] | None = None,
        out: Array | None = None,
    ) -> Array:
        """Return Y (T, n, 10 n) with tau = Y theta, or some of its columns.

        Parameters
        ----------
        q, v, a : (T, n) array_like
            rad or m, and their first and second derivatives by s.
        columns : sequence of int, optional
            Which columns, as those of base parameters; default: all. Fewer take less time.
        out : (T, n, len(columns)) ndarray, optional
            To write to, best as `dynident.batch.side_by_side` makes it.

        Raises
        ------
        RobotError
            If a shape is wrong.
        SettingError
            If the environment says of compiling what is not understood.

        Notes
        -----
        10 n^2 doubles a sample: evaluate long recordings in blocks, and keep none of them. Of many
        samples, those of one entry lie side by side in memory.
        """
        return self._dynamics.regressor(*self._motion(q, v, a), columns=columns, out=out)

    def inverse_dynamics(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None
    ) -> Array:
        """Return tau (T, n), N m or N, for any parameters: physical, massless, or negative.

        Parameters
        ----------
        q, v, a : (T, n) array_like
            rad or m, and their first and second derivatives by s.
        theta : (10 n,) array_like, optional
            Default: the robot's own.
        """
        own = self.theta if theta is None else self._vector(theta)
        return self._dynamics.inverse_dynamics(*self._motion(q, v, a), own)

    def torque_derivatives(
        self, q: ArrayLike, v: ArrayLike, a: ArrayLike, theta: ArrayLike | None = None
    ) -> TorqueDerivatives:
        """Return the derivatives of the torque by q, v and a, (T, n, n) each.

        Parameters
        ----------
        q, v, a : (T, n), in rad or m, and per s and s^2.
        theta : (10 n,), optional
            Default: the robot's own. A body with a first moment needs a mass.

        Raises
        ------
        RobotError
            If the shapes do not fit.
        """
        own = self.theta if theta is None else self._vector(theta)
        return self._dynamics.derivatives(*self._motion(q, v, a), own)

    def torque_derivatives_by(
        self, joint: int, q: ArrayLike, v: ArrayLike, a: ArrayLike
    ) -> TorqueDerivatives | None:
        """Return the derivatives of the torque by one joint's q, v and a; see `JointDerivatives`.

        Parameters
        ----------
        joint : column of the joint.
        q, v, a : (T, n), in rad or m, and per s and s^2.

        Returns
        -------
        (T, n) each, [t, i] = d tau_i / d x; None where `torque_derivatives` take no longer.
        """
        return self._dynamics.derivatives_by(joint, *self._motion(q, v, a), self.theta)

    def random_motion(self, seed: int, samples: int) -> tuple[Array, Array, Array]:
        """Return q, v, a (samples, n), uniform within the limits; see `tree.random_motion`."""
        return random_motion(self.joints, seed, samples)

    def _vector(self, theta: ArrayLike) -> Array:
        array = np.asarray(theta, dtype=float)
        if array.shape != (10 * self.n,):
            raise RobotError(
                f"theta has shape {array.shape} where ({10 * self.n},) is needed", self.name
            )
        return array

    def _motion(self, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> tuple[Array, Array, Array]:
        arrays = tuple(np.ascontiguousarray(x, dtype=float) for x in (q, v, a))
        for name, array in zip("qva", arrays, strict=True):
            if array.ndim != 2 or array.shape != (len(arrays[0]), self.n):
                raise RobotError(
                    f"{name} has shape {array.shape} where (samples, {self.n}) is needed, "
                    "the same for q, v and a",
                    self.name,
                )
        return arrays  # type: ignore[return-value]


def moved(link: Link) -> Array:
    """Return a link's phi (10,) in the frame of the joint that carries it."""
    # NaN times zero is NaN: a broken entry shows in all that depend on it, which is intended.
    if np.array_equal(link.R, np.eye(3)) and not np.any(link.p):
        return link.phi
    with np.errstate(invalid="ignore"):
        return frame_change(link.R, link.p) @ link.phi
