"""Bursts: a few instants that hold most of what a model leaves.

Noise of a torque spreads what is left over the whole recording. A link that knocks against the
other side of its backlash, an end stop, a touch, or a sensor that drops out does not: a few
instants hold nearly all of it. The residual of a whole recording may be small in spite of them,
and recordings that judge may have none. So they are told, whatever the verdict.

Where a joint turns round, bursts are no evidence that something is missing: friction that reverses
more sharply than a tanh, or that sticks, leaves them there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from dynident.criteria import VerdictCriteria
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.model import Model, coulomb_levels
from dynident.tables import listed, percent

_BEYOND = 5.0
"""Size of a burst over the rms of all rows but the largest: normal noise is not so once in 1e6."""
_BOTH = 2.0  # of the level of dry friction, that a wrong direction makes at most
_GAP = 5
"""Rows between two parts of one burst, which a filter makes ring."""


def bursts_in(
    trained: HeldOut, joints: Sequence[str], units: Sequence[str], criteria: VerdictCriteria
) -> dict[str, str]:
    """Find the joints at which a few instants hold most of the residual.

    Parameters
    ----------
    trained : what a model leaves of the recordings that it was fitted to.
    joints, units : (n,) names of the joints, and the units of their torques.
    criteria : of the verdict: which share of the rows is a few, and which share of the square they
        must hold.

    Returns
    -------
    Of each such joint, by its name, the place and the height of its largest burst in words.
    """
    found = {}
    for j, (joint, unit) in enumerate(zip(joints, units, strict=True)):
        rows = np.concatenate([run.residual[run.certain[:, j], j] for run in trained.runs])
        few = int(criteria.few_rows * len(rows))
        square = np.sort(rows**2)[::-1]
        if not square[:few].sum() > criteria.held_by_few * square.sum():
            continue
        if not trained.joint_errors[j] > criteria.resolution:
            continue  # of differentiation and filters, which do worst at ends and reversals
        rest = float(np.sqrt(square[few:].mean()))
        bursts = [one for run in trained.runs for one in _bursts(run, j, _BEYOND * rest)]
        if not bursts or not rest > 0:
            continue
        size, where = max(bursts)
        many = "one burst" if len(bursts) == 1 else f"{len(bursts)} bursts"
        found[joint] = (
            f"at {joint} the {few} largest of {len(rows)} hold "
            f"{percent(square[:few].sum() / square.sum(), 0)} of it: {many}, the largest of "
            f"{size:.2g} {unit} at {where}, {size / rest:.0f} times the rms of all other rows"
        )
    return found


def beyond_reversals(trained: HeldOut, model: Model, values: np.ndarray) -> HeldOut:
    """Return the same without what dry friction may leave where joints turn round.

    Friction in the wrong direction leaves twice its level at most: what is larger counts, and so
    does all of a joint without dry friction.

    Parameters
    ----------
    trained : what a model leaves.
    model, values : (p,) that model, with its friction widths.
    """
    level, runs = coulomb_levels(model, values), []
    for run in trained.runs:
        turns = np.zeros(run.v.shape, dtype=bool)
        turns[1:] = run.v[1:] * run.v[:-1] < 0.0
        turns[:-1] |= turns[1:]
        slow = np.abs(run.v) < model.friction_widths
        near = maximum_filter1d(turns.astype(float), 2 * _GAP + 1, axis=0) > 0.0
        turning = turns | (slow & near)
        friction = turning & (np.abs(run.residual) <= _BOTH * level)
        runs.append(replace(run, certain=run.certain & ~friction))
    return replace(trained, runs=tuple(runs))


def burst_notes(found: Mapping[str, str], beyond: Collection[str]) -> tuple[str, ...]:
    """Return one note on all joints of `bursts_in`; none where there is no joint.

    Parameters
    ----------
    found : of all rows.
    beyond : joints with bursts in the rows of `beyond_reversals`.
    """
    if not found:
        return ()
    turning = [joint for joint in found if joint not in beyond]
    friction = ""
    if turning:
        friction = (
            f" At {listed(turning)} too few are left without those where the joint turns round, "
            "which dry friction may leave that reverses otherwise than the model's: no verdict "
            "rests on them."
        )
    return (
        "A few training rows hold most of the square of what the model leaves; "
        f"{'; '.join(found.values())}. Noise of one size is seldom like that. Backlash or a stop "
        "that the link knocks against is, a touch, friction at a reversal, a fault of the "
        f"recording, or one that is noisier than the others.{friction}",
    )


def _bursts(run: HeldOutRun, j: int, least: float) -> list[tuple[float, str]]:
    """Size, N m or N, and place of each stretch of rows above a size, across gaps of a few rows."""
    size = np.where(run.certain[:, j], np.abs(run.residual[:, j]), 0.0)
    above = np.flatnonzero(size > least)
    if not len(above):
        return []
    stretches = np.split(above, np.flatnonzero(np.diff(above) > _GAP) + 1)
    peaks = [rows[np.argmax(size[rows])] for rows in stretches]
    return [(float(size[k]), f"{run.t[k]:.2f} s of {run.name}") for k in peaks]
