"""What a simulation of the recorded loop says of a model: four errors, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from dynident.fitting.estimate import DataSource
from dynident.recording.dataset import NoiseSource
from dynident.tables import Table, number, percent, print_tables
from dynident.validation.loop_run import QUANTITIES, Errors, LoopRun, Signals, Skipped
from dynident.validation.loop_verdict import Judgement, judge, notes, sentence

Verdict = Literal["follows", "no_nearer", "other_controller", "not_simulated"]


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
    sources: tuple[DataSource, ...] = ()
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
    def law_terms(self) -> np.ndarray:
        """Terms that the control law adds up over the measured torque, (n,)."""
        return self._mean(np.array([run.law_terms for run in self.runs]), 3)

    @cached_property
    def position_noise(self) -> np.ndarray:
        """Noise of the measured position over the position, (n,).

        That of the encoder alone, measured, where no noise is known.
        """
        if self.noise is not None:
            return self.noise.joints[0]
        return self._mean(np.array([run.encoder_noise for run in self.runs]), 0)

    def _mean(self, rms: np.ndarray, quantity: int) -> np.ndarray:
        """Root mean square over the recordings of (runs, n), over the measurement, (n,)."""
        square = np.zeros((len(QUANTITIES), len(self.joints)))
        for run, one in zip(self.runs, rms, strict=True):
            square[quantity] += len(run.t) * one**2
        return self._relative(square, self._power()).joints[quantity]

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
        power = np.zeros((len(QUANTITIES), len(self.joints)))
        for run in self.runs:
            power += [np.sum(run.measured.of(one) ** 2, axis=0) for one in QUANTITIES]
        return power

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
            f"through the same filter. {self._rows_words()}"
        )
        title = "Simulated in closed loop, against the measurement"
        return Table(title, columns, tuple(rows), (note,))

    def _rows_words(self) -> str:
        if not self.runs:
            return "There are no rows."
        spans = [(float(run.t[0]), float(run.t[-1])) for run in self.runs]
        first, last = min(a for a, _ in spans), max(b for _, b in spans)
        most = ("", "") if len(set(spans)) == 1 else (" at the earliest", " at the latest")
        return (
            f"Rows from {first:.4g} s{most[0]} to {last:.4g} s{most[1]}: left out are the first "
            f"{number(self.settling, 2)} s, in which the loop settles, the ends of a record, where "
            "the filter makes up what it does not know, and what is not in a window."
        )

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
        notes = tuple(
            f"{one.name}: {one.reason}" + "." * (one.reason[-1:] not in ("?", "."))
            for one in self.skipped
        )
        return Table("Recordings", ("recording", "status", *QUANTITIES), tuple(rows), notes)

    @property
    def verdict(self) -> Verdict:
        """Whether the loop is the recorded one, and tells more of the motion than its reference."""
        if not self.runs:
            return "not_simulated"
        if self.judgement.foreign.any():
            return "other_controller"
        return "no_nearer" if self.judgement.lost.any() else "follows"

    @cached_property
    def judgement(self) -> Judgement:
        """What is the matter with each joint."""
        return judge(self)

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        return sentence(self)

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentence, and what it rests on, in plain words."""
        return notes(self)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `simulate --json`; numbers that are not known are null."""
        # Imported where it is used: that module knows this class.
        from dynident.validation.loop_json import validation_json

        return validation_json(self)


def _percents(values: np.ndarray) -> tuple[str, ...]:
    # Position errors are small: three decimals tell 0.014 % from 0.01 %.
    return tuple(
        percent(float(x), 3 if one == "position" else 2)
        for one, x in zip(QUANTITIES, values, strict=True)
    )
