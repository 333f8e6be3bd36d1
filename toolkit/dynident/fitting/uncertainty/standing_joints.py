"""Joints that stand: rows in which dry friction is whatever the other torques ask for.

A joint is seen to stand if its speed stays within its noise for longer than it takes to pass
through zero. Around a stop no function of the speed tells its friction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dynident.criteria import StickingCriteria
from dynident.fitting.sampling import Sampled
from dynident.recording.filters import butterworth
from dynident.recording.sections import response
from dynident.recording.white_noise import encoder_noise_std

_FREQUENCIES = 4096  # at which a filter's response is taken


def all_samples(sampled: Sampled) -> Sampled:
    """A recording with all its samples: a stop may be over in a few."""
    return sampled.unthinned or sampled


def speeds(sampled: Sampled) -> np.ndarray:
    """Speeds in all samples of a recording, (T, n) rad/s or m/s."""
    source = all_samples(sampled).source
    return source.part(slice(0, source.samples)).v


def used_samples(sampled: Sampled) -> slice:
    """Samples of a recording from the first to the last row that is used."""
    recorded = all_samples(sampled)
    rows = recorded.parallel.rows(recorded.source.samples)[sampled.kept]
    return slice(int(rows[0]), int(rows[-1]) + 1)


def speed_noise(sampled: Sampled) -> np.ndarray:
    """Standard deviation of the noise in a recording's speed, (n,) rad/s or m/s.

    White noise of the encoders, through the low-pass of the positions and the central difference.
    """
    rate = sampled.recording.rate_hz
    angle = np.linspace(0.0, np.pi, _FREQUENCIES)
    gain = np.sin(angle) * rate
    cutoff = sampled.parallel.filter.position_cutoff_hz
    if cutoff:
        gain = gain * np.abs(response(butterworth(rate, cutoff), angle)) ** 2
    share = float(np.sqrt(np.trapezoid(gain**2, angle) / np.pi))
    return encoder_noise_std(sampled.recording.q) * share


def is_seen_to_stand(moved: Sequence[tuple[np.ndarray, float]], criteria: StickingCriteria) -> bool:
    """Whether a joint is seen to stand at many of its stops; a rest at an end is none of them.

    Counted in samples, a passage may last one longer within a band than it does, and one shorter on
    either side of it: a joint that passes from one sample to the next is not seen to stand.

    Parameters
    ----------
    moved : for each recording, the speeds (T,) of the joint in the samples used, and their noise.
    criteria : what is standing, and at how many stops.
    """
    stops = [stop for v, noise in moved for stop in _stops(v, criteria.noise * noise)]
    longer = sum(within - 1 > criteria.longer * (around + 2) for within, around in stops)
    return longer >= max(criteria.stops, criteria.stops_share * len(stops))


def near_stops(
    sampled: Sampled,
    v: np.ndarray,
    noise: float,
    criteria: StickingCriteria,
    least: float = 0.0,
) -> np.ndarray:
    """Return the rows of a joint around its stops.

    Parameters
    ----------
    sampled : the recording.
    v : speeds of the joint in all samples, from `speeds`.
    noise : of these, rad/s or m/s.
    criteria : how far around.
    least : speed within which its friction is not known, where that is more than the noise.

    Returns
    -------
    (T,) mask of the rows that are used.
    """
    # Around a reversal the speed is off by what the position's low-pass rounds.
    rounded = criteria.rounded * float(np.sqrt(np.mean(v[used_samples(sampled)] ** 2)))
    reach = max(criteria.noise * noise, rounded, least)
    near = all_samples(sampled).parallel.apply((np.abs(v) < reach).astype(float))
    return np.abs(near[sampled.kept]) > criteria.spread


def rows_that_tell(
    samples: Sequence[Sampled], criteria: StickingCriteria
) -> tuple[np.ndarray, ...]:
    """Rows of each joint that are not around a stop of one that stands.

    Parameters
    ----------
    samples : the recordings.
    criteria : what is standing; a joint of which too few rows would be left keeps all.

    Returns
    -------
    (T, n) mask for each recording.
    """
    moved = [(speeds(one), speed_noise(one)) for one in samples]
    found = [
        np.ones((one.count, v.shape[1]), dtype=bool)
        for one, (v, _) in zip(samples, moved, strict=True)
    ]
    for j in range(moved[0][0].shape[1] if moved else 0):
        own = [
            (v[used_samples(one), j], float(noise[j]))
            for one, (v, noise) in zip(samples, moved, strict=True)
        ]
        if not is_seen_to_stand(own, criteria):
            continue
        near = [
            near_stops(one, v[:, j], float(noise[j]), criteria)
            for one, (v, noise) in zip(samples, moved, strict=True)
        ]
        if np.mean(np.concatenate(near)) <= criteria.most:
            for mask, gone in zip(found, near, strict=True):
                mask[:, j] &= ~gone
    return tuple(found)


def _stops(v: np.ndarray, reach: float) -> Iterator[tuple[int, int]]:
    """Samples of each stop within a speed, and between that and three times as much.

    Only of stops before which and after which the joint moves.
    """
    wide, narrow = np.abs(v) < 3.0 * reach, np.abs(v) < reach
    edges = np.diff(np.concatenate([[0], wide.astype(int), [0]]))
    for start, stop in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        within = int(np.count_nonzero(narrow[start:stop]))
        if within and start > 0 and stop < len(v):
            yield within, int(stop - start) - within
