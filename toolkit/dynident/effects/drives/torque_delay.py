"""Torque that is recorded late."""

from __future__ import annotations

import numpy as np

from dynident.effects.effect import Block, Forceless, Parameter
from dynident.effects.traits import Needs
from dynident.errors import EffectError

_NEXT_TO_NOTHING = 1e-7
"""Delay in s below which a difference has fewer digits than the derivative in the middle of it."""

_SAMPLING = 0.6
"""Of a sample: a delay that a torque which is held, or is not, amounts to."""


class TorqueDelay(Forceless):
    """The torque recorded at t is the one that acted at t - d: of one joint, or of all alike.

    The column is made of the torque which the model predicts, by a cubic spline through its samples
    at the full rate; before the first and after the last of them the torque stays as it is there.
    """

    name = "torque_delay"
    place = "joint or robot"
    law = "tau(t - d) - tau(t)"
    sign_of = "a residual like the rate at which the torque changes"
    meaning = "the torque is recorded a moment later than the motion"
    confounded_with = ("joint_elasticity", "rotor_inertia", "viscous_friction")
    shown_by = "acceleration"
    experiment = "move fast, so that the torque changes much within the delay"
    needs = Needs.TORQUE | Needs.RECORDING
    nonlinear = True

    @property
    def advice(self) -> str:
        """The experiment that shows it; all joints move where it is common to them."""
        return f"{self.experiment} at {self.joint}" if self.joint else self.experiment

    def parameters(self, robot):
        return (
            Parameter(
                "d", "s", -0.05, 0.05, means="how much later the torque is recorded than it acts"
            ),
        )

    def columns(self, block: Block) -> np.ndarray:
        if block.torque is None:
            raise EffectError("needs the predicted torque in the block", self.label)
        if len(block.t) < 2:
            raise EffectError("needs the whole recording in the block", self.label)
        from scipy.interpolate import CubicSpline

        at = slice(None) if self.joint is None else [block.index(self.joint)]
        torque = block.torque[:, at]
        curve = CubicSpline(block.t, torque)
        (d,) = self.point or (0.0,)
        columns = np.zeros((*block.q.shape, 1))
        if abs(d) < _NEXT_TO_NOTHING:
            columns[:, at, 0] = -curve(_within(block.t, d / 2), nu=1)
        else:
            columns[:, at, 0] = (curve(_within(block.t, d)) - torque) / d
        return columns

    def unresolved(self, values, step):
        if not abs(values[0]) < _SAMPLING * step:
            return ""
        return "less than a sample: a matter of when the torque was sampled (held_command)"

    def simulated_delay(self, values, robot):
        at = slice(None) if self.joint is None else robot.names.index(str(self.joint))
        delay = np.zeros(robot.n)
        delay[at] = values[0]
        return delay


def _within(t: np.ndarray, delay: float) -> np.ndarray:
    """Instants earlier by a delay, those beyond the recording at its ends."""
    return np.clip(t - delay, t[0], t[-1])
