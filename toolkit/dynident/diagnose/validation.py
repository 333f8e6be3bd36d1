"""What a simulation of the recorded loop says of a model: four errors, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from dynident.diagnose.diagnosis import finite
from dynident.tables import Table, number, percent, print_tables

Quantity = Literal["position", "velocity", "acceleration", "torque"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

Status = Literal["simulated", "no_reference", "too_short", "failed"]

ORIENTATION = (
    "For orientation: a two-link robot that was identified well came within 0.5 % of the position, "
    "5 % of the velocity and 10 % of the acceleration, all filtered; the EMPS benchmark is "
    "published with 0.014 %, 0.23 %, 8.6 % and 5.8 % of the force."
)
"""Janot et al., instrumental variables for a SCARA robot; and the benchmark's own figures."""

_SAME_AS_NOISE = 1.5
"""A difference up to so many times the noise may be the noise."""
_LAW_HOLDS = 0.2
"""Relative error up to which the stated control law is the one that ran."""


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


@dataclass(frozen=True, eq=False)
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
    """

    name: str
    t: np.ndarray
    measured: Signals
    simulated: Signals
    reference: Signals
    noise: np.ndarray | None
    saturated: np.ndarray


@dataclass(frozen=True)
class Skipped:
    """A recording whose loop was not simulated, and why.

    Attributes
    ----------
    name : of the recording.
    status : "no_reference" (it has no column q_ref), "too_short" (the loop settles after its end)
        or "failed" (the loop cannot be simulated).
    reason : in words.
    """

    name: str
    status: Status
    reason: str


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


@dataclass(frozen=True, eq=False)
class Validation:
    """A model in the closed loop in which it was measured.

    Attributes
    ----------
    joints, units, torque_units : names; rad or m; N m or N.
    controller : the loop's, in words.
    runs : recordings whose loop was simulated.
    skipped : recordings whose loop was not, and why.
    settling : s dropped at the start of each recording, where simulation and measurement still
        remember different beginnings: five time constants of the loop's slowest pole.
    noise_source : "replicates", "given" or "unknown".
    remarks : of the simulator.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    torque_units: tuple[str, ...]
    controller: str
    runs: tuple[LoopRun, ...]
    skipped: tuple[Skipped, ...]
    settling: float
    noise_source: Literal["replicates", "given", "unknown"]
    remarks: tuple[str, ...] = ()

    # --- numbers -------------------------------------------------------------------------------

    @property
    def errors(self) -> Errors:
        """The simulated loop against the measurement."""
        return self._errors([(r.simulated, r.measured) for r in self.runs])

    @property
    def without_model(self) -> Errors:
        """What no model is needed for, against the measurement.

        The reference in the place of the motion; in the place of the torque what the control law
        gives for the recorded positions.
        """
        return self._errors([(r.reference, r.measured) for r in self.runs])

    @property
    def tracking(self) -> Errors:
        """The simulated loop against the reference (torque: against that of the control law)."""
        return self._errors([(r.simulated, r.reference) for r in self.runs])

    @property
    def noise(self) -> Errors | None:
        """Noise of the measurement over the measurement; None where it is unknown."""
        if not self.runs or any(run.noise is None for run in self.runs):
            return None
        square = sum(len(r.t) * np.asarray(r.noise) ** 2 for r in self.runs)
        return self._relative(np.asarray(square), self._power())

    @property
    def saturated(self) -> np.ndarray:
        """Share of all samples at which each joint's simulated command was at its limit, (n,)."""
        if not self.runs:
            return np.zeros(len(self.joints))
        shares = [run.saturated for run in self.runs]
        return np.average(shares, axis=0, weights=[len(run.t) for run in self.runs])

    def error_of(self, run: LoopRun) -> Errors:
        """The simulated loop against the measurement, in one recording."""
        return self._errors([(run.simulated, run.measured)])

    def _errors(self, pairs: list[tuple[Signals, Signals]]) -> Errors:
        square, power = np.zeros((2, len(QUANTITIES), len(self.joints)))
        for i, quantity in enumerate(QUANTITIES):
            for found, wanted in pairs:
                square[i] += np.sum((found.of(quantity) - wanted.of(quantity)) ** 2, axis=0)
                power[i] += np.sum(wanted.of(quantity) ** 2, axis=0)
        return self._relative(square, power)

    def _power(self) -> np.ndarray:
        return np.array(
            [sum(np.sum(r.measured.of(one) ** 2, axis=0) for r in self.runs) for one in QUANTITIES]
        )

    def _relative(self, square: np.ndarray, power: np.ndarray) -> Errors:
        """Errors from sums of squares, (4, n) each."""
        with np.errstate(divide="ignore", invalid="ignore"):
            joints = np.where(power > 0, np.sqrt(square / power), np.nan)
            together = np.sqrt(square.sum(axis=1) / power.sum(axis=1))
        together = np.where(power.sum(axis=1) > 0, together, np.nan)
        if len(set(self.units)) > 1:
            known = np.isfinite(joints)
            count = np.maximum(known.sum(axis=1), 1)
            mean = np.where(known, joints, 0.0) ** 2
            together = np.where(known.any(axis=1), np.sqrt(mean.sum(axis=1) / count), np.nan)
        return Errors(joints, together)

    # --- words ---------------------------------------------------------------------------------

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        found: list[Table | str] = []
        if self.runs:
            found += [self.error_table(), self.yardstick_table()]
        if self.skipped or len(self.runs) > 1:
            found.append(self.recording_table())
        return (*found, *self.notes)

    def show(self) -> None:
        """Print the four errors, what to hold them against, and what they mean."""
        print_tables(*self.tables())

    def error_table(self) -> Table:
        """The four errors of each joint."""
        columns = ("joint", *QUANTITIES, *(("at the limit",) if self.saturated.any() else ()))
        rows = []
        for j, joint in enumerate(self.joints):
            limit = (percent(float(self.saturated[j]), 1),) if self.saturated.any() else ()
            rows.append((joint, *_percents(self.errors.joints[:, j]), *limit))
        rows.append(("all", *_percents(self.errors.overall), *[""][: len(columns) - 5]))
        note = (
            f"{self.controller}. Norm of simulated less measured over norm of measured, both "
            f"through the same filter, after {number(self.settling, 2)} s for the loop to settle."
        )
        title = "Simulated in closed loop, against the measurement"
        return Table(title, columns, tuple(rows), (note,))

    def yardstick_table(self) -> Table:
        """What the errors are to be held against: the reference, the control law, the noise."""
        without, noise = self.without_model, self.noise
        rows = []
        for j, joint in enumerate((*self.joints, "all")):
            cells = [without.overall if joint == "all" and j == len(self.joints) else
                     without.joints[:, j]]  # fmt: skip
            if noise is not None:
                cells.append(noise.overall if j == len(self.joints) else noise.joints[:, j])
            for what, values in zip(("without a model", "noise"), cells, strict=False):
                rows.append((joint, what, *_percents(values)))
        notes = [
            "Without a model: the reference taken for the motion, and the torque that the control "
            "law gives for the recorded positions.",
            {
                "replicates": "Noise: measured, from the repeated periods.",
                "given": "Noise: as stated, through the same filter.",
                "unknown": "The noise is unknown: nothing repeats and none is stated.",
            }[self.noise_source],
        ]
        title = "To hold them against"
        return Table(title, ("joint", "", *QUANTITIES), tuple(rows), tuple(notes))

    def recording_table(self) -> Table:
        """Errors of each recording, and the recordings without."""
        rows = [(r.name, "simulated", *_percents(self.error_of(r).overall)) for r in self.runs]
        rows += [(s.name, s.status.replace("_", " "), *[""] * 4) for s in self.skipped]
        notes = tuple(f"{one.name}: {one.reason}." for one in self.skipped)
        return Table("Recordings", ("recording", "status", *QUANTITIES), tuple(rows), notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the errors mean, in plain words."""
        if not self.runs:
            return ("No loop could be simulated.", *self.remarks)
        found = [s for j in range(len(self.joints)) if (s := self._sentence(j))]
        if not found:
            found.append(
                "At every joint the simulated loop is nearer to the measurement than the reference "
                "is, or within the noise: model and controller account for how the robot follows."
            )
        for joint, share in zip(self.joints, self.saturated, strict=True):
            if share > 0:
                found.append(
                    f"{joint}: the simulated command is at its limit for {percent(share, 1)} of "
                    "the samples; there the torque says nothing of the model."
                )
        return (*found, ORIENTATION, *self.remarks)

    def _sentence(self, j: int) -> str:
        """What is wrong at a joint; empty where nothing is."""
        joint, own = self.joints[j], self.errors.joints[0, j]
        reference = self.without_model.joints[0, j]
        noise = 0.0 if self.noise is None else self.noise.joints[0, j]
        if not own >= reference or own <= _SAME_AS_NOISE * noise:
            return ""
        found = (
            f"{joint}: the simulated position is no nearer to the measured one than the reference "
            f"is ({percent(own, 3)} against {percent(reference, 3)})"
        )
        law = self.without_model.joints[3, j]
        if not law <= _LAW_HOLDS:
            return (
                f"{found}, and the stated control law does not give the recorded torque "
                f"({percent(law, 1)} off): another controller ran, with other gains or a delay, or "
                "torque or reference are recorded in other units."
            )
        return (
            f"{found}, though the stated control law gives the recorded torque ({percent(law, 1)} "
            "off): the model is poor."
        )

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `simulate --json`; numbers that are not known are null."""
        without, tracking, noise = self.without_model, self.tracking, self.noise
        known = bool(self.runs)
        return {
            "controller": self.controller,
            "settling_s": finite(self.settling),
            "noise": {
                "source": self.noise_source,
                "error": noise.to_dict() if noise else None,
            },
            "error": self.errors.to_dict() if known else None,
            "without_model": without.to_dict() if known else None,
            "tracking": tracking.to_dict() if known else None,
            "joints": [
                {
                    "name": joint,
                    "error": self.errors.at(j),
                    "without_model": without.at(j),
                    "tracking": tracking.at(j),
                    "noise": noise.at(j) if noise else None,
                    "saturated": float(self.saturated[j]),
                }
                for j, joint in enumerate(self.joints if known else ())
            ],
            "recordings": [
                *(
                    {
                        "name": run.name,
                        "status": "simulated",
                        "reason": None,
                        "error": self.error_of(run).to_dict(),
                        "saturated": [float(x) for x in run.saturated],
                    }
                    for run in self.runs
                ),
                *(
                    {
                        "name": one.name,
                        "status": one.status,
                        "reason": one.reason,
                        "error": None,
                        "saturated": None,
                    }
                    for one in self.skipped
                ),
            ],
            "notes": list(self.notes),
        }


def _named(values: np.ndarray) -> dict[str, float | None]:
    return {one: finite(float(x)) for one, x in zip(QUANTITIES, values, strict=True)}


def _percents(values: np.ndarray) -> tuple[str, ...]:
    # Position errors are small: three decimals tell 0.014 % from 0.01 %.
    return tuple(
        percent(float(x), 3 if one == "position" else 2)
        for one, x in zip(QUANTITIES, values, strict=True)
    )
