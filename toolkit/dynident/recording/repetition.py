"""After which time a motion repeats, by its correlation with itself, whole turns aside."""

from __future__ import annotations

import numpy as np

from dynident.recording.recording import Recording

TURN = 2 * np.pi
"""rad"""
_SAMPLES = 4000  # at which a motion is looked at first
_FAR = 0.3  # difference, of the motion's power, after which a return is no longer its start
_BACK = 0.05  # that a return may leave


def shift_mismatch(q: np.ndarray, lag: float) -> float:
    """Difference of a motion and itself some samples later, over the motion.

    Parameters
    ----------
    q : (T, n).
    lag : samples, not necessarily whole.

    Returns
    -------
    0 for an exact repetition; infinity where fewer than ten samples are left to compare.
    """
    whole = int(np.floor(lag))
    part = lag - whole
    count = len(q) - whole - 1
    if count < 10:
        return np.inf
    later = (1 - part) * q[whole : whole + count] + part * q[whole + 1 : whole + 1 + count]
    first = q[:count]
    power = float(np.sum(first**2) + np.sum(later**2))
    return float(np.sqrt(np.sum((later - first) ** 2) / max(power, 1e-300)))


def repeats_after(q: np.ndarray, longest: int) -> float | None:
    """Find after how many samples, not whole, a motion repeats best: the shortest such time.

    Parameters
    ----------
    q : (T, n), each column on one scale with the others and without its mean.
    longest : samples, the longest time that is looked at.

    Returns
    -------
    None where it does not repeat.
    """
    stride = max(1, len(q) // _SAMPLES)
    few = q[::stride]
    size = 2 * len(few)
    spectrum = np.abs(np.fft.rfft(few, size, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1), size)[: len(few)]
    power = np.sum(few**2, axis=1)
    both = np.cumsum(power)[::-1] + np.cumsum(power[::-1])[::-1]
    differs = np.maximum(both - 2 * correlation, 0.0) / np.maximum(both, 1e-300)
    left = int(np.argmax(differs > _FAR))
    lags = differs[left : longest // stride]
    if not left or not len(lags) or lags.min() > _BACK:
        return None
    good = lags <= max(4 * float(lags.min()), 1e-5)
    start = int(np.argmax(good))
    stop = start + (int(np.argmax(lags[start:] > _BACK)) or len(lags) - start)
    centre = (left + start + int(np.argmin(lags[start:stop]))) * stride
    around = np.arange(max(2, centre - 2 * stride), min(longest, centre + 2 * stride) + 1)
    off = np.array([shift_mismatch(q, float(lag)) for lag in around]) ** 2
    k = int(np.argmin(off))
    if not 0 < k < len(around) - 1:
        return float(around[k])
    bend = off[k - 1] - 2 * off[k] + off[k + 1]
    return float(around[k] + (0.5 * (off[k - 1] - off[k + 1]) / bend if bend > 0 else 0.0))


def turning_round(recording: Recording) -> np.ndarray:
    """Joints that turn without end, and go farther than once around, (n,) mask.

    Parameters
    ----------
    recording : which says which joints are continuous.
    """
    endless = np.isin(recording.joints, recording.continuous)
    if not endless.any():  # then no file need be gone through
        return endless
    return endless & (np.ptp(recording.q, axis=0) > TURN)


def as_points(q: np.ndarray, turning: np.ndarray) -> np.ndarray:
    """Return positions in which whole turns make no difference: points of a circle for angles.

    Parameters
    ----------
    q : (T, n) rad or m.
    turning : (n,) mask of the joints whose whole turns are to make none.

    Returns
    -------
    (T, n + k): the positions, those of the k joints as their cosines, and their sines after all.
    """
    if not turning.any():
        return q
    return np.hstack([np.where(turning, np.cos(q), q), np.sin(q[:, turning])])


def turns_between(folded: np.ndarray, turning: np.ndarray) -> np.ndarray:
    """Whole turns, in rad, that each repetition of a motion is ahead of the first one.

    Parameters
    ----------
    folded : (P, S, n) positions, see `Periods.fold`.
    turning : (n,) mask of the joints that turn on from one repetition to the next.

    Returns
    -------
    (P, 1, n), zero at the other joints.
    """
    ahead = (folded - folded[:1]).mean(axis=1, keepdims=True)
    return np.where(turning, TURN * np.round(ahead / TURN), 0.0)
