"""Periods that a study states against the time after which the motion does repeat."""

from __future__ import annotations

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.recording import Dataset, Recording
from dynident.tables import percent
from dynident.wiring.fault import Fault

_SAMPLES = 4000  # at which a motion is looked at first
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
    q = recording.q - recording.q.mean(axis=0)
    q = q / np.maximum(np.std(q, axis=0), 1e-12)
    q = q[:, np.ptp(recording.q, axis=0) > 0]
    step = recording.duration / (recording.samples - 1)
    stated = period / step
    longest = recording.samples * 2 // 3
    if not q.shape[1] or recording.samples < 20 or round(stated) < 2:
        return None
    off = np.inf
    if stated <= longest:
        off = _mismatch(q, stated)
        if off < criteria.period_off:
            return None
    likely = _repeats_after(q, longest)
    if likely is None:
        return None
    left = _mismatch(q, likely)
    multiple = stated / likely
    near = abs(stated - round(multiple) * likely) < 0.75 if round(multiple) else False
    if near or left * criteria.period_ratio > min(off, 1.0) or left > criteria.period_left:
        return None
    if abs(likely - round(likely)) < _WHOLE:
        likely = float(round(likely))
    return min(off, 1.0), left, likely * step


def _mismatch(q: np.ndarray, lag: float) -> float:
    """Difference of a motion (T, n) and itself `lag` samples later, over the motion."""
    whole = int(np.floor(lag))
    part = lag - whole
    count = len(q) - whole - 1
    if count < 10:
        return np.inf
    later = (1 - part) * q[whole : whole + count] + part * q[whole + 1 : whole + 1 + count]
    first = q[:count]
    power = float(np.sum(first**2) + np.sum(later**2))
    return float(np.sqrt(np.sum((later - first) ** 2) / max(power, 1e-300)))


def _repeats_after(q: np.ndarray, longest: int) -> float | None:
    """Samples, not whole, after which a motion repeats best: the shortest such time."""
    stride = max(1, len(q) // _SAMPLES)
    few = q[::stride]
    size = 2 * len(few)
    spectrum = np.abs(np.fft.rfft(few, size, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1), size)[: len(few)]
    power = np.sum(few**2, axis=1)
    both = np.cumsum(power)[::-1] + np.cumsum(power[::-1])[::-1]
    differs = np.maximum(both - 2 * correlation, 0.0) / np.maximum(both, 1e-300)
    left = int(np.argmax(differs > 0.3))
    lags = differs[left : longest // stride]
    if not left or not len(lags) or lags.min() > 0.05:
        return None
    good = lags <= max(4 * float(lags.min()), 1e-5)
    start = int(np.argmax(good))
    stop = start + (int(np.argmax(lags[start:] > 0.05)) or len(lags) - start)
    centre = (left + start + int(np.argmin(lags[start:stop]))) * stride
    around = np.arange(max(2, centre - 2 * stride), min(longest, centre + 2 * stride) + 1)
    off = np.array([_mismatch(q, float(lag)) for lag in around]) ** 2
    k = int(np.argmin(off))
    if not 0 < k < len(around) - 1:
        return float(around[k])
    bend = off[k - 1] - 2 * off[k] + off[k + 1]
    return float(around[k] + (0.5 * (off[k - 1] - off[k + 1]) / bend if bend > 0 else 0.0))
