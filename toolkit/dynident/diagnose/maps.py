"""Where the model fails: mean residuals against motion, load, time and position harmonics."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import stats

from dynident.diagnose.diagnosis import ResidualMap
from dynident.diagnose.held_out import HeldOut
from dynident.robot import Robot

BINS = 24
HARMONICS = np.arange(1, 61)
"""Cycles per revolution (or per 2 pi metres) at which the residual is looked at."""

_LEVEL = 1e-3  # of the tests behind a sentence
_SHARE = 0.5  # of a map's variance that a shape must explain to be named

# A shape in a map, what it looks like, and which physics shows so (METHODS: at a glance).
_SHAPES = {
    "velocity": {
        "a step at zero velocity: dry (Coulomb) friction": lambda x, s: np.tanh(x / (0.02 * s)),
        "a slope against velocity: viscous friction": lambda x, s: x,
        "spikes beside zero velocity: Stribeck friction, or presliding": lambda x, s: (
            np.sign(x) * np.exp(-((x / (0.1 * s)) ** 2))
        ),
        "a curve, steeper at speed: drag": lambda x, s: x * np.abs(x),
        "slopes that differ between the directions: asymmetric friction": lambda x, s: np.abs(x),
        "a constant at all velocities: an offset": lambda x, s: np.ones_like(x),
    },
    "position": {
        "a ramp against position: a spring": lambda x, s: x,
    },
    "acceleration": {
        "a slope against acceleration: an inertia (of a rotor, say)": lambda x, s: x,
    },
    "load": {
        "a tilted line against load: a drive gain": lambda x, s: x,
    },
    "time": {
        "a ramp over time: a drift": lambda x, s: x,
    },
}


def residual_maps(robot: Robot, before: HeldOut, after: HeldOut) -> tuple[ResidualMap, ...]:
    """Residual maps of every joint on held-out data.

    Parameters
    ----------
    before, after : of the model as given and of the final one, on the same recordings.
    """
    return tuple(one for joint in range(robot.n) for one in _of_joint(robot, joint, before, after))


def _of_joint(robot: Robot, j: int, before: HeldOut, after: HeldOut) -> Iterator[ResidualMap]:
    old = np.concatenate([run.residual[:, j] for run in before.runs])
    new = np.concatenate([run.residual[:, j] for run in after.runs])
    motion = robot.units[j]
    noise = None if before.noise_std is None else float(before.noise_std[j])
    quantities = {
        "velocity": (f"{motion}/s", [run.v[:, j] for run in before.runs]),
        "position": (motion, [run.q[:, j] for run in before.runs]),
        "acceleration": (f"{motion}/s^2", [run.a[:, j] for run in before.runs]),
        "load": (robot.torque_units[j], [run.predicted[:, j] for run in before.runs]),
        "time": ("s", [run.t for run in before.runs]),
    }
    for against, (unit, parts) in quantities.items():
        x = np.concatenate(parts)
        at, means, count = _binned(x, np.column_stack([old, new]))
        if len(at) < 4:
            continue
        spread = np.sqrt(before.inflation[j] / count)
        band = np.full(len(at), np.nan) if noise is None else 2.0 * noise * spread
        sigma = (noise if noise is not None else float(np.std(old))) * spread
        sentence = _sentence(against, at, means[:, 0], sigma)
        yield ResidualMap(
            robot.names[j],
            robot.torque_units[j],
            against,
            unit,
            at,
            means[:, 0],
            means[:, 1],
            band,
            sentence,
        )
    yield _spectrum(robot, j, before, old, new, noise)


def _binned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres, means and counts in bins of equal width that hold at least ten samples."""
    low, high = np.quantile(x, [0.002, 0.998])
    if not high > low:
        return np.zeros(0), np.zeros((0, y.shape[1])), np.zeros(0)
    edges = np.linspace(low, high, BINS + 1)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    kept = counts >= 10
    safe = np.maximum(counts, 1)
    at = np.bincount(bins, weights=x, minlength=BINS) / safe
    means = np.column_stack([np.bincount(bins, weights=c, minlength=BINS) / safe for c in y.T])
    return at[kept], means[kept], counts[kept]


def _sentence(against: str, at: np.ndarray, mean: np.ndarray, sigma: np.ndarray) -> str:
    """The shape that a map shows, if it shows one beyond the noise."""
    weight = 1.0 / sigma
    power = float(np.sum((mean * weight) ** 2))
    if stats.chi2.sf(power, len(at)) > _LEVEL:
        return ""
    scale = float(np.abs(at).max()) or 1.0
    best, share = "", 0.0
    for words, shape in _SHAPES[against].items():
        column = shape(at, scale) * weight
        norm = float(column @ column)
        explained = float(column @ (mean * weight)) ** 2 / (norm * power) if norm > 0 else 0.0
        if explained > share:
            best, share = words, explained
    if share < _SHARE:
        return ""
    return f"{best} ({100 * share:.0f} % of what is seen here)"


def _spectrum(
    robot: Robot, j: int, before: HeldOut, old: np.ndarray, new: np.ndarray, noise: float | None
) -> ResidualMap:
    q = np.concatenate([run.q[:, j] for run in before.runs])
    waves = np.exp(-1j * np.outer(HARMONICS, q))
    amplitudes = [2.0 * np.abs(waves @ (e - e.mean())) / len(q) for e in (old, new)]
    size = len(HARMONICS)
    level = np.full(size, np.nan)
    sentence = ""
    if noise is not None:
        # Each amplitude is Rayleigh: one in a thousand of all lines exceeds this by chance.
        level[:] = noise * np.sqrt(4.0 * np.log(size / _LEVEL) * before.inflation[j] / len(q))
        peak = int(np.argmax(amplitudes[0]))
        others = np.delete(amplitudes[0], [i for i in (peak - 1, peak, peak + 1) if 0 <= i < size])
        stands_out = amplitudes[0][peak] > max(level[peak], 3.0 * float(np.median(others)))
        if stands_out and HARMONICS[peak] > 2:
            sentence = f"a line at {HARMONICS[peak]} cycles per revolution: ripple"
    unit = "cycles per revolution" if robot.kinds[j] == "revolute" else "cycles per 2 pi m"
    return ResidualMap(
        robot.names[j],
        robot.torque_units[j],
        "cycles per revolution",
        unit,
        HARMONICS.astype(float),
        amplitudes[0],
        amplitudes[1],
        level,
        sentence,
    )
