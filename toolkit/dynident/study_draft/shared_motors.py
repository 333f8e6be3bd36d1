"""Whether a motor turns two joints: what is taken, and how the other reading would be written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dynident.recording import Recording
from dynident.study_draft.drafted_columns import OtherReading
from dynident.study_draft.guesses.amendments import shared
from dynident.study_draft.guesses.coupled_motors import Coupling, coupling_by_speeds
from dynident.study_draft.guesses.file_reading import Reading

_ALONE = "each motor turns one joint"


def with_shared_motors(
    reading: Reading,
    recordings: Sequence[Recording],
    take: Callable[[str, list[str], str], int],
) -> tuple[Reading, OtherReading | None]:
    """Let a motor turn two joints where limits of speed want it, and say how else columns may be.

    Parameters
    ----------
    reading : as the torques want it.
    recordings : read so.
    take : takes a decision: (subject, choices, reason) -> which of them.

    Returns
    -------
    The reading as it was decided, and the columns as they would be otherwise; None where columns
    are of joints, where somebody has said what they are made of, or where no joint carries another.
    """
    robot = reading.robot
    if not reading.geared or reading.stated:
        return reading, None
    if reading.motors is not None:
        return reading, _alone(reading)
    guess = coupling_by_speeds(robot, recordings)
    if guess is not None:
        words = [one.words for one in guess.found]
        # Which way it turns has to be known: of two ways none is likelier.
        choices = [*words, _ALONE] if len(words) == 1 else [_ALONE, *words]
        reason = guess.reason + ("" if len(words) == 1 else "; which way it turns nothing says")
        chosen = choices[take("coupling", choices, reason)]
        for one in guess.found:
            if one.words == chosen:
                after = shared(reading, one)
                return after, _alone(after)
        return reading, _as_coupled(reading, guess.found[0])
    last = robot.joints[-1]
    if last.parent < 0 or {last.kind, robot.kinds[last.parent]} != {"revolute"}:
        return reading, None
    example = Coupling(joint=last.name, by=robot.names[last.parent], turns=-1.0)
    return reading, _as_coupled(reading, example)


def _alone(reading: Reading) -> OtherReading:
    """The lines of a reading without the motor that turns two joints."""
    assert reading.motors is not None
    names = reading.robot.names
    ((i, k),) = np.argwhere(reading.motors - np.eye(len(names)))
    back = Coupling(joint=names[i], by=names[k], turns=float(reading.motors[i, k]))
    return _otherwise(reading, shared(replace(reading, motors=None), back), f"If {_ALONE}")


def _as_coupled(reading: Reading, one: Coupling) -> OtherReading:
    words = f"If the motor of {one.by} turns {one.joint} too (or with the other sign)"
    return _otherwise(reading, shared(reading, one), words)


def _otherwise(taken: Reading, other: Reading, words: str) -> OtherReading:
    changed = {ours: one for ours, one in other.columns.items() if taken.columns.get(ours) != one}
    return OtherReading(words=words, columns=changed)
