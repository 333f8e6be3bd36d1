"""Torques recorded in the unit of the drives: their gains, and the loads that fix the scale.

In: a model, recordings in amperes or percent, and what is known of gains and loads. Out:
`DriveGains`, with what is known up to a common scale said; by it `in_newton_metres` makes
recordings in N m, without the loads, of them.
"""

from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.fitting.drive_gains.fit_gains import fit_drive_gains
from dynident.fitting.drive_gains.gain_changes import anew_tables
from dynident.fitting.drive_gains.gain_errors import with_gain_errors
from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.fitting.drive_gains.newton_metres import in_newton_metres

__all__ = [
    "DriveGains",
    "GainProblem",
    "anew_tables",
    "fit_drive_gains",
    "in_newton_metres",
    "with_gain_errors",
]
