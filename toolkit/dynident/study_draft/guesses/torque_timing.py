"""How late torques are: a command that is held is half a sample late on average, a delay more."""

from __future__ import annotations

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.model import Model
from dynident.recording import Recording
from dynident.study_draft.guesses.file_reading import Reading
from dynident.wiring.regressions.wiring_regression import WiringRegression

_DELAYS = (1, 2, 4)  # samples


def samples_late(reading: Reading, recordings: tuple[Recording, ...]) -> float:
    """Samples by which torques act later than they are recorded: 0, 0.5 of a held command, or more.

    Parameters
    ----------
    reading : with the robot as it is described.
    recordings : read so, in the units of the robot; their torques count as measured.

    Returns
    -------
    0 also where half a sample is too short to show.
    """
    late = {0.5: tuple(one.replace(torque="held_command") for one in recordings)}
    late |= {float(k): tuple(_delayed(one, k) for one in recordings) for k in _DELAYS}
    start = _score(reading, recordings)
    if start is None:
        return 0.0
    now, rows = start
    scores = {}
    for samples, some in late.items():
        one = _score(reading, some)
        if one is None:
            return 0.0
        scores[samples] = one[0]
    enough = DEFAULTS.wiring.evidence / rows
    if scores[0.5] - now < enough:
        return 0.0
    best = max(_DELAYS, key=lambda k: scores[k])
    return float(best) if scores[best] - scores[0.5] >= enough else 0.5


def _delayed(one: Recording, samples: int) -> Recording:
    tau = np.concatenate([np.repeat(one.tau[:1], samples, axis=0), one.tau[:-samples]])
    return one.replace(tau=tau)


def _score(reading: Reading, recordings: tuple[Recording, ...]) -> tuple[float, float] | None:
    """Logarithmic likelihood per row of a fit, and how many rows count."""
    rows = reading.rows(recordings)
    if rows is None:
        return None
    n = reading.robot.n
    found = WiringRegression.of(Model(reading.robot), rows).fit(np.arange(n), np.ones(n))
    return found.fit_score, rows.independent
