"""Whether a motor turns two joints: what is taken, and how the other reading would be written."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace

from dynident.recording import Recording
from dynident.study_draft.drafted_columns import OtherReading
from dynident.study_draft.guesses.amendments import shared
from dynident.study_draft.guesses.coupled_motors import (
    Coupling,
    CouplingGuess,
    coupling_by_speeds,
    couplings_of,
)
from dynident.study_draft.guesses.file_reading import Reading
from dynident.study_draft.guesses.motor_side import expression_of

_ALONE = "each motor turns one joint"


def with_shared_motors(
    reading: Reading,
    recordings: Sequence[Recording],
    take: Callable[[str, list[str], str], int],
) -> tuple[Reading, OtherReading | None]:
    """Ask whether a motor turns two joints where limits of speed suggest it, and say how else.

    Limits alone change nothing: a limit that the description has too low looks the same.

    Parameters
    ----------
    reading : as the torques want it.
    recordings : read so.
    take : takes a decision: (subject, choices, reason) -> which of them.

    Returns
    -------
    The reading as it was decided, and the columns as they would be otherwise; None where columns
    are of joints, where somebody has said what they are made of, where no joint carries another, or
    where torques are currents, of which no sum is a torque.
    """
    robot = reading.robot
    if not reading.geared or reading.stated or reading.torque_unit == "A":
        return reading, None
    if reading.motors is not None:
        return reading, _alone(reading)
    guess = coupling_by_speeds(robot, recordings)
    if guess is not None:
        taken = take("coupling", [_ALONE, *(one.words for one in guess.found)], guess.reason)
        if taken:
            after = shared(reading, guess.found[taken - 1])
            return after, _alone(after)
        return reading, _suggested(reading, guess)
    last = robot.joints[-1]
    if last.parent < 0 or {last.kind, robot.kinds[last.parent]} != {"revolute"}:
        return reading, None
    example = Coupling(joint=last.name, by=robot.names[last.parent], turns=-1.0)
    return reading, _as_coupled(reading, example)


def _alone(reading: Reading) -> OtherReading:
    """The lines of a reading without the motor that turns two joints."""
    assert reading.motors is not None
    (one,) = couplings_of(reading.motors, reading.robot)
    back = replace(one, turns=-one.turns)
    return _otherwise(reading, shared(replace(reading, motors=None), back), f"If {_ALONE}")


def _as_coupled(reading: Reading, one: Coupling) -> OtherReading:
    words = f"If the motor of {one.by} turns {one.joint} too (or with the other sign)"
    return _otherwise(reading, shared(reading, one), words)


def _suggested(reading: Reading, guess: CouplingGuess) -> OtherReading:
    """What limits of speed suggest, with what to type if it is so."""
    stated = []
    for one in guess.found:
        ours = f"q.{one.joint}"
        theirs = expression_of(shared(reading, one).columns[ours]).text
        stated.append(f"--column {shlex.quote(f'{ours} = {theirs}')}")
    found = _as_coupled(reading, guess.found[0])
    one = guess.found[0]
    question = (
        f"Does the motor of {one.by} turn {one.joint} too, as its limit of speed suggests? "
        "If so, remove this draft, or give --out, and draft again with"
        f"{' one of' if len(stated) > 1 else ''}:"
    )
    return replace(found, words=f"If {one.words}", question=question, answers=tuple(stated))


def _otherwise(taken: Reading, other: Reading, words: str) -> OtherReading:
    changed = {ours: one for ours, one in other.columns.items() if taken.columns.get(ours) != one}
    return OtherReading(words=words, columns=changed)
