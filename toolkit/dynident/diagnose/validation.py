"""What a simulation of the recorded loop says of a model: four errors, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from dynident.diagnose.diagnosis import NoiseSource
from dynident.diagnose.loop_run import QUANTITIES, Errors, LoopRun, Signals, Skipped
from dynident.fit.estimate import Source
from dynident.tables import Table, number, percent, print_tables

Verdict = Literal["follows", "no_nearer", "other_controller", "not_simulated"]

ORIENTATION = (
    "For orientation: a two-link robot that was identified well came within 0.5 % of the position, "
    "5 % of the velocity and 10 % of the acceleration, all filtered; the EMPS benchmark is "
    "published with 0.014 %, 0.23 %, 8.6 % and 5.8 % of the force."
)
"""Janot et al., instrumental variables for a SCARA robot; and the benchmark's own figures."""

_SAME_AS_NOISE = 1.5
"""A difference up to so many times the noise may be the noise."""
_BEYOND_NOISE = 3.0
"""Torque error over its noise above which something is missing."""
_LAW_HOLDS = 0.2
_LAW_NOISE = 3.0
"""Relative error, and multiple of the noise, up to which the stated control law may have run."""


@dataclass(frozen=True)
class Unsimulated:
    """Why no loop of a study was simulated, in words."""

    reason: str


@dataclass(frozen=True, eq=False)
class Validation:
    """A model in the closed loop in which it was measured.

    Attributes
    ----------
    robot : name.
    joints, units, torque_units : names; rad or m; N m or N.
    controller : the loop's, in words.
    runs : recordings whose loop was simulated.
    skipped : recordings whose loop was not, and why.
    settling : s dropped at the start of a recording (at most), where simulation and measurement
        still remember different beginnings: five to ten time constants of the loop.
    noise_source : "replicates", "given" or "unknown".
    sources : the recordings.
    remarks : of the simulator.
    """

    robot: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    torque_units: tuple[str, ...]
    controller: str
    runs: tuple[LoopRun, ...]
    skipped: tuple[Skipped, ...]
    settling: float
    noise_source: NoiseSource
    sources: tuple[Source, ...] = ()
    remarks: tuple[str, ...] = ()

    # --- numbers -------------------------------------------------------------------------------

    @cached_property
    def errors(self) -> Errors:
        """The simulated loop against the measurement."""
        return self._errors([(r.simulated, r.measured) for r in self.runs])

    @cached_property
    def without_model(self) -> Errors:
        """What no model is needed for, against the measurement.

        The reference in the place of the motion; in the place of the torque what the control law
        gives for the recorded positions.
        """
        return self._errors([(r.reference, r.measured) for r in self.runs])

    @cached_property
    def tracking(self) -> Errors:
        """The simulated loop against the reference (torque: against that of the control law)."""
        return self._errors([(r.simulated, r.reference) for r in self.runs])

    @cached_property
    def noise(self) -> Errors | None:
        """Noise of the measurement over the measurement; None where it is unknown."""
        if not self.runs or any(run.noise is None for run in self.runs):
            return None
        square = sum(len(r.t) * np.asarray(r.noise) ** 2 for r in self.runs)
        return self._relative(np.asarray(square), self._power())

    @cached_property
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
    def verdict(self) -> Verdict:
        """Whether the loop is the recorded one, and tells more of the motion than its reference."""
        if not self.runs:
            return "not_simulated"
        if self._foreign.any():
            return "other_controller"
        return "no_nearer" if self._lost.any() else "follows"

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        off = percent(self.errors.of("torque"))
        match self.verdict:
            case "not_simulated":
                return "No loop could be simulated."
            case "other_controller":
                return (
                    f"At {self._names(self._foreign)} the stated controller is not the one that "
                    "ran, or torque or reference are not what they are said to be."
                )
            case "no_nearer":
                return (
                    f"At {self._names(self._lost)} the simulated loop is no nearer to the "
                    "measurement than the reference: the model is poor."
                )
        return (
            "At every joint the simulated loop is nearer to the measurement than the reference is, "
            f"or within the noise; its torque is {off} off."
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentence, and what it rests on, in plain words."""
        found = [self.sentence]
        for j, joint in enumerate(self.joints if self.runs else ()):
            law = percent(float(self.without_model.joints[3, j]), 1)
            own, reference = (e.joints[0, j] for e in (self.errors, self.without_model))
            if self._foreign[j]:
                found.append(
                    f"{joint}: the stated control law, fed with the recorded positions, does not "
                    f"give the recorded torque ({law} off): check gains, rate_hz, delay_s, limit, "
                    "and the units of torque and reference."
                )
            elif self._lost[j]:
                found.append(
                    f"{joint}: the simulated position is {percent(own, 3)} off the measured one, "
                    f"the reference {percent(reference, 3)}. The stated control law gives the "
                    f"recorded torque ({law} off): the model does not respond as the robot does."
                )
            if self.saturated[j] > 0:
                found.append(
                    f"{joint}: the simulated command is at its limit for "
                    f"{percent(float(self.saturated[j]), 1)} of the samples; there the torque says "
                    "nothing of the model."
                )
            if (ratio := self._torque_ratios()[j]) > _BEYOND_NOISE:
                found.append(
                    f"{joint}: the torque of the simulated loop is off by {ratio:.3g} times the "
                    "noise; `dynident diagnose` looks for what the model lacks."
                )
        return (*found, *((ORIENTATION,) if self.runs else ()), *self.remarks)

    def _names(self, which: np.ndarray) -> str:
        return ", ".join(self.joints[j] for j in np.flatnonzero(which))

    def _of_noise(self, row: int) -> np.ndarray:
        """Relative noise of one quantity, (n,); zero where it is unknown."""
        return np.zeros(len(self.joints)) if self.noise is None else self.noise.joints[row]

    @cached_property
    def _foreign(self) -> np.ndarray:
        """Joints at which the control law is not the one that made the torque, (n,) bool."""
        return self.without_model.joints[3] > np.maximum(_LAW_HOLDS, _LAW_NOISE * self._of_noise(3))

    @cached_property
    def _lost(self) -> np.ndarray:
        """Joints whose simulated position is no better than the reference, noise aside, (n,)."""
        own, reference = self.errors.joints[0], self.without_model.joints[0]
        return (own >= reference) & (own > _SAME_AS_NOISE * self._of_noise(0))

    def _torque_ratios(self) -> np.ndarray:
        """Torque error of each joint over its noise, (n,); zero where the noise is unknown."""
        noise = self._of_noise(3)
        return np.nan_to_num(self.errors.joints[3] / np.where(noise > 0, noise, np.inf))

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `simulate --json`; numbers that are not known are null."""
        # Imported where it is used: that module knows this class.
        from dynident.diagnose.loop_json import validation_json

        return validation_json(self)


def _percents(values: np.ndarray) -> tuple[str, ...]:
    # Position errors are small: three decimals tell 0.014 % from 0.01 %.
    return tuple(
        percent(float(x), 3 if one == "position" else 2)
        for one, x in zip(QUANTITIES, values, strict=True)
    )
