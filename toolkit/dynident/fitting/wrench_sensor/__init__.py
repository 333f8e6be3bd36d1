"""What hangs on a wrench sensor: weighed by its forces and torques, without any drive.

In: a `WrenchProblem`, a robot whose motion is known and recordings of the sensor. Out:
`SensedLoads`, ten inertial parameters of each load and six constants of the sensor.
"""

from dynident.fitting.wrench_sensor.fit_wrench import fit_wrench
from dynident.fitting.wrench_sensor.sensed_loads import SensedLoads
from dynident.fitting.wrench_sensor.wrench_rows import WrenchProblem

__all__ = ["SensedLoads", "WrenchProblem", "fit_wrench"]
