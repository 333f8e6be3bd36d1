"""A recorded loop and its simulation side by side, and how far apart they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from dynident.tables import finite

Quantity = Literal["position", "velocity", "acceleration", "torque"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)


@dataclass(frozen=True, eq=False)
class Signals:
    """A motion and its torque, filtered and decimated, (T, n) each, SI units.

    Attributes
    ----------
    position, velocity, acceleration : rad or m, and per s and s^2.
    torque : N m or N.
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray

    def of(self, quantity: Quantity) -> np.ndarray:
        """One of them, (T, n)."""
        return getattr(self, quantity)

    def stacked(self) -> np.ndarray:
        """All of them in the order of `QUANTITIES`, (4, T, n)."""
        return np.stack([self.of(quantity) for quantity in QUANTITIES])


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopRun:
    """A recording and the simulation of its loop, at the same instants.

    Attributes
    ----------
    name : of the recording.
    t : (T,) s, on the recording's clock.
    measured, simulated : what was recorded, and what the identified robot did.
    reference : the reference motion; its torque is what the control law gives for the recorded
        positions, no model of the robot involved.
    noise : (4, n) noise of the measured quantities, rms; None where it is unknown.
    saturated : (n,) share of the samples at which the simulated command was at its limit.
    law_terms : (n,) N m or N, what the gains of the control law make of the errors, each on its
        own: root of the sum of their mean squares. Larger than the torque where they cancel.
    encoder_noise : (n,) rad or m, rms; from what the simulation leaves of the measured positions.
    """

    name: str
    t: np.ndarray
    measured: Signals
    simulated: Signals
    reference: Signals
    noise: np.ndarray | None
    saturated: np.ndarray
    law_terms: np.ndarray
    encoder_noise: np.ndarray


@dataclass(frozen=True, eq=False)
class Errors:
    """Norm of a difference over norm of the measurement, over all recordings.

    Attributes
    ----------
    joints : (4, n) joint by joint, rows in the order of `QUANTITIES`; NaN where a joint has no
        such quantity to measure.
    overall : (4,) of all joints together; where some are in rad and others in m, the root mean
        square of the joints' errors.
    """

    joints: np.ndarray
    overall: np.ndarray

    def of(self, quantity: Quantity) -> float:
        """The error over all joints in one quantity."""
        return float(self.overall[QUANTITIES.index(quantity)])

    def at(self, joint: int) -> dict[str, float | None]:
        """Errors of a joint by quantity, as JSON has them."""
        return _named(self.joints[:, joint])

    def to_dict(self) -> dict[str, float | None]:
        """Errors over all joints by quantity, as JSON has them."""
        return _named(self.overall)

    @staticmethod
    def between(pairs: Sequence[tuple[Signals, Signals]], units: tuple[str, ...]) -> Errors:
        """Errors of signals against others, which are the measure, over all pairs."""
        square, power = np.zeros((2, len(QUANTITIES), len(units)))
        for found, wanted in pairs:
            square += np.sum((found.stacked() - wanted.stacked()) ** 2, axis=1)
            power += np.sum(wanted.stacked() ** 2, axis=1)
        return Errors.of_squares(square, power, units)

    @staticmethod
    def of_squares(square: np.ndarray, power: np.ndarray, units: tuple[str, ...]) -> Errors:
        """Errors from sums of squares.

        Parameters
        ----------
        square, power : (4, n) of the differences, and of what they are held against.
        units : (n,) of the joints' positions.

        Returns
        -------
        Roots of their ratios; NaN where the power is zero.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            joints = np.where(power > 0, np.sqrt(square / power), np.nan)
            together = np.sqrt(square.sum(axis=1) / power.sum(axis=1))
        together = np.where(power.sum(axis=1) > 0, together, np.nan)
        if len(set(units)) > 1:
            known = np.isfinite(joints)
            count = np.maximum(known.sum(axis=1), 1)
            mean = np.where(known, joints, 0.0) ** 2
            together = np.where(known.any(axis=1), np.sqrt(mean.sum(axis=1) / count), np.nan)
        return Errors(joints, together)


@dataclass(frozen=True, eq=False, kw_only=True)
class LoopErrors:
    """The errors of simulated loops, and what they are to be held against.

    Attributes
    ----------
    own : the simulated loop against the measurement.
    without_model : what no model is needed for, against the measurement: the reference in the
        place of the motion; in the place of the torque what the control law gives for the
        recorded positions.
    tracking : the simulated loop against the reference (torque: against that of the control law).
    noise : of the measurement over the measurement; None where it is unknown.
    law_terms : (n,) terms that the control law adds up over the measured torque.
    position_noise : (n,) noise of the measured position over the position; that of the encoder
        alone, measured, where no noise is known.
    saturated : (n,) share of all samples at which the simulated command was at its limit.
    """

    own: Errors
    without_model: Errors
    tracking: Errors
    noise: Errors | None
    law_terms: np.ndarray
    position_noise: np.ndarray
    saturated: np.ndarray

    @staticmethod
    def of(runs: Sequence[LoopRun], units: tuple[str, ...]) -> LoopErrors:
        """Errors over all runs; units (n,) of the joints' positions. NaN where there is no run."""
        counts = [len(run.t) for run in runs]
        nothing = np.zeros((len(QUANTITIES), len(units)))
        power = sum((np.sum(run.measured.stacked() ** 2, axis=1) for run in runs), nothing)

        def relative(rms: list[np.ndarray]) -> Errors:
            """Errors from a root mean square, (4, n) or (n,), of each run."""
            squares = (k * np.asarray(x) ** 2 for k, x in zip(counts, rms, strict=True))
            return Errors.of_squares(sum(squares, nothing), power, units)

        known = [run.noise for run in runs if run.noise is not None]
        noise = relative(known) if runs and len(known) == len(runs) else None
        encoder = relative([run.encoder_noise for run in runs]) if noise is None else noise
        return LoopErrors(
            own=Errors.between([(run.simulated, run.measured) for run in runs], units),
            without_model=Errors.between([(run.reference, run.measured) for run in runs], units),
            tracking=Errors.between([(run.simulated, run.reference) for run in runs], units),
            noise=noise,
            law_terms=relative([run.law_terms for run in runs]).joints[3],
            position_noise=encoder.joints[0],
            saturated=np.average([run.saturated for run in runs], axis=0, weights=counts)
            if runs
            else np.zeros(len(units)),
        )


def _named(values: np.ndarray) -> dict[str, float | None]:
    return {one: finite(float(x)) for one, x in zip(QUANTITIES, values, strict=True)}
