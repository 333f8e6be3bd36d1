"""Motions that are to be simulated: their samples, references, encoder noise and rollouts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.plant.drive import Drive, ReferenceSamples
from dynident.closed_loop.rollout import Rollout, Task
from dynident.closed_loop.sensors import rounded
from dynident.closed_loop.stepped_motion import Measurement, SteppedMotion
from dynident.errors import SimulationError
from dynident.robot import Robot

LARGEST = 1e6
"""Largest position (rad, m), speed and acceleration of a reference."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanSettings:
    """What all motions of a simulation share.

    Attributes
    ----------
    controller : of n joints.
    position_std, resolution : (n,) rad or m, of the encoders; 0 for none.
    scale : (n,) factor of the feedback.
    before : samples that are thrown away.
    accuracy : of the integrator.
    """

    controller: Controller
    position_std: np.ndarray
    resolution: np.ndarray
    scale: np.ndarray
    before: int
    accuracy: float

    @property
    def rate(self) -> float:
        """Samples per second."""
        return self.controller.simulated_rate()

    def time(self, kept: int) -> np.ndarray:
        """Times of a motion's samples, and of the end of the last, s."""
        # The last command is held to one sample more.
        return (np.arange(self.before + kept + 1) - self.before) / self.rate


@dataclass(frozen=True, eq=False)
class Plan:
    """A motion to be simulated.

    Attributes
    ----------
    task : Task
    kept : samples of the rollout.
    run : what it shares with others.
    """

    task: Task
    kept: int
    run: PlanSettings

    @property
    def samples(self) -> int:
        """How many are simulated."""
        return self.run.before + self.kept

    @cached_property
    def noise(self) -> np.ndarray:
        """Of the encoder, (samples, n) rad or m; drawn once."""
        shape = (self.samples, self.task.mechanism.robot.n)
        if self.task.rng is None:
            return np.broadcast_to(0.0, shape)
        normal = self.task.rng.standard_normal(shape)
        return self.run.position_std * self.task.noise_sign * normal

    @property
    def nominal(self) -> Robot | Mechanism:
        """The model inside the controller."""
        return self.task.nominal or self.task.mechanism.robot

    def reference(self, samples: int) -> ReferenceSamples:
        """Return what it follows, at so many samples.

        Raises
        ------
        SimulationError
            If it is not finite, or too large.
        """
        found = self.task.trajectory.at(self.run.time(samples - self.run.before)[:-1])
        for name, x in zip(("position", "velocity", "acceleration"), found, strict=True):
            if not (np.abs(x) < LARGEST).all():  # false of NaN too
                what = f"its {name} is not finite, or beyond {LARGEST:g}"
                raise SimulationError(what, self.task.name or "reference", reason="reference")
        return ReferenceSamples(*found)

    def needed(self, reference: ReferenceSamples) -> np.ndarray:
        """Return the torque that the reference needs at its first sample, (n,)."""
        first = (x[:1] for x in (reference.q, reference.v, reference.a))
        t = self.run.time(self.kept)[:1] + self.task.start
        return self.task.mechanism.stiff_command(t, *first)[0]

    def rollout(
        self, motion: SteppedMotion, reference: ReferenceSamples, place: int = 0
    ) -> Rollout:
        """Return what is kept of a simulated motion.

        Parameters
        ----------
        motion, reference : of motions side by side.
        place : of this one among them. Its internal states, if any, are all that there are.
        """
        n, first = self.task.mechanism.robot.n, self.run.before
        rows, columns = slice(first, self.samples), slice(place * n, place * n + n)
        own = (rows, columns)
        mean = motion.mean[max(first - 1, 0) : rows.stop, columns]
        if not first:
            mean = np.vstack([mean[:1], mean])
        return Rollout(
            t=np.arange(self.kept) / self.run.rate,
            q=motion.q[own],
            v=motion.v[own],
            q_measured=rounded(motion.measured[own], self.run.resolution),
            q_ref=reference.q[own],
            v_ref=reference.v[own],
            u=motion.u[own],
            u_before=motion.u[max(first - 1, 0), columns],
            torque=(mean[:-1] + mean[1:]) / 2,
            acting=motion.acting[own],
            saturated=motion.saturated[own].mean(axis=0),
            start=self.task.start,
            mechanism=self.task.mechanism,
            past=None if motion.past is None else motion.past.of(rows, columns, slice(None)),
        )


@dataclass(frozen=True, eq=False)
class Stacked:
    """Motions side by side, as long as the longest of them.

    Attributes
    ----------
    reference : (T, K n).
    measurement : (T, K n).
    drive : of all of them.
    """

    reference: ReferenceSamples
    measurement: Measurement
    drive: Drive

    @classmethod
    def of(cls, plans: Sequence[Plan]) -> Stacked:
        """Return that of some plans of one run.

        Raises
        ------
        SimulationError
            See `Plan.reference`.
        """
        samples = max(one.samples for one in plans)
        return cls.along(plans, [one.reference(samples) for one in plans])

    @classmethod
    def along(cls, plans: Sequence[Plan], references: Sequence[ReferenceSamples]) -> Stacked:
        """Return that of plans whose references are known."""
        run, samples = plans[0].run, len(references[0].q)
        controller, first = run.controller, references[0]
        noise = plans[0].noise
        if len(plans) > 1:
            parts = ([getattr(one, name) for one in references] for name in ("q", "v", "a"))
            first = ReferenceSamples(*map(np.hstack, parts))
            noise = np.hstack(
                [np.pad(one.noise, ((0, samples - one.samples), (0, 0))) for one in plans]
            )
        steady = None
        if controller.ki:
            both = zip(plans, references, strict=True)
            steady = np.concatenate([plan.needed(reference) for plan, reference in both])
        drive = Drive(controller, first, [one.nominal for one in plans], run.scale, steady)
        return cls(first, Measurement(noise, np.tile(run.resolution, len(plans))), drive)
