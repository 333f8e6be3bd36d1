"""Recordings against the robot that they are said to be of: is every column what it is called?

What comes in: a model, of which the robot counts, recordings to fit and to judge by, and the
criteria (`dynident.criteria.WiringCriteria`). What goes out: `Fault`s, each in one sentence with
what shows it and the lines of the study file that mend it; none where nothing contradicts what the
study says. It comes before a diagnosis: a search for missing physics would explain a torque of the
wrong sign by couplings, ripple and gains.

Of columns, single faults are hypotheses (`assignment`): the sign of one torque or of all, two
torques, two positions or two joints exchanged, degrees, the motor side of a gear, N mm. A few
hundred rows (`wiring_rows`) are enough. The regressor is evaluated once for each motion that is
supposed; a fit to torques in another order or on another scale is then one small system of
equations (`wiring_regression`), in which every joint has friction, a rotor, a spring and an offset,
so that what a model lacks is not taken for a fault. A hypothesis is as likely as its residual is
small and as its inertias and friction are possible: of all torques negated nothing else can be
seen. It is accepted where it wins by far (`hypothesis_search`, `gear_ratios`); what no regression
tells, the unit of all torques, is judged by the described bodies (`described_torque`).

Which way gravity pulls is told likewise (`mounting`, by `any_gravity`): under another one, where
that suits the columns by far, faults of columns are looked for again.

Of data: the same samples in training and test recordings, one source of two columns (`same_data`),
a period after which the motion does not repeat (`stated_period`), a low-pass of the positions that
takes away motion which the torque shows, or leaves their noise (`position_filter`).
"""

from dynident.wiring.fault import Fault
from dynident.wiring.wiring_check import check_wiring

__all__ = ["Fault", "check_wiring"]
