"""A fault of the wiring, in words: what it is, what shows it, and the line that mends it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

FaultKind = Literal[
    "torque_sign",
    "torque_signs",
    "position_sign",
    "torques_exchanged",
    "positions_exchanged",
    "joints_exchanged",
    "degrees",
    "millimetres",
    "torque_unit",
    "motor_side",
    "motor_side_position",
    "motor_side_torque",
    "torque_scale",
    "gravity",
    "same_data",
    "one_source",
    "period",
    "position_filter",
]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """What is wrong with the recordings or with what the study says of them.

    Attributes
    ----------
    kind : of fault.
    joints : names of those that it is about; empty where it is about the robot, or recordings.
    what : in a few words, "sign of tau.elbow".
    evidence : what shows it, a sentence.
    mend : lines of the study file that mend it; empty where the data do not tell them.
    where : where these lines go, or what else is to be done.
    """

    kind: FaultKind
    joints: tuple[str, ...]
    what: str
    evidence: str
    mend: tuple[str, ...] = ()
    where: str = ""

    @property
    def sentence(self) -> str:
        """The fault, what shows it and what mends it, in plain words."""
        lines = "; ".join(self.mend)
        remedy = f"{self.where}: {lines}" if lines else self.where
        return f"{self.what}: {self.evidence}. {remedy}."

    def to_dict(self) -> dict[str, Any]:
        """The fault as JSON has it."""
        return {
            "what": self.what,
            "evidence": self.evidence,
            "kind": self.kind,
            "joints": list(self.joints),
            "mend": list(self.mend),
            "where": self.where,
        }
