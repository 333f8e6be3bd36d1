"""A case as a virtual experiment, with noise that is not the package's own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from blind_study.cases import Case
from blind_study.foreign import sensor_error
from blind_study.robots import Specimen
from dynident.closed_loop import Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.recording import Recording

PERIOD, REPETITIONS, PAUSE = 8.0, 2, 120.0
"""s of a period, periods in a recording, and s from one recording's start to the next one's."""
RUNS, TESTS = 4, 2
_MEMORY_S = 0.02  # of the noise that is correlated


@dataclass(frozen=True)
class SensorError:
    """An error of the recorded position at one joint: its law, column and size."""

    law: str
    joint: int
    size: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Laboratory(Experiment):
    """An experiment whose torque noise has a colour and whose encoder may be wrong.

    Attributes
    ----------
    torque_noise : (n,) N m, root mean square.
    colour : see `Case`.
    errors : of the recorded positions.
    says_payload : whether recordings say which of them carry a payload, known or not.
    """

    torque_noise: tuple[float, ...] = ()
    colour: str = "white"
    errors: tuple[SensorError, ...] = ()
    says_payload: bool = False

    @property
    def states_payload(self) -> bool:
        """Whether the recordings say which of them carry the payload."""
        return self.says_payload or super().states_payload

    def run(self, progress=None) -> tuple[Recording, ...]:
        """Simulate and record the runs."""
        return tuple(self._disturbed(k, one) for k, one in enumerate(super().run(progress)))

    def _disturbed(self, index: int, recording: Recording) -> Recording:
        q, tau = np.array(recording.q), np.array(recording.tau)
        if self.torque_noise:
            rng = np.random.default_rng([self.seed, index, 5])
            tau += np.array(self.torque_noise) * _noise(self.colour, recording, rng)
        for one in self.errors:
            q[:, one.joint] += sensor_error(one.law, one.size, q[:, one.joint])
        return recording.replace(q=q, tau=tau)


def _noise(colour: str, recording: Recording, rng: np.random.Generator) -> np.ndarray:
    """Noise of about unit variance, (T, n)."""
    white = rng.standard_normal(recording.q.shape)
    if colour == "ar1":
        pole = np.exp(-1.0 / (_MEMORY_S * recording.rate_hz))
        start = white[:1] * pole / np.sqrt(1 - pole**2)
        found, _ = signal.lfilter([1.0], [1.0, -pole], white, axis=0, zi=start)
        return found * np.sqrt(1 - pole**2)
    if colour == "speed":
        speed = np.abs(np.gradient(recording.q_ref, axis=0))  # type: ignore[arg-type]
        growth = 0.4 + 1.2 * speed / (speed.max(axis=0) + 1e-12)
        return white * growth
    return white


@dataclass(frozen=True, eq=False)
class Plan:
    """What all experiments of a case have in common.

    Attributes
    ----------
    case, made : what was drawn.
    known : effects that the study names.
    rate_hz : of the controller and the recordings.
    runs, tests : recordings to fit and to judge by.
    repetitions : periods in a recording.
    """

    case: Case
    made: Specimen
    known: tuple[TrueEffect, ...]
    rate_hz: float
    runs: int = RUNS
    tests: int = TESTS
    repetitions: int = REPETITIONS

    def whole(self, hidden: tuple[TrueEffect, ...], errors: tuple[SensorError, ...]) -> Laboratory:
        """Return the experiment that is made of the case."""
        return self._laboratory(self._runs(), hidden, errors)

    def short(
        self, hidden: tuple[TrueEffect, ...], errors: tuple[SensorError, ...], *, noisy: bool
    ) -> Laboratory:
        """Return two recordings of one period, early and late, one with the payload."""
        picked = (0, max(1, min(3, self.runs - 1)))
        runs = tuple(replace(self._runs()[k], duration=PERIOD) for k in picked)
        made = self._laboratory(runs, hidden, errors)
        return made if noisy else replace(made, sensors=Sensors(), torque_noise=())

    def _runs(self) -> tuple[ExperimentRun, ...]:
        made, case = self.made, self.case
        hidden = {one.effect for one in case.hidden}
        always = case.kind == "absorbed" and "payload" in hidden
        carried = case.payload or "payload" in hidden
        return tuple(
            ExperimentRun(
                trajectory=Fourier.random(
                    made.robot,
                    PERIOD,
                    [case.seed, case.number, r],
                    amplitude=made.amplitude,  # type: ignore[arg-type]
                    speed=made.speed,  # type: ignore[arg-type]
                ),
                duration=PERIOD * self.repetitions,
                file=f"run{r + 1}.npz",
                use="train" if r < self.runs else "test",
                start=PAUSE * r,
                payload=always or (carried and r % 2 == 1),
            )
            for r in range(self.runs + self.tests)
        )

    def _laboratory(self, runs, hidden, errors) -> Laboratory:
        case, made = self.case, self.made
        named = {one.effect for one in case.hidden}
        return Laboratory(
            robot=made.robot,
            controller=made.controller,
            runs=runs,
            effects=(*self.known, *hidden),
            sensors=Sensors(
                position_std=case.position_std, position_resolution=case.position_resolution
            ),
            seed=case.seed * 10007 + case.number,
            friction_width=case.width,
            nominal=made.nominal,
            torque=case.torque,
            torque_noise=tuple(float(x) for x in case.torque_noise * made.dry),
            colour=case.colour,
            errors=errors,
            says_payload=case.says_payload and "payload" in named,
        )
