"""Where the model fails: mean residuals against motion, load, time and position harmonics."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import special

from dynident.criteria import DEFAULTS, MapCriteria
from dynident.effects import catalogue
from dynident.evidence.held_out import HeldOut
from dynident.model import Model
from dynident.robot import Robot

Space = Literal["linear", "root"]
"""In what classes of a quantity are of equal width."""


@dataclass(frozen=True, kw_only=True)
class ResidualMap:
    """Mean residual of one joint in bins of a quantity, on the test recordings.

    Attributes
    ----------
    joint, torque_unit : the joint, and N m or N.
    against : "velocity", "position", "acceleration", "load", "time" or "cycles per revolution".
    unit : of that quantity.
    at : (B,) centres of the bins (or frequencies).
    before, after : (B,) mean residual (amplitude for a spectrum) of the model as given, and of
        the model with the effects added.
    band : (B,) half width of the interval in which noise alone would lie (2 standard errors);
        NaN where the noise is unknown.
    sentence : what the picture shows, in plain words.
    """

    joint: str
    torque_unit: str
    against: str
    unit: str
    at: np.ndarray
    before: np.ndarray
    after: np.ndarray
    band: np.ndarray
    sentence: str


def residual_maps(
    model: Model, before: HeldOut, after: HeldOut, criteria: MapCriteria = DEFAULTS.maps
) -> tuple[ResidualMap, ...]:
    """Residual maps of every joint on held-out data.

    Parameters
    ----------
    model : as given: what its effects can fit is cleared away before a shape is named.
    before, after : of the model as given and of the final one, on the same recordings.
    criteria : when a map shows something.

    Returns
    -------
    Maps joint by joint, each over what its sentence names.
    """
    joints = range(model.robot.n)
    return tuple(
        one for joint in joints for one in _of_joint(model, joint, before, after, criteria)
    )


def _of_joint(
    model: Model, j: int, before: HeldOut, after: HeldOut, criteria: MapCriteria
) -> Iterator[ResidualMap]:
    robot = model.robot
    fitted = {e.name for e in model.effects if e.joint == robot.names[j]}
    certain = np.concatenate([run.certain[:, j] for run in before.runs])
    if not certain.any():
        return
    old, new = (
        np.concatenate([run.residual[:, j] for run in one.runs])[certain] for one in (before, after)
    )
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
        x = np.concatenate(parts)[certain]
        space: Space = "root" if against == "velocity" else "linear"
        at, means, count = _binned(x, np.column_stack([old, new]), space, criteria)
        if len(at) < 4:
            continue
        spread = np.sqrt(before.inflation[j] / count)
        band = np.full(len(at), np.nan) if noise is None else criteria.band * noise * spread
        sigma = (noise if noise is not None else float(np.std(old))) * spread
        sentence = _sentence(against, at, (means[:, 0], sigma), fitted, criteria)
        yield ResidualMap(
            joint=robot.names[j],
            torque_unit=robot.torque_units[j],
            against=against,
            unit=unit,
            at=at,
            before=means[:, 0],
            after=means[:, 1],
            band=band,
            sentence=sentence,
        )
    yield _spectrum(robot, j, before, (old, new), criteria)


def _binned(
    x: np.ndarray, y: np.ndarray, space: Space, criteria: MapCriteria
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres, means and counts in bins that hold enough samples.

    Of equal width in x; or, with `space` "root", in the root of abs(x): finer towards zero, where
    friction does what tells one kind from another.
    """
    low, high = np.quantile(x, [criteria.left_out, 1.0 - criteria.left_out])
    if not high > low:
        return np.zeros(0), np.zeros((0, y.shape[1])), np.zeros(0)
    bins = criteria.bins
    if space == "root":
        start, stop = np.sign(low) * np.sqrt(abs(low)), np.sign(high) * np.sqrt(abs(high))
        roots = np.linspace(start, stop, bins + 1)
        edges = np.sign(roots) * roots**2
    else:
        edges = np.linspace(low, high, bins + 1)
    inside = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    counts = np.bincount(inside, minlength=bins)
    kept = counts >= criteria.samples_per_bin
    safe = np.maximum(counts, 1)
    at = np.bincount(inside, weights=x, minlength=bins) / safe
    means = np.column_stack([np.bincount(inside, weights=c, minlength=bins) / safe for c in y.T])
    return at[kept], means[kept], counts[kept]


def _sentence(
    against: str,
    at: np.ndarray,
    seen_with_sigma: tuple[np.ndarray, np.ndarray],
    fitted: set[str],
    criteria: MapCriteria,
) -> str:
    """The shape that a map shows, if it shows one beyond the noise."""
    mean, sigma = seen_with_sigma
    if not np.all(sigma > 0):
        return ""
    weight = 1.0 / sigma
    power = float(np.sum((mean * weight) ** 2))
    if special.chdtrc(len(at), power) > criteria.level:
        return ""
    scale = float(np.abs(at).max()) or 1.0
    pictures = [
        (name, picture)
        for name, kind in catalogue().items()
        for picture in kind.pictures
        if picture.against == against
    ]
    # The fit has taken out of the map what its own columns can explain: out of the shapes too.
    known = [one.of(at, scale) * weight for name, one in pictures if name in fitted]
    clear = _clearing(np.array(known).T) if known else np.eye(len(at))
    seen = clear @ (mean * weight)
    best, share = "", 0.0
    for name, picture in pictures:
        if name in fitted:
            continue
        column = clear @ (picture.of(at, scale) * weight)
        norm = float(column @ column)
        explained = float(column @ seen) ** 2 / (norm * power) if norm > 0 else 0.0
        if explained > share:
            best, share = picture.words, explained
    return f"{best} ({100 * share:.0f} % of what is seen here)" if share >= criteria.share else ""


def _clearing(columns: np.ndarray) -> np.ndarray:
    """Projection onto what columns (B, k) cannot explain, (B, B)."""
    basis = np.linalg.qr(columns)[0]
    return np.eye(len(columns)) - basis @ basis.T


def _spectrum(
    robot: Robot,
    j: int,
    before: HeldOut,
    residuals: tuple[np.ndarray, np.ndarray],
    criteria: MapCriteria,
) -> ResidualMap:
    """Amplitudes of the residuals before and after by cycles per revolution, over certain rows."""
    harmonics = np.arange(1, criteria.harmonics + 1)
    q = np.concatenate([run.q[run.certain[:, j], j] for run in before.runs])
    noise = None if before.noise_std is None else float(before.noise_std[j])
    waves = np.exp(-1j * np.outer(harmonics, q))
    amplitudes = [2.0 * np.abs(waves @ (e - e.mean())) / len(q) for e in residuals]
    size = len(harmonics)
    level = np.full(size, np.nan)
    sentence = ""
    if noise is not None:
        # Each amplitude is Rayleigh: one in a thousand of all lines exceeds this by chance.
        level[:] = noise * np.sqrt(
            4.0 * np.log(size / criteria.level) * before.inflation[j] / len(q)
        )
        peak = int(np.argmax(amplitudes[0]))
        others = np.delete(amplitudes[0], [i for i in (peak - 1, peak, peak + 1) if 0 <= i < size])
        stands_out = amplitudes[0][peak] > max(
            level[peak], criteria.line * float(np.median(others))
        )
        if stands_out and harmonics[peak] >= criteria.slowest_ripple:
            sentence = f"a line at {harmonics[peak]} cycles per revolution: ripple"
    unit = "cycles per revolution" if robot.kinds[j] == "revolute" else "cycles per 2 pi m"
    return ResidualMap(
        joint=robot.names[j],
        torque_unit=robot.torque_units[j],
        against="cycles per revolution",
        unit=unit,
        at=harmonics.astype(float),
        before=amplitudes[0],
        after=amplitudes[1],
        band=level,
        sentence=sentence,
    )
