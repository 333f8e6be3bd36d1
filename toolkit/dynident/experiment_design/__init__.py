"""The recording to make: motions within a robot's limits that tell the most.

`design` is the verb. `motion_limits` says what a motion may do, `motions` which ones there are,
`column_function` what their instants tell, `information` how much that is, `geometry` where the
bodies are and how far they stay apart, `motion_program` which motion tells the most, and
`recording_design` what comes of it.
"""

from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.designing import design
from dynident.experiment_design.motion_limits import MotionLimits
from dynident.experiment_design.recording_design import RecordingDesign

__all__ = ["DesignTask", "MotionLimits", "RecordingDesign", "design"]
