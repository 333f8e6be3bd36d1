"""Where the model fails: mean residuals against motion, load, time and position harmonics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import special

from dynident.criteria import DEFAULTS, Criteria, MapCriteria
from dynident.effects import ResidualPicture, catalogue
from dynident.evidence.held_out import HeldOut
from dynident.model import Model
from dynident.robot import Robot

_LEAST_BLOCKS = 4
"""Of time, below which nothing is said of a shape where the noise is unknown."""

Space = Literal["linear", "root"]
"""In what classes of a quantity are of equal width."""

SPECTRA = ("cycles per revolution", "cycles per metre")
"""What spectra are against: of revolute joints, and of prismatic ones."""


@dataclass(frozen=True, kw_only=True)
class ResidualMap:
    """Mean residual of one joint in bins of a quantity, on the test recordings.

    Attributes
    ----------
    joint, torque_unit : the joint, and N m or N.
    against : "velocity", "position", "acceleration", "load", "time" or one of `SPECTRA`.
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
    model: Model, before: HeldOut, after: HeldOut, criteria: Criteria = DEFAULTS
) -> tuple[ResidualMap, ...]:
    """Residual maps of every joint on held-out data.

    Parameters
    ----------
    model : as given: what its effects can fit is cleared away before a shape is named.
    before, after : of the model as given and of the final one, on the same recordings.
    criteria : when a map shows something, and what no processing resolves.

    Returns
    -------
    Maps joint by joint, each over what its sentence names.
    """
    joints = range(model.robot.n)
    return tuple(
        one for joint in joints for one in _of_joint(model, joint, before, after, criteria)
    )


def _of_joint(
    model: Model, j: int, before: HeldOut, after: HeldOut, whole: Criteria
) -> Iterator[ResidualMap]:
    robot, criteria = model.robot, whole.maps
    certain = np.concatenate([run.certain[:, j] for run in before.runs])
    if not certain.any():
        return
    old, new = (
        np.concatenate([run.residual[:, j] for run in one.runs])[certain] for one in (before, after)
    )
    motion = robot.units[j]
    noise = None if before.noise_std is None else float(before.noise_std[j])
    blocks = _blocks(before)[certain]
    small = before.residual_rms[j] <= whole.verdict.resolution * before.torque_rms[j]
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
        rows = None if noise is not None else (x, old, blocks)
        seen = _Seen(at=at, mean=means[:, 0], sigma=sigma, rows=rows)
        sentence = "" if small else _sentence(_shapes(model, j, against), seen, criteria)
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


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """What a map shows.

    Attributes
    ----------
    at, mean, sigma : (B,) centres of the classes, mean residuals and their standard errors.
    rows : the quantity, the residual and the block of time of each row, (T,) each, where the noise
        is unknown: whether a shape is chance is then asked of the blocks. None where it is known.
    """

    at: np.ndarray
    mean: np.ndarray
    sigma: np.ndarray
    rows: tuple[np.ndarray, np.ndarray, np.ndarray] | None


@dataclass(frozen=True, kw_only=True)
class _Shape:
    """A shape by which an effect at a joint is recognised.

    Attributes
    ----------
    picture : of the effect.
    fitted : whether the model has the effect.
    positive : whether no value below zero is possible: the shape upside down is not its.
    """

    picture: ResidualPicture
    fitted: bool
    positive: bool


def _shapes(model: Model, joint: int, against: str) -> tuple[_Shape, ...]:
    """Shapes that effects at a joint make in a map against one quantity."""
    robot = model.robot
    name = robot.names[joint]
    fitted = {e.name for e in model.effects if e.joint == name}
    found = []
    for kind in catalogue().values():
        pictures = [one for one in kind.pictures if one.against == against]
        here = [one for one in kind.candidates(robot) if one.joint == name] if pictures else []
        bounds = [p.lower for one in here[:1] for p in one.parameters(robot)]
        positive = bool(bounds) and min(bounds) >= 0.0
        known = any(one.name in fitted for one in here)
        found += [_Shape(picture=one, fitted=known, positive=positive) for one in pictures]
    return tuple(found)


def _sentence(shapes: Sequence[_Shape], seen: _Seen, criteria: MapCriteria) -> str:
    """The shape that a map shows, if it shows one beyond the noise."""
    at, mean, sigma = seen.at, seen.mean, seen.sigma
    if not np.all(sigma > 0):
        return ""
    weight = 1.0 / sigma
    power = float(np.sum((mean * weight) ** 2))
    if special.chdtrc(len(at), power) > criteria.level:
        return ""
    scale = float(np.abs(at).max()) or 1.0
    # The fit has taken out of the map what its own columns can explain: out of the shapes too.
    known = [one.picture for one in shapes if one.fitted]
    clear = _clearing([one.of(at, scale) * weight for one in known], len(at))
    left = clear @ (mean * weight)
    asked = [one for one in shapes if not one.fitted]
    best, share = None, 0.0
    for one in asked:
        column = clear @ (one.picture.of(at, scale) * weight)
        norm, along = float(column @ column), float(column @ left)
        explained = along**2 / (norm * power) if norm > 0 else 0.0
        if explained > share and (along > 0 or not one.positive):
            best, share = one.picture, explained
    if best is None or share < criteria.share:
        return ""
    if seen.rows is not None:
        x, residual, blocks = seen.rows
        column = best.of(x, scale)
        if known:
            basis = np.linalg.qr(np.array([one.of(x, scale) for one in known]).T)[0]
            column = column - basis @ (basis.T @ column)
        if _chance(column, residual, blocks) * len(asked) > criteria.level:
            return ""
    return f"{best.words} ({100 * share:.0f} % of what is seen here)"


def _chance(column: np.ndarray, residual: np.ndarray, blocks: np.ndarray) -> float:
    """P value of a column's part in a residual, with blocks of time as the sampling units.

    Neighbours may go on in each other, as Newey and West have it (Econometrica 55, 1987), which
    counts where it makes the part less certain.
    """
    _, number = np.unique(blocks, return_inverse=True)
    count, norm = int(number.max()) + 1, float(column @ column)
    if count < _LEAST_BLOCKS or not norm > 0:
        return 1.0
    part = float(column @ residual) / norm
    scores = np.bincount(number, weights=column * (residual - part * column))
    spread = float(scores @ scores) + max(float(scores @ np.roll(scores, 1)), 0.0)
    if not spread > 0:
        return 0.0
    t = part * norm / np.sqrt(spread * count / (count - 1))
    return float(2.0 * special.stdtr(count - 1, -abs(t)))


def _blocks(judged: HeldOut) -> np.ndarray:
    """Block of time of each row, numbered over all runs; a run that is not cut is one block."""
    found, first = [], 0
    for run in judged.runs:
        own = np.zeros(len(run.t), dtype=int) if run.block is None else run.block
        found.append(own + first)
        first += int(own.max(initial=0)) + 1
    return np.concatenate(found)


def _clearing(columns: Sequence[np.ndarray], count: int) -> np.ndarray:
    """Projection onto what columns (B,) cannot explain, (B, B)."""
    if not columns:
        return np.eye(count)
    basis = np.linalg.qr(np.array(columns).T)[0]
    return np.eye(count) - basis @ basis.T


def _spectrum(
    robot: Robot,
    j: int,
    before: HeldOut,
    residuals: tuple[np.ndarray, np.ndarray],
    criteria: MapCriteria,
) -> ResidualMap:
    """Amplitudes of the residuals before and after by cycles of position, over certain rows.

    In a turn, or over the travel of a prismatic joint: what comes fewer times is no line there.
    """
    harmonics = np.arange(1, criteria.harmonics + 1)
    q = np.concatenate([run.q[run.certain[:, j], j] for run in before.runs])
    against, once, slowest = SPECTRA[0], 2.0 * np.pi, criteria.slowest_ripple
    if robot.kinds[j] == "prismatic" and len(q) and np.ptp(q) > 0:
        against, once, slowest = SPECTRA[1], float(np.ptp(q)), criteria.slowest_on_a_slide
    at = harmonics if against == SPECTRA[0] else harmonics / once
    noise = None if before.noise_std is None else float(before.noise_std[j])
    waves = np.exp(-2j * np.pi / once * np.outer(harmonics, q))
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
        if stands_out and harmonics[peak] >= slowest:
            sentence = f"a line at {at[peak]:.3g} {against}: ripple"
    return ResidualMap(
        joint=robot.names[j],
        torque_unit=robot.torque_units[j],
        against=against,
        unit=against,
        at=at.astype(float),
        before=amplitudes[0],
        after=amplitudes[1],
        band=level,
        sentence=sentence,
    )
