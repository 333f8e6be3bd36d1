"""What the errors of a simulated loop mean: whose fault they are, and whether it can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynident.criteria import LoopCriteria
from dynident.tables import percent
from dynident.validation.loop_errors import LoopErrors

Verdict = Literal["follows", "no_nearer", "other_controller", "not_simulated"]

ORIENTATION = (
    "For orientation: a two-link robot that was identified well came within 0.5 % of the position, "
    "5 % of the velocity and 10 % of the acceleration, all filtered; the EMPS benchmark is "
    "published with 0.014 %, 0.23 %, 8.6 % and 5.8 % of the force."
)
"""Janot et al., instrumental variables for a SCARA robot; and the benchmark's own figures."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Judgement:
    """Joints by what is the matter with them, (n,) bool each.

    Attributes
    ----------
    joints, errors : names, and the errors that were judged.
    unlike : the control law's torque for the recorded positions is not the recorded torque.
    foreign : it is not by far: by more than a share of the terms that the law adds up. Where
        these nearly cancel (a law without reference velocity), 1 % of a gain may be 20 % of the
        torque; that alone accuses no controller.
    lost : the simulated position is further from the measured one than the reference.
    undecided : it is neither further nor nearer, or both distances may be noise.
    lacking : the simulated torque is off by more than noise, and significantly so.
    """

    joints: tuple[str, ...]
    errors: LoopErrors
    unlike: np.ndarray
    foreign: np.ndarray
    lost: np.ndarray
    undecided: np.ndarray
    lacking: np.ndarray

    @staticmethod
    def of(joints: tuple[str, ...], errors: LoopErrors, criteria: LoopCriteria) -> Judgement:
        """Return what is the matter with each joint of simulated loops.

        Parameters
        ----------
        joints, errors : names, and the errors to judge.
        criteria : what the errors mean.

        Returns
        -------
        One truth value for each joint and complaint.
        """
        own, reference = errors.own.joints, errors.without_model.joints
        noise = errors.noise.joints[3] if errors.noise is not None else np.zeros(len(joints))
        unlike = reference[3] > np.maximum(criteria.law_holds, criteria.law_noise * noise)
        terms = np.fmax(errors.law_terms, 1.0)
        encoder = errors.position_noise
        # Measured less simulated, and measured less reference: both hold the encoder's noise.
        far, near = (np.sqrt(np.fmax(x[0] ** 2 - encoder**2, 0.0)) for x in (own, reference))
        beyond = own[0] > criteria.same_as_noise * encoder
        lost = beyond & (far > criteria.further * near)
        excess = np.sqrt(np.fmax(own[3] ** 2 - noise**2, 0.0))
        beyond_noise = (noise > 0) & (own[3] > criteria.beyond_noise * noise)
        return Judgement(
            joints=joints,
            errors=errors,
            unlike=unlike,
            foreign=unlike & (reference[3] > criteria.law_holds * terms),
            lost=lost,
            undecided=~lost & ~(far < near),
            lacking=beyond_noise & (excess > criteria.relevant),
        )

    @property
    def verdict(self) -> Verdict:
        """Whether the loop is the recorded one, and says more of the motion than its reference."""
        if self.foreign.any():
            return "other_controller"
        return "no_nearer" if self.lost.any() else "follows"

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        match self.verdict:
            case "other_controller":
                return (
                    f"At {self._names(self.foreign)} the stated controller is not the one that "
                    "ran, or torque or reference are not what they are said to be."
                )
            case "no_nearer":
                cause = "the model is poor"
                if (self.lost & self.unlike).any():
                    cause += ", or controller or torque are not quite what they are said to be"
                return (
                    f"At {self._names(self.lost)} the simulated loop is no nearer to the "
                    f"measurement than the reference: {cause}."
                )
        off = f"its torque is {percent(self.errors.own.of('torque'))} off."
        if self.undecided.any():
            return (
                f"At {self._names(self.undecided)} it cannot be told whether the simulated loop is "
                "nearer to the measurement than the reference: they are about equally near, or "
                f"within the noise; {off}"
            )
        return (
            "At every joint the simulated loop is nearer to the measurement than the reference is; "
            + off
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What the verdict rests on, joint by joint, in plain words."""
        numbered = enumerate(self.joints)
        return tuple(f"{joint}: {one}" for j, joint in numbered for one in self._of_joint(j))

    def _of_joint(self, j: int) -> list[str]:
        errors, lines = self.errors, []
        law = percent(float(errors.without_model.joints[3, j]), 1)
        if self.foreign[j]:
            lines.append(
                "the stated control law, fed with the recorded positions, does not give the "
                f"recorded torque ({law} off): check gains, rate_hz, delay_s, limit, and the units "
                "of torque and reference."
            )
        elif self.lost[j]:
            own, reference = (e.joints[0, j] for e in (errors.own, errors.without_model))
            line = (
                f"the simulated position is {percent(own, 3)} off the measured one, the reference "
                f"{percent(reference, 3)}."
            )
            if not self.unlike[j]:
                line += (
                    f" The stated control law gives the recorded torque ({law} off): the model "
                    "does not respond as the robot does."
                )
            lines.append(line)
        if self.unlike[j] and not self.foreign[j]:
            share = percent(float(errors.without_model.joints[3, j] / errors.law_terms[j]), 1)
            lines.append(
                f"the stated control law misses the recorded torque by {law} of it. The law's "
                f"terms nearly cancel, and that is {share} of them: a gain that is a little off "
                "may be behind it, or a torque in another unit."
            )
        if errors.saturated[j] > 0:
            share = percent(float(errors.saturated[j]), 1)
            lines.append(
                f"the simulated command is at its limit for {share} of the samples; there the "
                "torque says nothing of the model."
            )
        if self.lacking[j] and errors.noise is not None:
            off = errors.own.joints[3, j]
            lines.append(
                f"the torque of the simulated loop is {percent(float(off), 1)} off, "
                f"{off / errors.noise.joints[3, j]:.3g} times the noise: the model lacks "
                "something (`dynident diagnose` looks for what), or the stated loop is not quite "
                "the recorded one."
            )
        return lines

    def _names(self, which: np.ndarray) -> str:
        return ", ".join(self.joints[j] for j in np.flatnonzero(which))
