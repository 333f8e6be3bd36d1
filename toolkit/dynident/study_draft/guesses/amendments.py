"""What a draft mends so that the recordings suit the robot: mounting, zeros, units, signs, order.

Each guess compares fits of the robot's equations of motion. They are tried side by side, for a
robot on the ceiling looks like one whose joints count from elsewhere, and the best is taken first.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import RecordingError
from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot
from dynident.study_draft.guesses.coupled_motors import Coupling, coupling_by_torques
from dynident.study_draft.guesses.file_reading import Reading
from dynident.study_draft.guesses.motor_side import coupled, expression_of, turned
from dynident.study_draft.guesses.wiring_guess import guess_wiring
from dynident.study_draft.guesses.zeros import guess_zeros
from dynident.tables import percent
from dynident.wiring.assignment import Assignment
from dynident.wiring.mounting import mounting
from dynident.wiring.regressions.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows

_ROUNDS = 4
_ALIKE = 1.02  # times the least misfit, within which amendments are not told apart


@dataclass(frozen=True, kw_only=True)
class Amendment:
    """A reading that suits the robot far better.

    Attributes
    ----------
    subject : what is mended.
    what, why : in words.
    left : share of the torque that a fit then leaves.
    reading : the mended one.
    """

    subject: str
    what: str
    why: str
    left: float
    reading: Reading


def amended(
    reading: Reading,
    read: Callable[[Reading], tuple[Recording, ...]],
    take: Callable[[str, list[str], str], int],
) -> Reading:
    """Mend a reading, the best amendment first, until none is far better.

    Parameters
    ----------
    reading : as the names of columns have it.
    read : reads the recordings.
    take : takes a decision: (subject, choices, reason) -> which of them.

    Returns
    -------
    The reading as it was decided.

    Raises
    ------
    RecordingError
        If positions are on the motor side of gears whose ratios the data do not tell.
    """
    refused: set[str] = set()
    for _ in range(_ROUNDS):
        recordings = read(reading)
        rows = reading.rows(recordings)
        if rows is None:
            break
        guesses = [
            _zeros(reading, rows),
            _mounting(reading, rows),
            _wiring(reading, rows, recordings[0]),
            _coupling(reading, rows),
        ]
        found = [one for one in guesses if one is not None and one.subject not in refused]
        if not found:
            break
        least = min(one.left for one in found)
        # A planar arm on the ceiling, say, is one whose first joint counts from elsewhere.
        close = [one for one in found if one.left <= _ALIKE * least]
        choices = [one.what for one in close]
        poor = least > DEFAULTS.wiring.poor_fit
        at = 0 if poor else len(choices)
        choices.insert(at, "as recorded")
        reason = f"{close[0].why}{', which is still poor' if poor else ''}"
        taken = take(close[0].subject, choices, reason)
        if taken == at:
            refused |= {one.subject for one in close}
        else:
            reading = close[taken - (taken > at)].reading
    return reading


def _mounting(reading: Reading, rows: WiringRows) -> Amendment | None:
    """A base that is mounted otherwise than the description says, or torques without gravity."""
    robot = reading.robot
    found = mounting(Model(robot), rows, Assignment.as_recorded(robot.n), DEFAULTS.wiring)
    if found is None or found.turn < DEFAULTS.wiring.least_turn or not found.suits(found.after):
        return None
    return Amendment(
        subject="gravity",
        what=f"gravity = {found.shown} in the base's axes",
        why=evidence(found.before, found.after),
        left=found.after.misfit,
        reading=replace(reading, robot=found.model.robot),
    )


def _zeros(reading: Reading, rows: WiringRows) -> Amendment | None:
    """Joints that count from a quarter turn elsewhere."""
    robot = reading.robot
    guess = guess_zeros(robot, rows, _fit, reading.torque_unit)
    if not any(guess.quarters):
        return None
    turns = zip(robot.names, guess.quarters, strict=True)
    moved = [f"{joint} by {90 * count:+d} deg" for joint, count in turns if count]
    return Amendment(
        subject="zeros",
        what=f"moved: {', '.join(moved)}",
        why=evidence(guess.start, guess.best) + guess.evidence,
        left=guess.best.misfit,
        reading=replace(reading, columns=turned(reading.columns, robot, guess.quarters)),
    )


def _ratios_to_give(reading: Reading) -> str:
    """What to type where ratios of gears are missing, in the names of the file."""
    names = reading.robot.names
    how = "turns of the motor for one of the joint, a minus where they turn against each other"
    ratios = ",".join(f"N{k}" for k in range(1, len(names) + 1))
    if "prismatic" in reading.robot.kinds:
        how += "; of a slide rad of the motor for a metre: 2 pi over the lead of its screw"
    given = f"give them, as the arm's manual has them: --gears {ratios} ({how})"
    if len(names) < 2:
        return given
    before, last = (expression_of(reading.columns[f"q.{name}"]).text for name in names[-2:])
    k, column = len(names), names[-1]
    together = shlex.quote(f"q.{column} = ({last})/N{k} - ({before})/N{k - 1}")
    return f"{given}; where the motor of {names[-2]} turns {column} too, also --column {together}"


def _wiring(reading: Reading, rows: WiringRows, first: Recording) -> Amendment | None:
    """Units, gears, signs and order of columns."""
    guess = guess_wiring(reading, rows, first)
    if guess is None:
        return None
    if guess.unknown_gears:
        what = (
            f"positions of {', '.join(guess.unknown_gears)} are on the motor side of gears, whose "
            "ratios the data do not tell"
        )
        raise RecordingError(what, first.where, _ratios_to_give(reading))
    return Amendment(
        subject="units and signs",
        what="; ".join(guess.findings),
        why="; ".join(dict.fromkeys(guess.evidence)),
        left=guess.left,
        reading=replace(
            reading,
            columns=guess.columns,
            motors=guess.motors,
            geared=reading.geared or guess.gears,
        ),
    )


def _coupling(reading: Reading, rows: WiringRows) -> Amendment | None:
    """A motor that turns two joints, where the torques tell."""
    guess = coupling_by_torques(reading.robot, rows) if reading.may_share_motors else None
    if guess is None:
        return None
    (one,) = guess.found
    after = shared(reading, one)
    n = reading.robot.n
    change, back = np.eye(n), np.eye(n)
    i, k = reading.robot.names.index(one.joint), reading.robot.names.index(one.by)
    change[i, k], back[k, i] = one.turns, -one.turns
    moved = replace(rows.moved(change), tau=rows.tau @ back.T, motors=after.motors)
    return Amendment(
        subject="coupling",
        what=one.words,
        why=guess.reason,
        left=_fit(reading.robot, moved).misfit,
        reading=after,
    )


def shared(reading: Reading, one: Coupling) -> Reading:
    """Return a reading with a motor that turns two joints.

    Parameters
    ----------
    reading : of motors that turn one each.
    one : which, and how far.
    """
    names = reading.robot.names
    motors = np.eye(len(names))
    motors[names.index(one.joint), names.index(one.by)] = -one.turns
    columns = coupled(reading.columns, one.joint, one.by, one.turns)
    return replace(reading, columns=columns, motors=motors)


def _fit(robot: Robot, rows: WiringRows) -> TorqueFit:
    """Fit the robot's equations of motion to rows, as they are."""
    n = robot.n
    return WiringRegression.of(Model(robot), rows).fit(np.arange(n), np.ones(n))


def evidence(start: TorqueFit, best: TorqueFit) -> str:
    """What shows that one fit is better than another."""
    left = [percent(one.misfit) for one in (best, start)]
    return f"a fit then leaves {left[0]} of the torque instead of {left[1]}"
