"""Rows of a wrench sensor: what the motion of its frame makes of the parameters of a load.

A body with the parameters phi that moves with the sensor needs the wrench W(v, a, gravity) phi in
the sensor's frame, and the sensor adds six constants. W is the regressor of three sliding and three
turning joints at the sensor, all of which stand still.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from dynident.errors import StudyError, without_warnings
from dynident.fitting.loads import Load, LoadSplit, split
from dynident.fitting.sampling import BLOCK, Sampled, sample
from dynident.inertia import frame_change
from dynident.recording import COMPONENTS, Dataset, Recording, uniform
from dynident.recording.white_noise import encoder_noise_std
from dynident.robot import Joint, Link, Robot

_KINDS = ("prismatic", "prismatic", "prismatic", "revolute", "revolute", "revolute")
_ROUNDING = 1e-12  # rad or m: less noise than this in a position is that of its digits
ALWAYS = "on the sensor"
"""Name of what hangs on the sensor in recordings that name no load."""


@dataclass(frozen=True, eq=False)
class WrenchProblem:
    """What is to be weighed, and by what.

    Attributes
    ----------
    robot : whose joints move the sensor.
    frame : the link in whose frame the wrench is stated.
    dataset : recordings as `read_wrench` makes them, each with the name of its load.
    loads : that the recordings name; what is None of them is unknown.
    records : "what moves the load", the wrench by which the sensor moves what hangs on it, or "what
        the load does" to the sensor, the opposite.

    Raises
    ------
    StudyError
        If the robot has no such link, nothing moves it, it carries further joints, a load's link
        does not move with it, or a recording's load is described nowhere.
    """

    robot: Robot
    frame: str
    dataset: Dataset
    loads: tuple[Load, ...] = ()
    _: KW_ONLY
    records: Literal["what moves the load", "what the load does"] = "what moves the load"

    def __post_init__(self) -> None:
        where, named = f"wrench.{self.frame}", {load.name for load in self.loads}
        link = self._link(self.frame, where)
        if link.joint == -1:
            what = f"no joint moves the link '{self.frame}'"
            raise StudyError(what, where, "a sensor that stands still weighs by gravity alone")
        beyond = [one.name for one in self.robot.joints if one.parent == link.joint]
        if beyond:
            what = f"the joint '{beyond[0]}' moves what hangs on the link '{self.frame}'"
            raise StudyError(what, where, "only a sensor behind the last joint weighs one body")
        for recording in self.dataset.recordings:
            if recording.load and recording.load not in named:
                remedy = f"loads: {', '.join(named)}" if named else "describe it in [loads]"
                raise StudyError(f"no load '{recording.load}'", recording.where, remedy)
        for load in self.loads:
            one = self._link(load.link or self.frame, f"load '{load.name}'")
            if one.joint != link.joint:
                what = f"its link '{load.link}' does not move with the sensor '{self.frame}'"
                raise StudyError(what, f"load '{load.name}'", "state it in the sensor's frame")

    def _link(self, name: str, where: str) -> Link:
        for link in self.robot.links:
            if link.name == name:
                return link
        names = ", ".join(link.name for link in self.robot.links if link.joint != -1)
        raise StudyError(f"the robot has no link '{name}'", where, f"links: {names}")

    @cached_property
    def bodies(self) -> tuple[Load, ...]:
        """What is weighed, each in a frame that it names: first what always hangs on the sensor.

        That is there where some recordings name no load; where all do, it is a part of each.
        """
        bare = any(not recording.load for recording in self.dataset.recordings)
        named = tuple(replace(load, link=load.link or self.frame) for load in self.loads)
        return (Load(name=ALWAYS, link=self.frame), *named) if bare else named

    def placement(self, load: Load) -> tuple[np.ndarray, np.ndarray]:
        """Return the placement R (3, 3), p (3,) in m of a load's link in the sensor's frame."""
        own, sensor = (self._link(name, self.frame) for name in (load.link, self.frame))
        R = sensor.R.T
        return R @ own.R, R @ (own.p - sensor.p)

    @cached_property
    def splits(self) -> tuple[LoadSplit, ...]:
        """Known and unknown parts of each body, in the sensor's frame."""
        found = []
        for load in self.bodies:
            change, parts = frame_change(*self.placement(load)), split(load)
            found.append(LoadSplit(parts.names, change @ parts.given, change @ parts.unknown))
        return tuple(found)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Columns of what is unknown of each body; the six constants follow them."""
        ends = np.cumsum([0, *(len(parts.names) for parts in self.splits)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))

    @property
    def constants(self) -> slice:
        """Columns of the six constants of the sensor."""
        start = self.slices[-1].stop
        return slice(start, start + 6)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        pairs = zip(self.bodies, self.splits, strict=True)
        of_bodies = (f"{load.name}.{own}" for load, parts in pairs for own in parts.names)
        return (*of_bodies, *(f"constant.{one}" for one in COMPONENTS))

    @cached_property
    def _sensed(self) -> Robot:
        """The robot with six joints more."""
        link, joints = self._link(self.frame, self.frame), list(self.robot.joints)
        R, p = link.R, link.p
        parent, links = link.joint, list(self.robot.links)
        for number, (kind, own) in enumerate(zip(_KINDS, COMPONENTS, strict=True)):
            name = f"wrench.{self.frame}.{own}"
            axis = np.eye(3)[number % 3]
            joint = Joint(name=name, kind=kind, parent=parent, R=R, p=p, axis=axis, child=name)
            joints.append(joint)
            parent, R, p = len(joints) - 1, np.eye(3), np.zeros(3)
            still = Link(name=name, joint=parent, R=R, p=p, phi=np.zeros(10), source="absent")
            links.append(still)
        return replace(self.robot, joints=tuple(joints), links=tuple(links), description=None)

    def samples(self) -> list[Sampled]:
        """Return the recordings, ready for evaluation."""
        return [sample(one, self.dataset.filter) for one in self.dataset.recordings]

    def rows_of(
        self, sampled: Sampled, mixing: np.ndarray | None = None
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield blocks (T, 6, u) of a recording, and the wrench (T, 6) less what is known of it.

        Parameters
        ----------
        sampled : one of `samples`.
        mixing : (6, 6) by which components are multiplied, so that their errors are independent.
        """
        n, last = self.robot.n, range(10 * self._sensed.n - 10, 10 * self._sensed.n)
        parallel, source = sampled.parallel, sampled.source
        sign = 1.0 if self.records == "what moves the load" else -1.0
        for plan in parallel.blocks(source.samples, BLOCK, sampled.kept):
            motion = source.part(plan.raw)
            found = self._sensed.regressor(motion.q, motion.v, motion.a, columns=list(last))
            W, wrench = parallel.apply_each([found[:, n:].copy(), motion.tau[:, n:].copy()], plan)
            wrench = sign * wrench
            block = np.zeros((len(W), 6, self.constants.stop))
            # They are constants of what is recorded, whichever way round that is.
            block[:, :, self.constants] = sign * np.eye(6)
            for load, parts, own in zip(self.bodies, self.splits, self.slices, strict=True):
                if load.name in (ALWAYS, sampled.recording.load):
                    block[:, :, own] = W @ parts.unknown
                    wrench = wrench - W @ parts.given
            if mixing is not None:
                block, wrench = mixing @ block, wrench @ mixing.T
            yield block, wrench

    def rows(self, mixing: np.ndarray | None = None) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the same of all recordings."""
        for sampled in self.samples():
            yield from self.rows_of(sampled, mixing)

    def as_one_body(self) -> WrenchProblem:
        """Return the problem of all recordings with one unknown body, whatever they carry."""
        recordings = tuple(one.replace(load="") for one in self.dataset.recordings)
        return replace(self, dataset=replace(self.dataset, recordings=recordings), loads=())

    def trembling(self, seed: int = 0) -> WrenchProblem:
        """Return the problem with as much noise again in the positions as they have.

        Parameters
        ----------
        seed : of the noise.
        """
        rng, n = np.random.default_rng(seed), self.robot.n

        def shaken(recording: Recording) -> Recording:
            recording = uniform(recording)  # before repeated readings differ
            q = np.array(recording.q)
            std = np.maximum(encoder_noise_std(q[:, :n]), _ROUNDING)
            q[:, :n] += std * rng.normal(size=(len(q), n))
            return recording.replace(q=q)

        with without_warnings():
            recordings = tuple(map(shaken, self.dataset.recordings))
        return replace(self, dataset=replace(self.dataset, recordings=recordings))
