"""Validations with plausible curves, made without a simulator."""

from __future__ import annotations

import numpy as np

from dynident.validation.loop_errors import LoopRun, Signals
from dynident.validation.validation_result import Skipped, Validation


def _signals(t: np.ndarray, q: np.ndarray, torque: np.ndarray) -> Signals:
    v = np.gradient(q, t, axis=0)
    return Signals(q, v, np.gradient(v, t, axis=0), torque)


def validation(
    joints: tuple[str, ...] = ("shoulder", "elbow"),
    *,
    runs: int = 2,
    samples: int = 400,
    worst: float = 0.3,
    noise: bool = True,
    skipped: tuple[Skipped, ...] = (),
) -> Validation:
    """Loops that lag behind their reference; the simulated one misses a share `worst` of the lag.

    The first joint does so; each further one half as much.
    """
    n, found = len(joints), []
    share = worst / 2.0 ** np.arange(n)
    for k in range(runs):
        rng = np.random.default_rng(k)
        t = 0.5 + np.arange(samples) / 50.0
        w = 2 * np.pi / 8.0 * np.arange(1, 6)
        amplitude = rng.normal(size=(5, n)) * 0.3
        reference = np.sin(np.outer(t, w)) @ amplitude
        lag = 0.05 * np.cos(np.outer(t, w)) @ (amplitude * w[:, None])
        law = 20.0 * reference + 5.0 * lag
        tiny = 1e-5 * rng.normal(size=lag.shape)
        noisy = law + 0.05 * rng.normal(size=lag.shape)
        found.append(
            LoopRun(
                name=f"run{k + 5}.csv",
                t=t,
                measured=_signals(t, reference - lag + tiny, noisy),
                simulated=_signals(t, reference - (1 + share) * lag, law * (1 + 0.1 * share)),
                reference=_signals(t, reference, law),
                noise=np.outer([1e-5, 5e-4, 0.02, 0.05], np.ones(n)) if noise else None,
                saturated=np.where(np.arange(n) == 0, 0.02 * (k == 0), 0.0),
                law_terms=np.full(n, 5.0),
                encoder_noise=np.full(n, 1e-5),
            )
        )
    return Validation(
        robot="bench arm",
        joints=joints,
        units=("rad",) * n,
        torque_units=("N m",) * n,
        controller="PD controller at 250 Hz",
        runs=tuple(found),
        skipped=skipped,
        settling=0.5 if found else float("nan"),
        noise_source="given" if noise and found else "unknown",
    )
