"""Lines in the spectrum of a residual over positions: shapes between those of a grid.

Over a travel L two waves of the position can be told apart where their phases per metre differ by
about pi / L. A grid that is as dense as that over every travel would cost more than all other
candidates; a spectrum over the positions costs next to nothing and says where a line may be. What
it names is then judged as any shape is, and every line that it could have named counts as tried.
"""

from __future__ import annotations

import math

import numpy as np

from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.model_columns import joint_columns

_HIGHEST = 12
"""Lines that are named: the highest, since unlike the fit a spectrum does not weight the rows."""
_BINS = 8
"""Bins of position in the shortest wave: what lies in one is out of phase by 45 degrees at most."""
_BETWEEN = 4
"""Values of the spectrum for each line that can be told from its neighbours."""
_LONGEST = 250.0
"""Travel in m beyond which no spectrum is taken: it would fill the memory, and a length that long
is more likely one in mm."""


def line_width(evidence: Evidence, effect: Effect) -> float | None:
    """Return by how much lines must differ to be told apart, in units of an effect's shape.

    Parameters
    ----------
    evidence : the recordings.
    effect : at a joint.

    Returns
    -------
    pi over the travel of its joint; None where no spectrum is taken for such an effect.
    """
    if not effect.line_over_position(evidence.model.robot):
        return None
    q = _positions(evidence, _joint(evidence, effect))
    travel = float(np.ptp(np.concatenate([one.ravel() for one in q])))
    return math.pi / travel if 0 < travel <= _LONGEST else None


def shapes_tried(evidence: Evidence, effect: Effect) -> int:
    """Return how many shapes of an effect count as tried: of its grid, or lines in its range."""
    robot = evidence.model.robot
    variants = sum(1 for _ in effect.variants(robot))
    width = line_width(evidence, effect)
    if width is None:
        return variants
    grid = effect.shape_parameters(robot)[0].grid
    return max(variants, math.ceil((grid[-1] - grid[0]) / width))


def lines(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> tuple[Effect, ...]:
    """Return an effect with the shapes at which the spectrum of the residual is highest.

    Parameters
    ----------
    evidence, fitted : the recordings, and the model as it fits them.
    effect : at a joint, with any shape.

    Returns
    -------
    Highest first; none for effects whose grid is near enough to every line.
    """
    robot, width = evidence.model.robot, line_width(evidence, effect)
    if width is None:
        return ()
    grid = effect.shape_parameters(robot)[0].grid
    if width >= np.diff(grid).max():
        return ()
    at, power = _spectrum(evidence, fitted, _joint(evidence, effect), grid[-1], width)
    seen = at >= grid[0]
    at, power = at[seen], power[seen]
    inner = power[1:-1]
    peaks = 1 + np.flatnonzero((inner > power[:-2]) & (inner >= power[2:]))
    highest = peaks[np.argsort(-power[peaks], kind="stable")][:_HIGHEST]
    return tuple(effect.shaped(float(at[one])) for one in highest)


def _spectrum(
    evidence: Evidence, fitted: EvidenceFit, joint: int, highest: float, width: float
) -> tuple[np.ndarray, np.ndarray]:
    """Phases per unit of position, and the power of the residual at them."""
    combination = np.append(-fitted.values, 1.0)
    q = np.concatenate([one.ravel() for one in _positions(evidence, joint)])
    left = []
    for r, run in enumerate(evidence.runs):
        columns = joint_columns(evidence, fitted.model, r, joint, fitted.values)
        residual = run.fold([one.times(combination) for one in columns])
        left.append((residual * run.certain(joint)).ravel())
    e = np.concatenate(left)
    bins = math.ceil(_BINS * highest * float(np.ptp(q)) / (2.0 * math.pi)) + 1
    size = float(np.ptp(q)) / (bins - 1)
    number = np.rint((q - q.min()) / size).astype(int)
    along = np.bincount(number, weights=e - e.mean(), minlength=bins)
    length = max(bins, math.ceil(2.0 * math.pi * _BETWEEN / (width * size)))
    power = np.abs(np.fft.rfft(along, length)) ** 2
    at = 2.0 * math.pi * np.arange(len(power)) / (length * size)
    within = at <= highest
    return at[within], power[within]


def _positions(evidence: Evidence, joint: int) -> list[np.ndarray]:
    """Positions of a joint (P, S) in each run, where its residuals are."""
    return [run.fold([one.q[:, joint] for one in run.replicates]) for run in evidence.runs]


def _joint(evidence: Evidence, effect: Effect) -> int:
    return evidence.model.robot.names.index(str(effect.joint))
