"""The low-pass of the positions that does least harm to their speeds.

What it lets through of the encoders' noise is in every row. What it takes away is missing where dry
friction turns round: there the acceleration jumps, behind a low-pass the speed passes through zero
smoothly and at another time, and friction of a wrong sign is the larger error of a fine encoder.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.errors import RecordingError
from dynident.recording.filters import (
    Filter,
    butterworth,
    central_difference,
    default_filter,
    default_position_cutoff,
    lowpass,
)
from dynident.recording.low_pass.sections import response
from dynident.recording.plausibility import resolution
from dynident.recording.recording import Recording
from dynident.recording.white_noise import encoder_noise_std

_FREQUENCIES = 4096  # at which a filter's response is taken
_WIDER = (1.0, 2.0, 4.0)
"""Cut-offs that are tried, over the usual one. Columns and torque pass a far lower low-pass of
their own, so that beyond these little is gained."""
_OF_RATE = 0.2
"""Of the sampling rate, the highest cut-off: beyond, differences fall short of derivatives."""
_JUMP = 0.5
"""Jump of the acceleration where dry friction turns round, of its root mean square: with less the
noise counts more, which is in every row."""
_ALIKE = 1.05  # largest over smallest of the rates that recordings are decimated to
_MOST = 1 << 16  # samples that are looked at, from the middle of a recording


@dataclass(frozen=True)
class SpeedGain:
    """What low-pass and central difference make of positions.

    Attributes
    ----------
    rate_hz : of the samples.
    cutoff_hz : of the zero-phase low-pass; None: none.
    """

    rate_hz: float
    cutoff_hz: float | None

    @cached_property
    def noise(self) -> float:
        """Noise of the speed over white noise of the positions, 1/s."""
        angle, gain = self._gain
        return self.rate_hz * float(np.sqrt(np.trapezoid(gain**2, angle) / np.pi))

    @cached_property
    def rounding(self) -> float:
        """Speed that is made up where the acceleration jumps, over that jump, s.

        Of a speed that is zero until it rises steadily they make, where it begins to, that rise
        times half the mean of |t| over their response.
        """
        angle, gain = self._gain
        inside = np.trapezoid((1.0 - gain / angle) / angle**2, angle)
        return float((inside + 1.0 / np.pi) / (np.pi * self.rate_hz))

    @cached_property
    def _gain(self) -> tuple[np.ndarray, np.ndarray]:
        """Angles up to pi, and there the gain from positions to speeds, per sample."""
        angle = np.linspace(0.0, np.pi, _FREQUENCIES)[1:]
        gain = np.sin(angle)
        if self.cutoff_hz:
            passed = np.abs(response(butterworth(self.rate_hz, self.cutoff_hz), angle)) ** 2
            gain = gain * passed
        return angle, gain


def suited_position_cutoff(recordings: Sequence[Recording], cutoff_hz: float | None) -> float:
    """Return the cut-off of the positions' low-pass, in Hz, that suits recordings.

    Parameters
    ----------
    recordings : one or more, that are to have the same one.
    cutoff_hz : of columns and torque, if there is one.

    Returns
    -------
    That of `default_position_cutoff` at the lowest of their rates, or two or four times as much,
    whichever lets least noise and made-up speed through, all joints counting alike.
    """
    rate = min(one.rate_hz for one in recordings)
    usual = default_position_cutoff(rate, cutoff_hz)
    tried = [k * usual for k in _WIDER if k == 1.0 or k * usual <= _OF_RATE * rate]
    if len(tried) == 1:
        return usual
    try:
        errors = np.sum([_errors(one, tried) for one in recordings], axis=0)
    except RecordingError:  # which whoever samples the recording will tell, with its place
        return usual
    return tried[int(np.argmin(errors))]


def common_filter(recordings: Sequence[Recording]) -> Filter | None:
    """Return the one filter for recordings whose study states none.

    Parameters
    ----------
    recordings : of one robot.

    Returns
    -------
    As of `suited_filter`; None for no recording, or where their rates call for different ones.
    """
    usual = [default_filter(one.rate_hz).rate_hz or 0.0 for one in recordings]
    if not usual or max(usual) > _ALIKE * min(usual):
        return None
    return suited_filter(recordings)


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


def _errors(recording: Recording, cutoffs: Sequence[float]) -> np.ndarray:
    """Squared error of speeds behind cut-offs over that behind the first, summed over joints."""
    rate, q = recording.rate_hz, _middle(recording)
    noise = np.maximum(encoder_noise_std(q), resolution(q) / np.sqrt(12.0))
    jump = _JUMP * _rms_acceleration(q, rate, cutoffs[0])
    gains = [SpeedGain(rate, one) for one in cutoffs]
    squares = np.array([(noise * one.noise) ** 2 + (jump * one.rounding) ** 2 for one in gains])
    moves = squares[0] > 0.0
    return np.sum(squares[:, moves] / squares[0, moves], axis=1)


def _middle(recording: Recording) -> np.ndarray:
    start = max(0, (recording.samples - _MOST) // 2)
    return recording.q[start : start + _MOST]


def _rms_acceleration(q: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    """Root mean square of the acceleration behind a low-pass, (n,)."""
    smooth = lowpass(q, rate_hz, cutoff_hz)
    a = central_difference(central_difference(smooth, rate_hz), rate_hz)
    return np.sqrt(np.mean(a**2, axis=0))
