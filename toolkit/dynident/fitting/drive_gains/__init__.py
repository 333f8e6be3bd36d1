"""Torques recorded in the unit of the drives: their gains, and the loads that fix the scale.

In: a model, recordings in amperes or percent, and what is known of gains and loads. Out:
`DriveGains`, with what is known up to a common scale said.
"""

from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.fitting.drive_gains.fit_gains import fit_drive_gains
from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.fitting.drive_gains.identified_load import IdentifiedLoad
from dynident.fitting.drive_gains.loads import Load

__all__ = ["DriveGains", "GainProblem", "IdentifiedLoad", "Load", "fit_drive_gains"]
