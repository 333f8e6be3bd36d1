"""A stated noise that is less than what recordings hold in motion.

At a standstill a drive's current is quiet, and an encoder shows one of its steps. A floor stated
from that is no floor of a moving robot, and every ratio to it is too large.
"""

from __future__ import annotations

import numpy as np

from dynident.evidence.held_out import HeldOut
from dynident.recording import Dataset, Recording
from dynident.recording.white_noise import encoder_noise_std
from dynident.tables import number

_FAR = 2.0
"""Times the stated noise, from which what is seen contradicts it: white noise of the size stated is
seen within some per cent."""


_BLOCK = 200
"""Samples of a block, in which a joint moves or does not."""
_MOVES = 0.5
"""Share of a joint's rms speed from which it moves in a block."""
_IF = (
    "If the stated noise was measured at a standstill, it is no floor of a moving robot, and the "
    "ratios to it may be too large."
)


def stated_noise_notes(
    judged: HeldOut, recordings: Dataset, units: tuple[str, ...], most_left: float
) -> tuple[str, ...]:
    """Say where recordings are far rougher from sample to sample than the noise that was stated.

    Only where a residual is left beyond that noise: a drive that feeds noise into its torque makes
    the recording rough, and a model that leaves nothing says that no more is to be allowed.

    Parameters
    ----------
    judged : what the final model misses.
    recordings : with the noise that was stated, if any was.
    units : of the joints' torques.
    most_left : systematic residual over noise, above which a ratio asks for a reason.

    Returns
    -------
    One note, with what is seen where that is enough; none where nothing is left.
    """
    stated = recordings.noise
    if stated is None or judged.ratio is None or not len(recordings):
        return ()
    if not np.any(judged.ratio > most_left):
        return ()
    seen = np.median([_in_motion(one) for one in recordings.recordings], axis=0)
    names = recordings.recordings[0].joints
    wrong = [
        f"{number(noise, 2)} {unit} at {name}, where {number(least, 2)} {unit} is seen"
        for name, unit, noise, least, ratio in zip(
            names, units, stated.torque_std, seen, judged.ratio, strict=True
        )
        if noise > 0 and least > _FAR * noise and ratio > most_left
    ]
    if not wrong:
        return (_IF,)
    return (
        "The stated noise of the torque is less than what the recordings hold from sample to "
        f"sample in motion: {'; '.join(wrong)}. It may be no floor of a moving robot (a standstill "
        "hides most of the noise), and the ratios to it may be too large. Record a repeated "
        "motion, which tells the noise in motion.",
    )


def _in_motion(recording: Recording) -> np.ndarray:
    """Standard deviation of the torque's white noise, (n,), in blocks in which the joint moves."""
    count = max(1, len(recording.t) // _BLOCK)
    parts = np.array_split(recording.tau, count)
    rough = np.array([encoder_noise_std(part) for part in parts])
    v = np.gradient(recording.q, recording.t, axis=0)
    speed = np.array([np.sqrt(np.mean(part**2, axis=0)) for part in np.array_split(v, count)])
    moves = speed >= _MOVES * np.sqrt(np.mean(v**2, axis=0))
    return np.nanmedian(np.where(moves, rough, np.nan), axis=0)
