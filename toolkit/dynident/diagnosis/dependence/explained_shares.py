"""What a regression predicts of a residual as it is given more inputs, one set after another.

Each set is added beside those before it, at the strength that does best on held-out units; what it
explains of a unit is judged at the strength that does best on all others. A share is the fall of
the held-out square over the square that could be explained, with its standard error over units. A
set whose share cannot be told from nothing is left out again: inputs of no use take nothing away.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from dynident.diagnosis.dependence import block_regression as regression
from dynident.diagnosis.dependence.joint_inputs import JointInputs
from dynident.diagnosis.dependence.motion_blocks import HeldOutUnit

INPUTS: dict[str, Callable[[JointInputs], np.ndarray]] = {
    "position and velocity": regression.of_state,
    "speeds of other joints": regression.of_speeds,
    "position errors": regression.of_position_errors,
    "acceleration and load": regression.of_acceleration,
    "past": regression.of_past,
    "other joints": regression.of_others,
    "time": regression.of_time,
}
"""Sets of inputs with their kernels."""
ORDER = (
    ("position and velocity",),
    ("position errors",),
    ("acceleration and load", "past"),
    ("acceleration and load", "past"),
    ("other joints",),
    ("time",),
)
"""Which sets may be added in each turn: of several the one that explains most. After a reversal the
way since then is nearly v^2 / 2a, so that either may stand in for the other, and badly."""
FIRST = ((1.0, 0.1), (1.0, 1.0)), ((1.0, 10.0), (1.0, 100.0))
NEXT = ((1.0, 0.1), (1.0, 1.0)), ((10.0, 1.0), (10.0, 10.0))
"""Factors on the strengths of earlier sets, and strengths of the first set and of others: variance
of what a set predicts over that of what nothing does. The second ones are tried where with one of
the first ones less is left, as it is by rough functions of what the residual depends on: what more
variance of the earlier sets alone explains is not credited to the next one."""
LEAST = 0.01
"""Share below which nothing is said: no law is sought for a hundredth of a residual."""
LEVEL = 0.05
"""Chance that of a residual that depends on nothing anything is said, over all sets."""


@dataclass(frozen=True)
class Share:
    """A share with its standard error over held-out units.

    Attributes
    ----------
    value, error : the share and its standard error.
    needed : standard errors from which it is told from nothing: Student's quantile for so many
        units, corrected for the number of sets; more than two.
    """

    value: float
    error: float
    needed: float

    @property
    def told(self) -> bool:
        """Whether it can be told from nothing, and is no trifle."""
        return self.value > max(self.needed * self.error, LEAST)

    def to_dict(self) -> dict[str, float]:
        """As JSON has it."""
        return {"share": self.value, "standard_error": self.error}


@dataclass(frozen=True, kw_only=True)
class ExplainedShares:
    """Shares of a residual.

    Attributes
    ----------
    by : what each set of inputs explains beside those before it that are told from nothing, in the
        order of their turns; sets of which there is none (other joints of a single one) are not in
        it. Negative where a regression predicts held-out units worse than none.
    rest : what is left by those that are told from nothing.
    units : over how many held-out units errors are taken.
    """

    by: dict[str, Share]
    rest: Share
    units: int


@dataclass(frozen=True, eq=False)
class _KernelFit:
    """A regression as far as it goes.

    Attributes
    ----------
    kernel : (T, T) of all sets that were added.
    losses : (U,) what it leaves of each unit, squares.
    """

    kernel: np.ndarray
    losses: np.ndarray


def explained_shares(
    x: JointInputs,
    residual: np.ndarray,
    noise: np.ndarray,
    units: Sequence[HeldOutUnit],
    order: Sequence[tuple[str, ...]] = ORDER,
) -> ExplainedShares | None:
    """Return how much of a residual each set of inputs explains, beside those before it.

    Parameters
    ----------
    x : inputs of the rows.
    residual : (T,) of a joint, N m or N.
    noise : (T,) mean square of the noise in it, which nothing explains; zeros where it is unknown:
        shares are then of everything.
    units : which rows are held out together.
    order : which sets may be added in each turn.

    Returns
    -------
    None where nothing is left beside the noise.
    """
    scale = float(np.sqrt(np.mean(residual**2)))
    if not scale > 0:
        return None
    y = residual / scale
    squares = _per_unit(y**2, units)
    could = squares - _per_unit(noise / scale**2, units)
    if not could.sum() > 0:
        return None
    asked = {name for turn in order for name in turn}
    made = {name: kernel_of(x) for name, kernel_of in INPUTS.items() if name in asked}
    kernels = {name: one for name, one in made.items() if one.any()}
    fitted, by, explained = (
        _KernelFit(np.zeros((len(y), len(y))), squares),
        {},
        np.zeros(len(units)),
    )
    tried: dict[str, tuple[_KernelFit, np.ndarray]] = {}  # beside what is fitted so far
    for turn in order:
        names = [name for name in turn if name in kernels and name not in by]
        if not names:
            continue
        for name in names:
            if name not in tried:
                tried[name] = _with(kernels[name], fitted, y, units)
        name = min(names, key=lambda one: tried[one][0].losses.sum())
        wider, fall = tried[name]
        by[name] = _share(fall, could)
        if by[name].told:
            fitted, explained, tried = wider, explained + fall, {}
    return ExplainedShares(by=by, rest=_share(could - explained, could), units=len(units))


def _with(
    kernel: np.ndarray, before: _KernelFit, y: np.ndarray, units: Sequence[HeldOutUnit]
) -> tuple[_KernelFit, np.ndarray]:
    """Add a set of inputs to a regression.

    Parameters
    ----------
    kernel : (T, T) of the set.
    before : the regression without it.
    y : (T,) what is to be predicted.
    units : which rows are held out together.

    Returns
    -------
    The regression with the set where that is better, and by how much it falls in each unit, (U,),
    at the strength that the other units choose.
    """
    tried, earlier = [before], before.kernel.any()
    for strengths in NEXT if earlier else FIRST:
        for factor, strength in strengths:
            more = strength * kernel
            if earlier:
                more += factor * before.kernel
            left = regression.left_of_each_unit(more, y, units)
            tried.append(_KernelFit(more, _per_unit(left**2, units)))
        if min(one.losses.sum() for one in tried[1:]) >= before.losses.sum():
            break
    losses = np.array([one.losses for one in tried])
    fall = before.losses - losses[_chosen_elsewhere(losses), np.arange(len(units))]
    return tried[_best(losses)], fall


def _per_unit(values: np.ndarray, units: Sequence[HeldOutUnit]) -> np.ndarray:
    return np.array([values[one.rows].sum() for one in units])


def _best(losses: np.ndarray) -> int:
    """Which regression (row of losses, by unit) does best; the first unless one is clearly better.

    Clearly: by more than the standard error of the difference.
    """
    best = int(np.argmin(losses.sum(axis=1)))
    gain = losses[0] - losses[best]
    error = np.sqrt(len(gain)) * np.std(gain, ddof=1)
    return best if gain.sum() > error else 0


def _chosen_elsewhere(losses: np.ndarray) -> np.ndarray:
    """For each unit the regression that does best on all others."""
    units = np.arange(losses.shape[1])
    return np.array([_best(losses[:, units != one]) for one in units])


def _share(part: np.ndarray, whole: np.ndarray) -> Share:
    """Ratio of two sums over units, with the error that their spread stands for."""
    many, total = len(whole), whole.sum()
    ratio = float(part.sum() / total)
    spread = np.sum((part - ratio * whole) ** 2) * many / (many - 1)
    needed = float(special.stdtrit(many - 1, 1.0 - LEVEL / len(INPUTS)))
    return Share(ratio, float(np.sqrt(spread) / total), needed)
