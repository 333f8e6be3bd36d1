"""Experiments on a robot in MuJoCo: longer runs, out of which recordings are cut in mid-motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from blind_study.circumstances import Circumstances, MujocoCase
from blind_study.experiments import Laboratory, Plan, SensorError
from blind_study.foreign import sensor_error
from blind_study.mujoco_machine import build
from blind_study.mujoco_plant import Loop, Plant, needed
from dynident.closed_loop import ExperimentRun, Fourier
from dynident.closed_loop.sensors import delayed, rounded
from dynident.recording import Recording

LEAD_IN, AFTERWARDS = 2.0, 0.2
"""s simulated before and after what is recorded."""
WITHOUT_REPETITION = (24.0, 15)
"""s and harmonics of a motion that does not repeat: as fast as one of 8 s and 5 harmonics."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MujocoRun(ExperimentRun):
    """A recording that begins `phase` s into its trajectory."""

    phase: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class MujocoLaboratory(Laboratory):
    """An experiment in MuJoCo.

    Attributes
    ----------
    circumstances : how it is driven and recorded.
    width : rad/s over which friction truly changes its sign; 0 for MuJoCo's constraint.
    wrong_sensors : errors of the encoders, which the controller sees too.
    """

    circumstances: Circumstances
    width: float
    wrong_sensors: tuple[SensorError, ...] = ()

    def run(self, progress=None) -> tuple[Recording, ...]:
        """Simulate and record the runs."""
        return tuple(self._disturbed(k, self._recorded(k, run)) for k, run in enumerate(self.runs))

    def _recorded(self, index: int, run: ExperimentRun) -> Recording:
        n, said, rate = self.robot.n, self.circumstances, self.controller.simulated_rate()
        rng = np.random.default_rng([self.seed, index, 6])
        before, kept = round(LEAD_IN * rate), round(run.duration * rate)
        total = before + kept + round(AFTERWARDS * rate)
        # A clock that jitters never runs backwards.
        jitter = np.clip(said.jitter * rng.standard_normal(total), -0.45, 0.45)
        t = (np.arange(total) - before + jitter) / rate
        phase = run.phase if isinstance(run, MujocoRun) else 0.0
        q_ref, v_ref, a_ref = run.trajectory.at(t + phase)
        ahead = np.zeros_like(q_ref)
        if said.feedforward == "nominal":
            ahead = needed(self.nominal or self.robot, q_ref, v_ref, a_ref)
        feedback = self.controller.feedback()
        resolution = self.sensors.each("position_resolution", n)
        built = build(self.robot, self.effects, said, index + 1, carries_payload=run.payload)
        loop = Loop(
            t=t + run.start,
            q_ref=q_ref,
            v_ref=v_ref,
            ahead=ahead,
            kp=feedback.position,
            kd=feedback.speed,
            cutoff_hz=self.controller.derivative_cutoff_hz or rate,
            rate_hz=rate,
            noise=self.sensors.each("position_std", n) * rng.standard_normal((total, n)),
            resolution=resolution,
            wrong=self._wrong if self.wrong_sensors else None,
        )
        q, u = Plant(built, self.width).run(loop, run.file)
        tau = u
        if self.torque == "measured":
            tau = (np.concatenate([u[:1], u[:-1]]) + u) / 2
        tau = delayed(tau, t, built.delay, run.trajectory.period)
        rows = slice(before, before + kept)
        return Recording(
            t=t[rows] - t[before],
            q=rounded(q[rows], resolution),
            tau=tau[rows],
            joints=self.robot.names,
            q_ref=rounded(q_ref[rows], resolution),
            period=run.trajectory.period if said.repetition == "stated" else None,
            start=run.start,
            use=run.use,
            payload=run.payload if self.states_payload else None,
            torque=self.torque,
            name=run.file,
            number=index + 1,
        )

    def _wrong(self, q: np.ndarray) -> np.ndarray:
        found = np.zeros_like(q)
        for one in self.wrong_sensors:
            found[one.joint] += sensor_error(one.law, one.size, q[one.joint])
        return found


@dataclass(frozen=True, eq=False)
class MujocoPlan(Plan):
    """What all experiments of a case in MuJoCo have in common."""

    case: MujocoCase

    def _runs(self) -> tuple[ExperimentRun, ...]:
        return tuple(self._cut(r, run) for r, run in enumerate(super()._runs()))

    def _cut(self, r: int, run: ExperimentRun) -> MujocoRun:
        """Return a run that begins somewhere in its motion."""
        case, made = self.case, self.made
        rng = np.random.default_rng([case.seed, case.number, r, 9])
        trajectory = run.trajectory
        if case.circumstances.repetition == "none":
            period, harmonics = WITHOUT_REPETITION
            trajectory = Fourier.random(
                made.robot,
                period,
                [case.seed, case.number, r],
                harmonics,
                amplitude=made.amplitude,  # type: ignore[arg-type]
                speed=made.speed,  # type: ignore[arg-type]
            )
        return MujocoRun(
            trajectory=trajectory,
            duration=run.duration,
            file=run.file,
            use=run.use,
            start=run.start,
            payload=run.payload,
            phase=float(rng.uniform(0.0, trajectory.period)),
        )

    def _laboratory(self, runs, hidden, errors) -> MujocoLaboratory:
        said = self.case.circumstances
        # The constraint's friction has no width; the package wants one to write the study.
        stated = replace(self, case=replace(self.case, width=self.case.stated_width))
        made = Plan._laboratory(stated, runs, hidden, ())
        controller = replace(made.controller, feedforward=said.feedforward == "nominal")
        own = {name: getattr(made, name) for name in made.__dataclass_fields__}
        own |= {"controller": controller}
        return MujocoLaboratory(
            **own, circumstances=said, width=self.case.width, wrong_sensors=errors
        )
