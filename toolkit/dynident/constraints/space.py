"""The standard parameters of a model: what consistency is stated in, and programs decide on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.errors import FitError
from dynident.inertia import PARAMETERS, UNITS, frame_change, reference_body
from dynident.model import Model
from dynident.robot import Link, Robot
from dynident.words import did_you_mean, nearest

_FALLBACK_LENGTH = 0.1  # m, where a robot gives no length at all


@dataclass(frozen=True, eq=False, kw_only=True)
class ParameterSpace:
    """Standard parameters: ten of each link, in its own frame, then those of the effects.

    Links about which the description says nothing are left out, unless they are all that a joint
    moves. Where fixed joints join several links, data determine only their sum.

    Attributes
    ----------
    names, units : (s,) of all parameters.
    bodies : the links; body k has the parameters 10 k to 10 k + 9.
    references : (n, 10) a consistent body of the size of each (`inertia.reference_body`).
    lower, upper : (s,) bounds; infinite for the inertial parameters, which consistency bounds.
    combination : (p, s) matrix C: the model's values are C x.
    given : (s,) parameters of the robot description, effects at zero.
    scale : (s,) the size of each parameter, in which programs are solved.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    bodies: tuple[str, ...]
    references: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    combination: np.ndarray
    given: np.ndarray
    scale: np.ndarray

    @staticmethod
    def of(model: Model) -> ParameterSpace:
        """Standard parameters of a model, sized by its robot description."""
        robot, base = model.robot, model.base
        chosen = [robot.links[i] for i in stated_links(robot)]
        rigid, inertial = len(base.independent), 10 * len(chosen)
        effects = [p for e in model.effects for p in e.parameters(robot)]
        size = inertial + len(effects)
        combination = np.zeros((model.size, size))
        for k, link in enumerate(chosen):
            if link.joint >= 0:
                columns = base.combination[:, 10 * link.joint : 10 * link.joint + 10]
                part = slice(10 * k, 10 * k + 10)
                combination[:rigid, part] = columns @ frame_change(link.R, link.p)
        combination[rigid:, inertial:] = np.eye(len(effects))
        references = reference_bodies(robot, chosen)
        none = np.full(inertial, np.inf)
        names = (f"{p}.{link.name}" for link in chosen for p in PARAMETERS)
        scales = (body_scale(body) for body in references)
        return ParameterSpace(
            names=(*names, *model.names[rigid:]),
            units=(*UNITS * len(chosen), *model.units[rigid:]),
            bodies=tuple(link.name for link in chosen),
            references=references,
            lower=np.concatenate([-none, [p.lower for p in effects]]),
            upper=np.concatenate([none, [p.upper for p in effects]]),
            combination=combination,
            given=np.concatenate([*(link.phi for link in chosen), np.zeros(len(effects))]),
            scale=np.concatenate([*scales, np.ones(len(effects))]),
        )

    @property
    def size(self) -> int:
        """Number of parameters s."""
        return len(self.names)

    @property
    def rigid(self) -> int:
        """Number of inertial parameters, 10 n."""
        return 10 * len(self.bodies)

    @cached_property
    def reference(self) -> np.ndarray:
        """The reference bodies, effects at zero, (s,)."""
        return np.concatenate([self.references.ravel(), np.zeros(self.size - self.rigid)])

    def body(self, name: str) -> slice:
        """Where the ten parameters of a link are.

        Raises
        ------
        FitError
            If there is no such link.
        """
        if name not in self.bodies:
            raise FitError(f"no link '{name}'", remedy=nearest(name, self.bodies, "links"))
        k = self.bodies.index(name)
        return slice(10 * k, 10 * k + 10)

    def index(self, name: str) -> int:
        """Where a parameter is, by its name.

        Raises
        ------
        FitError
            If there is no such parameter.
        """
        if name not in self.names:
            some = f"for instance {self.names[0]}, {self.names[-1]}"
            remedy = did_you_mean(name, self.names, some)
            raise FitError(f"no standard parameter '{name}'", remedy=remedy)
        return self.names.index(name)

    def sized(self, effects: np.ndarray) -> ParameterSpace:
        """The same space with the sizes of the effects' parameters, (s - 10 n,) positive."""
        return replace(self, scale=np.concatenate([self.scale[: self.rigid], effects]))


def stated_links(robot: Robot) -> tuple[int, ...]:
    """Return the indices of the links whose inertia is stated, or that a joint drives."""
    return tuple(
        i
        for i, link in enumerate(robot.links)
        if link.source != "absent" or (link.joint >= 0 and robot.driven[link.joint] == i)
    )


def reference_bodies(robot: Robot, links: Sequence[Link]) -> np.ndarray:
    """Return a consistent body of the size of each link, in the link's frame, (n, 10)."""
    phis = [link.phi for link in links]
    lengths = link_lengths(robot, links)
    masses = [phi[0] for phi in phis if np.isfinite(phi[0]) and phi[0] > 0]
    mass = float(np.median(masses)) if masses else 1.0
    return np.array(
        [reference_body(phi, mass, length) for phi, length in zip(phis, lengths, strict=True)]
    )


def link_lengths(robot: Robot, links: Sequence[Link]) -> np.ndarray:
    """Return the extent of each link, m, (n,): how far the next joints and its mass are.

    A link that reaches nowhere takes the median of the others.
    """
    lengths = np.zeros(len(links))
    for k, link in enumerate(links):
        if link.joint >= 0 and robot.links[robot.driven[link.joint]] is link:
            reach = [np.linalg.norm(j.p) for j in robot.joints if j.parent == link.joint]
            lengths[k] = max(reach, default=0.0)
        phi = link.phi
        if not np.all(np.isfinite(phi)) or phi[0] <= 0:
            continue
        com = float(np.linalg.norm(phi[1:4])) / phi[0]
        # Of a broken description a far centre of mass is no measure, where a joint gives one.
        if lengths[k] == 0.0 or com <= 2 * lengths[k]:
            lengths[k] = max(lengths[k], com)
        if lengths[k] == 0.0:
            lengths[k] = np.sqrt(max(float(phi[4] + phi[6] + phi[9]), 0.0) / (2 * phi[0]))
    some = lengths[lengths > 0]
    return np.where(lengths > 0, lengths, np.median(some) if len(some) else _FALLBACK_LENGTH)


def body_scale(reference: np.ndarray) -> np.ndarray:
    """Size of each of the ten parameters of a body: mass, mass times length, inertia."""
    mass = reference[0]
    inertia = (reference[4] + reference[6] + reference[9]) / 2
    moment = np.sqrt(mass * inertia)
    powers = {"m": mass, "mx": moment, "my": moment, "mz": moment}
    return np.array([powers.get(name, inertia) for name in PARAMETERS])
