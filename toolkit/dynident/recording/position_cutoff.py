"""The low-pass of the positions that does least harm to their speeds, and differences without one.

What it lets through of the encoders' noise is in every row. What it takes away is missing where dry
friction turns round: there the acceleration jumps, behind a low-pass the speed passes through zero
smoothly and at another time, and friction of a wrong sign is the larger error of a fine encoder.

Where positions pass no low-pass the order of the differences is what is chosen. Differences of
second order make every acceleration too small, those of a higher one let more noise through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import ceil

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.derivatives import ORDERS, central_difference, difference_gain
from dynident.recording.filters import (
    Filter,
    butterworth,
    default_filter,
    default_position_cutoff,
    lowpass,
)
from dynident.recording.low_pass.sections import response
from dynident.recording.plausibility import resolution
from dynident.recording.recording import Recording
from dynident.recording.uniform import uniform
from dynident.recording.white_noise import encoder_noise_std

_FREQUENCIES = 4096  # at which a filter's response is taken
_WIDER = (1.0, 2.0, 4.0, 8.0)
"""Cut-offs that are tried, over the usual one. Columns and torque pass a far lower low-pass of
their own, so that beyond these little is gained."""
_OF_RATE = 0.404
"""Of the sampling rate, the highest cut-off; a hundredth more, for clocks that are rounded. From a
quarter of the rate on differences of eighth order fall short of a derivative, too: `SpeedGain` has
what both leave."""
_JUMP = 0.5
"""Jump of the acceleration where dry friction turns round, of its root mean square: with less the
noise counts more, which is in every row."""
_HIDES = 0.7
"""Times the cut-off that suits recordings, below which a filter hides motion that it need not."""
_EVERY = 1, 2, 4
"""Samples that noise lasts: what a drive has filtered before it was recorded is seen in every
k-th alone, and has that much less of the band that differences magnify."""
_ALIKE = 1.05  # largest over smallest of the rates that recordings are decimated to
_PARTS, _LENGTH = 16, 4096
"""Parts of a recording that are looked at, spread over it, and samples of each at most."""
_LEAST = 400  # samples of a part that is looked at
_LEAST_RAW = 60  # the same where only the order of differences is chosen
_MOVES = 20.0  # range of a joint that moves over the noise of its positions
_NOISE_RATE = 5.0
"""Rate down to which noise is looked for, over the usual cut-off."""
BIAS = 0.3
"""Share of the bias by noise that a fit cannot foretell. It foretells none by short differences."""
_TURN = np.linspace(0.0, np.pi, _FREQUENCIES)[1:]
"""Angles per sample at which a filter's response is taken, rad."""
DIGITS = 1e-12
"""Of a position's size, that its low-pass keeps: some joints stand exactly."""


@dataclass(frozen=True)
class SpeedGain:
    """What low-pass and central difference make of positions.

    Attributes
    ----------
    rate_hz : of the samples.
    filter : its `position_cutoff_hz` and `order` are used here.
    """

    rate_hz: float
    filter: Filter

    @cached_property
    def noise(self) -> float:
        """Noise of the speed over white noise of the positions, 1/s."""
        angle, gain = self._gain
        return self.rate_hz * float(np.sqrt(np.trapezoid(gain**2, angle) / np.pi))

    @cached_property
    def rounding(self) -> float:
        """Speed that is made up where the acceleration jumps, over that jump, s.

        Of positions that rise as k^2 / 2 from a sample k = 0 on they make there the sum of half k^2
        times their response, over samples before: a quarter by differences of second order alone.
        """
        angle, gain = self._gain
        more = (np.sin(angle) - gain) / (np.tan(angle / 2.0) * np.sin(angle / 2.0) ** 2)
        return float((0.25 + np.trapezoid(more, angle) / (8.0 * np.pi)) / self.rate_hz)

    @cached_property
    def _gain(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles up to pi, and there the gain from positions to speeds, per sample."""
        gain, cutoff = difference_gain(_TURN, self.filter.order), self.filter.position_cutoff_hz
        if cutoff:
            gain = gain * np.abs(response(butterworth(self.rate_hz, cutoff), _TURN)) ** 2
        return _TURN, gain


def usual_position_cutoffs(rate_hz: float, cutoff_hz: float | None) -> tuple[float, ...]:
    """Return the cut-offs of the positions' low-pass, in Hz, that one is chosen from.

    Parameters
    ----------
    rate_hz : of the samples.
    cutoff_hz : of columns and torque; without one noise far above the motion stays in every row,
        and only the lowest is asked for.
    """
    usual = default_position_cutoff(rate_hz, cutoff_hz)
    highest = _OF_RATE * rate_hz if cutoff_hz else usual
    return usual, *(k * usual for k in _WIDER[1:] if k * usual <= highest)


def suited_position_cutoff(recordings: Sequence[Recording], cutoff_hz: float | None) -> float:
    """Return the cut-off of the positions' low-pass, in Hz, that suits recordings.

    Parameters
    ----------
    recordings : one or more, that are to have the same one.
    cutoff_hz : of columns and torque, if there is one.

    Returns
    -------
    Of `usual_position_cutoffs` at the lowest of their rates that which makes the error of speeds
    smallest, noise and what is made up where friction turns round: in the geometric mean over
    joints, while they move.
    """
    tried = usual_position_cutoffs(min(one.rate_hz for one in recordings), cutoff_hz)
    if len(tried) == 1:
        return tried[0]
    try:
        errors = [_errors(q, one.rate_hz, tried) for one in recordings for q in _parts(one, _LEAST)]
    except RecordingError:  # which whoever samples the recording will tell, with its place
        return tried[0]
    return tried[int(np.argmin(np.sum(errors, axis=0)))] if errors else tried[0]


def common_filter(recordings: Sequence[Recording]) -> Filter | None:
    """Return the one filter for the recordings of a study that states none.

    Parameters
    ----------
    recordings : all of them.

    Returns
    -------
    As of `suited_filter`; None where their rates call for different ones.
    """
    usual = [default_filter(one.rate_hz).rate_hz or 0.0 for one in recordings]
    return suited_filter(recordings) if max(usual) <= _ALIKE * min(usual) else None


def suited_instead(cutoff_hz: float, recordings: Sequence[Recording]) -> float | None:
    """Return the cut-off that suits recordings, where another one hides motion that it need not.

    Parameters
    ----------
    cutoff_hz : of the low-pass of the positions.
    recordings : that it filters.

    Returns
    -------
    In Hz; None where the other is not far below it.
    """
    suited = suited_filter([uniform(one) for one in recordings]).position_cutoff_hz
    return suited if suited and cutoff_hz < _HIDES * suited else None


def suited_filter(recordings: Sequence[Recording]) -> Filter:
    """Return the filter that suits recordings.

    Parameters
    ----------
    recordings : one or more, that are to have the same one.

    Returns
    -------
    `default_filter` at the lowest of their rates, with positions low-passed as suits them.
    """
    usual = default_filter(min(one.rate_hz for one in recordings))
    return replace(usual, position_cutoff_hz=suited_position_cutoff(recordings, usual.cutoff_hz))


def with_suited_order(
    filter: Filter, recordings: Sequence[Recording], bias: float = BIAS
) -> Filter:
    """Return the filter with the order of its differences, where it leaves both to be chosen.

    Parameters
    ----------
    filter : one that has an order, filters positions, or keeps the ends, as published recipes do,
        comes back as it is; and so it does where recordings are too short to tell.
    recordings : all that pass it.
    bias : share that counts of what noise of the accelerations takes off an inertia. The default is
        that of least squares, which is not foretold (`fitting.uncertainty`); instruments have none.

    Returns
    -------
    With the order that makes errors of inertias smallest, in the mean over joints, while they move:
    what differences fall short, the bias, and what noise scatters.
    """
    stated = filter.difference_order or filter.suited_order or filter.position_cutoff_hz
    if stated or filter.ends == "keep":
        return filter
    some = recordings[:: 1 + len(recordings) // _PARTS]
    samples = sum(one.samples for one in recordings)
    try:
        every = [(q, one) for one in some for q in _parts(one, _LEAST_RAW)]
        found = [_order_errors(q, one.rate_hz, filter.cutoff_hz) for q, one in every]
    except RecordingError:  # which whoever samples the recording will tell, with its place
        return filter
    if not found:
        return filter
    errors = [
        one.samples * np.sqrt((short + bias * noise) ** 2 + noise / samples).sum(axis=1)
        for (_, one), (short, noise) in zip(every, found, strict=True)
    ]
    return replace(filter, suited_order=ORDERS[int(np.argmin(np.sum(errors, axis=0)))])


def _parts(recording: Recording, least: int) -> list[np.ndarray]:
    """Positions (T, n) in parts of the recording, within its window; none of fewer samples."""
    low, high = recording.window or (-np.inf, np.inf)
    first, after = np.searchsorted(recording.t, [low, high]).tolist()
    length = min(_LENGTH, after - first)
    if length < least:
        return []
    begins = np.linspace(first, after - length, min(_PARTS, (after - first) // length))
    return [recording.q[k : k + length] for k in begins.astype(int).tolist()]


def _errors(q: np.ndarray, rate_hz: float, cutoffs: Sequence[float]) -> np.ndarray:
    """Logarithms of the squared errors of speeds behind cut-offs, summed over joints that move.

    Parameters
    ----------
    q : (T, n) positions.
    rate_hz : of the samples.
    cutoffs : the first is the usual one.
    """
    # Of what a drive has filtered before it was recorded little is left near half the rate of the
    # samples: the largest noise that is seen at any rate at which a motion is still smooth.
    slowest = max(1, int(rate_hz / (_NOISE_RATE * cutoffs[0])))
    noise = _noise(q, [2**k for k in range(slowest.bit_length())])
    gains = [_speed_gain(rate_hz, one) for one in cutoffs]
    moves = np.ptp(q, axis=0) > _MOVES * noise
    v = central_difference(lowpass(q, rate_hz, cutoffs[0]), rate_hz)
    jump = _JUMP * np.sqrt(np.mean(central_difference(v, rate_hz) ** 2, axis=0))
    squares = [(noise * one.noise) ** 2 + (jump * one.rounding) ** 2 for one in gains]
    return np.sum(np.log(np.array(squares)[:, moves]), axis=1)


@lru_cache(16)
def _speed_gain(rate_hz: float, cutoff_hz: float) -> SpeedGain:
    return SpeedGain(rate_hz, Filter(position_cutoff_hz=cutoff_hz))


def _order_errors(
    q: np.ndarray, rate_hz: float, cutoff_hz: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """What accelerations are off with differences of each order, of joints that move, (4, m).

    Parameters
    ----------
    q : (T, n) positions.
    rate_hz : of the samples.
    cutoff_hz : of columns and torque, if there is one.

    Returns
    -------
    What they fall short, relative, and the variance of their noise over the mean square of the
    motion's.
    """
    noise = np.array([_noise(q, (k,)) for k in _EVERY])
    # Half the usual one leaves a thirtieth of what noise adds to the motion's accelerations.
    low = default_position_cutoff(rate_hz, cutoff_hz) / 2.0
    smooth = lowpass(q, rate_hz, low)
    moves = np.ptp(q, axis=0) > _MOVES * noise[0]
    around = max(ORDERS[-1], ceil(rate_hz / low))  # what the low-pass makes up

    def twice(order: int) -> np.ndarray:
        v = central_difference(smooth, rate_hz, order)
        return central_difference(v, rate_hz, order)[around:-around]

    best, short, noisy = twice(ORDERS[-1]), [], []
    size = np.mean(best**2, axis=0)
    for order, within in zip(ORDERS, _passed_noise(rate_hz, cutoff_hz), strict=True):
        noisy.append(np.max(noise**2 * within[:, None] / np.pi, axis=0))
        short.append(np.abs(np.mean((twice(order) - best) * best, axis=0)))
    return np.array(short)[:, moves] / size[moves], np.array(noisy)[:, moves] / size[moves]


@lru_cache(64)
def _passed_noise(rate_hz: float, cutoff_hz: float | None) -> np.ndarray:
    """What differences of each order and a low-pass leave of noise that holds so many samples."""
    passed = np.ones_like(_TURN)
    if cutoff_hz and cutoff_hz < rate_hz / 2:
        passed = np.abs(response(butterworth(rate_hz, cutoff_hz), _TURN)) ** 2
    found = []
    for order in ORDERS:
        gain = (rate_hz**2 * difference_gain(_TURN, order) ** 2 * passed) ** 2
        found.append(
            [k * np.trapezoid(np.where(k * _TURN <= np.pi, gain, 0.0), _TURN) for k in _EVERY]
        )
    passing = np.array(found)
    passing.flags.writeable = False  # it is kept
    return passing


def _noise(q: np.ndarray, every: Sequence[int]) -> np.ndarray:
    """Standard deviation of the noise in positions, (n,) rad or m.

    Parameters
    ----------
    q : (T, n).
    every : the largest noise counts that is seen in every k-th of them, for these k.
    """
    seen = [encoder_noise_std(q[::k]) for k in every]
    steps = resolution(q) / np.sqrt(12.0)
    return np.max([*seen, steps, DIGITS * np.abs(q).max(axis=0)], axis=0)
