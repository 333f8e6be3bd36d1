"""Periods that a study states against the time after which the motion does repeat."""

from __future__ import annotations

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.recording import Dataset, Recording, as_points, turning_round
from dynident.recording.repetition import repeats_after, shift_mismatch
from dynident.tables import percent
from dynident.wiring.fault import Fault

_WHOLE = 0.3
"""Samples by which a period may miss a whole number of them: references run on the clock."""


def wrong_periods(dataset: Dataset, criteria: WiringCriteria) -> tuple[Fault, ...]:
    """Recordings that repeat far better after another time than after the stated period.

    Parameters
    ----------
    dataset : the recordings.
    criteria : how much better.

    Returns
    -------
    A fault for each.
    """
    alike: dict[tuple[float, float], list[tuple[str, float, float]]] = {}
    for one in dataset.recordings:
        better = None if one.period is None else _better(one, one.period, criteria)
        if one.period is not None and better is not None:
            off, left, likely = better
            name = f"{one.name} (number {one.number})" if one.number else one.name
            alike.setdefault((one.period, float(f"{likely:.6g}")), []).append((name, off, left))
    return tuple(_fault(period, likely, cases) for (period, likely), cases in alike.items())


def _fault(period: float, likely: float, cases: list[tuple[str, float, float]]) -> Fault:
    """One fault of all recordings that have it alike."""
    names = ", ".join(name for name, _, _ in cases)
    off, left = max(case[1] for case in cases), max(case[2] for case in cases)
    return Fault(
        kind="period",
        joints=(),
        what=f"the period of {period:g} s is wrong in {names}",
        evidence=f"positions a period apart differ by {percent(off)} of the motion, and by "
        f"{percent(left)} after {likely:g} s",
        mend=(f"period = {likely!r}",),
        where="Write in these [[recordings]] entries",
    )


def _better(
    recording: Recording, period: float, criteria: WiringCriteria
) -> tuple[float, float, float] | None:
    """Mismatch at the period, the least one, and where that is (s); None where nothing is wrong."""
    positions = as_points(recording.q, turning_round(recording))
    q = positions - positions.mean(axis=0)
    q = q / np.maximum(np.std(q, axis=0), 1e-12)
    q = q[:, np.ptp(positions, axis=0) > 0]
    step = recording.duration / (recording.samples - 1)
    stated = period / step
    longest = recording.samples * 2 // 3
    if not q.shape[1] or recording.samples < 20 or round(stated) < 2:
        return None
    off = np.inf
    if stated <= longest:
        off = shift_mismatch(q, stated)
        if off < criteria.period_off:
            return None
    likely = repeats_after(q, longest)
    if likely is None:
        return None
    left = shift_mismatch(q, likely)
    multiple = stated / likely
    near = abs(stated - round(multiple) * likely) < 0.75 if round(multiple) else False
    if near or left * criteria.period_ratio > min(off, 1.0) or left > criteria.period_left:
        return None
    if abs(likely - round(likely)) < _WHOLE:
        likely = float(round(likely))
    return min(off, 1.0), left, likely * step
