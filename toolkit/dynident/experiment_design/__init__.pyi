from .design_task import DesignTask as DesignTask
from .designing import design as design
from .motion_limits import MotionLimits as MotionLimits
from .recording_design import RecordingDesign as RecordingDesign
