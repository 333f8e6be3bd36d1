"""By how much the held-out error falls from one model to another, and how sure that is.

Both models are judged on the same rows, and what is hard to predict is so for both: their errors
are paired, block of time by block of time, and the standard error is that of the difference.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.diagnosis.details import JointFall
from dynident.evidence.held_out import HeldOut


def fall_standard_error(
    before: HeldOut, after: HeldOut, together: int, joints: Sequence[int] | None = None
) -> float | None:
    """Return the standard error of the fall `before.error - after.error`.

    By the jackknife over blocks of time, neighbours left out together, as what is left of one goes
    on in the next (H. R. Kuensch, "The jackknife and the bootstrap for general stationary
    observations", Annals of Statistics 17 (1989)). It is the scatter over the blocks judged: how
    uncertain the fits are, and that an effect was chosen among many, is no part of it.

    Parameters
    ----------
    before, after : two models on the same rows.
    together : consecutive blocks that are left out at a time.
    joints : those whose error it is; by default all.

    Returns
    -------
    Of the relative torque error, as `HeldOut.error`; None with fewer blocks than two such lots.
    """
    chosen = slice(None) if joints is None else list(joints)
    rows, torque, old = (one[:, chosen] for one in _sums(before))
    new = _sums(after)[2][:, chosen]
    count = len(rows)
    if count < max(2 * together, 3):
        return None
    left = np.maximum(_without(rows, together), 1)
    each = (np.sum(_without(one, together) / left, axis=1) for one in (torque, old, new))
    whole, given, wider = each
    if not np.all(whole > 0):
        return None
    falls = np.sqrt(given / whole) - np.sqrt(wider / whole)
    return float(np.sqrt((count - together) / together * np.var(falls)))


def largest_fall(
    names: Sequence[str], before: HeldOut, after: HeldOut, together: int
) -> JointFall | None:
    """Return that of the joint whose own error falls by the largest part; None where none falls.

    Of those where it is large, if there are any: a joint of few rows may fall far by chance.

    Parameters
    ----------
    names : of the joints.
    before, after, together : as for `fall_standard_error`.
    """
    old, new = before.joint_errors, after.joint_errors
    falls = np.nan_to_num((old - new) / np.where(old > 0, old, np.nan))
    found = (joint_fall(names, int(k), before, after, together) for k in np.argsort(-falls))
    every = [one for one in found if one.after < one.before]
    return max(every, key=lambda one: one.is_large, default=None)


def joint_fall(
    names: Sequence[str], joint: int, before: HeldOut, after: HeldOut, together: int
) -> JointFall:
    """Return what becomes of the error of one joint.

    Parameters
    ----------
    names, before, after, together : as for `largest_fall`.
    joint : its number.
    """
    return JointFall(
        joint=names[joint],
        before=float(before.joint_errors[joint]),
        after=float(after.joint_errors[joint]),
        standard_error=fall_standard_error(before, after, together, [joint]),
    )


def _without(summed: np.ndarray, together: int) -> np.ndarray:
    """Sums over all blocks but a lot of consecutive ones, from each block on, (B, n)."""
    lots = np.sum([np.roll(summed, -k, axis=0) for k in range(together)], axis=0)
    return summed.sum(axis=0) - lots


def _sums(judged: HeldOut) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows that count, and squares of torque and residual over them, in each block, (B, n) each."""
    found = []
    for run in judged.runs:
        if run.block is None:
            continue
        squares = (np.ones_like(run.measured), run.measured**2, run.residual**2)
        counted = [np.where(run.certain, one, 0.0) for one in squares]
        blocks, places = np.unique(run.block, return_inverse=True)
        columns = np.concatenate(counted, axis=1).T
        found.append([np.bincount(places, column, len(blocks)) for column in columns])
    n = judged.runs[0].measured.shape[1]
    every = np.concatenate(found, axis=1) if found else np.zeros((3 * n, 0))
    rows, torque, left = np.swapaxes(every.reshape(3, n, -1), 1, 2)
    kept = rows.any(axis=1)
    return rows[kept], torque[kept], left[kept]
