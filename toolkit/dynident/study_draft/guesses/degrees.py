"""Positions in degrees beside currents, whose own size tells nothing: by limits and by torques."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from dynident.criteria import DEFAULTS
from dynident.model import Model
from dynident.recording import Recording
from dynident.study_draft.guesses.drive_unit import drive_sizes
from dynident.study_draft.guesses.file_reading import Reading
from dynident.wiring.assignment import DEGREE, Assignment
from dynident.wiring.gear_ratios import turns_too_far

_MOVED = ("q", "v", "q_ref")


def positions_in_radians(
    reading: Reading,
    recordings: Sequence[Recording],
    take: Callable[[str, list[str], str], int],
) -> Reading:
    """Return a reading with positions in rad, where degrees alone suit limits and torques.

    As recorded a joint turns too far, in degrees none does, and the described torque then shows at
    more joints, in whatever unit: each joint is compared by itself.

    Parameters
    ----------
    reading : of positions that nobody has stated anything of.
    recordings : read so.
    take : takes a decision: (subject, choices, reason) -> which of them.

    Returns
    -------
    The reading as it was decided.
    """
    robot = reading.robot
    turning = [j for j, kind in enumerate(robot.kinds) if kind == "revolute"]
    names = [f"{signal}.{robot.names[j]}" for signal in _MOVED for j in turning]
    rows = reading.rows(tuple(recordings))
    if rows is None or any(reading.columns[name].scale != 1.0 for name in names[: len(turning)]):
        return reading
    recorded = Assignment.as_recorded(robot.n)
    degrees = recorded.positions_scaled(DEGREE, *turning)
    model, criteria = Model(robot), DEFAULTS.wiring
    far, still_far = (
        [j for j in turning if turns_too_far(model, rows, one, j, criteria)]
        for one in (recorded, degrees)
    )
    if not far or still_far:
        return reading
    before, after = (
        len(drive_sizes(robot, [x.replace(q=x.q @ one.change.T) for x in recordings]).joints)
        for one in (recorded, degrees)
    )
    if after <= before:
        return reading
    reason = (
        f"{', '.join(robot.names[j] for j in far)} would turn too far, and the described torque "
        f"shows at {after} joints instead of {before}; of motors behind gears of about 57 say so: "
        "--gears"
    )
    if take("q", ["positions in degrees", "positions in rad"], reason) == 1:
        return reading
    columns = {
        ours: replace(one, scale=one.scale * DEGREE) if ours in names else one
        for ours, one in reading.columns.items()
    }
    return replace(reading, columns=columns)
