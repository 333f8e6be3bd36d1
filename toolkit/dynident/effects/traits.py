"""What the columns of an effect depend on, as traits with the questions that are asked of them."""

from __future__ import annotations

from enum import Flag, auto
from typing import ClassVar


class Needs(Flag):
    """What a `Block` must carry for the columns of an effect.

    REGRESSOR : the rigid-body regressor, `Block.rigid`.
    TORQUE : the torque that the current model predicts without effects that depend on it.
    BODIES : the current model's robot and rotor inertias.
    RECORDING : the whole recording at its full rate, not a part of it.
    PAYLOAD : whether the payload is on board; recordings with and without it differ.
    NUMBER : the recording's number in its study; windows of one recording are otherwise evaluated
        together, as one.
    OF_MODEL : the part of it that a model adds to the samples, see `Model.ready`.
    """

    NOTHING = 0
    REGRESSOR = auto()
    TORQUE = auto()
    BODIES = auto()
    RECORDING = auto()
    PAYLOAD = auto()
    NUMBER = auto()
    OF_MODEL = REGRESSOR | TORQUE | BODIES


class EffectTraits:
    """What tells the rest of the package when, where and how often columns are evaluated.

    Attributes
    ----------
    needs : what a block must carry.
    linear_in_torque : whether the columns are linear in the predicted torque and depend on nothing
        else: then it does not matter whether they are filtered or made of filtered torque, which
        is quicker.
    nonlinear : whether the torque is not linear in the parameters, so that the columns are taken at
        a linearisation point.
    time_varying : whether the columns depend on the time in the session: they do not repeat with
        the motion.
    reverses : whether the columns change with the friction width of their joints; those that say no
        are not evaluated again for another width.
    opposes_motion : whether it is a part of the joint's friction, which together takes power.
    at_every_joint : whether a robot that has it at one joint, as a rule, has it at all.
    """

    needs: ClassVar[Needs] = Needs.NOTHING
    linear_in_torque: ClassVar[bool] = False
    nonlinear: ClassVar[bool] = False
    time_varying: ClassVar[bool] = False
    reverses: ClassVar[bool] = True
    opposes_motion: ClassVar[bool] = False
    at_every_joint: ClassVar[bool] = False

    @property
    def needs_regressor(self) -> bool:
        """Whether the rigid-body regressor must be in the block."""
        return Needs.REGRESSOR in self.needs

    @property
    def needs_torque(self) -> bool:
        """Whether the columns depend on the torque that the current model predicts."""
        return Needs.TORQUE in self.needs

    @property
    def needs_bodies(self) -> bool:
        """Whether the columns depend on the current model's bodies."""
        return Needs.BODIES in self.needs

    @property
    def needs_recording(self) -> bool:
        """Whether the columns depend on what went before: the block is a whole recording."""
        return Needs.RECORDING in self.needs

    @property
    def is_payload(self) -> bool:
        """Whether it acts in the recordings that carry the payload only."""
        return Needs.PAYLOAD in self.needs

    @property
    def depends_on_fit(self) -> bool:
        """Whether the columns depend on the parameters of the model, and change as it is fitted."""
        return self.needs_torque or self.needs_bodies

    @property
    def is_instantaneous(self) -> bool:
        """Whether the columns of a part of a recording follow from that part's motion alone."""
        return not (self.depends_on_fit or self.needs_recording)

    @property
    def is_exact(self) -> bool:
        """Whether the columns follow from the motion alone, at any fit and any values."""
        return self.is_instantaneous and not self.nonlinear

    @property
    def is_dynamic_response(self) -> bool:
        """Whether the column is a filtered dynamic regressor: a response of the current bodies."""
        return self.needs_bodies and self.needs_recording
