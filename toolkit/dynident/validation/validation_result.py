"""What a simulation of the recorded loop says of a model: four errors, and what they mean."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from dynident.criteria import DEFAULTS, LoopCriteria
from dynident.fitting.estimate import DataSource
from dynident.recording.dataset import NoiseSource
from dynident.tables import Shown, Table, finite, number, percent
from dynident.validation.loop_errors import QUANTITIES, Errors, LoopErrors, LoopRun
from dynident.validation.loop_verdict import ORIENTATION, Judgement, Verdict

Status = Literal["no_reference", "too_short", "failed"]


@dataclass(frozen=True)
class Unsimulated:
    """Why no loop of a study was simulated, in words."""

    reason: str

    def brief_dict(self) -> dict[str, Any]:
        """The JSON of `compare --json`, as `Validation.brief_dict`."""
        return {"verdict": "not_simulated", "reason": self.reason, "error": None, "joints": None}


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


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Validation(Shown):
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
    criteria : what the errors mean.
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
    criteria: LoopCriteria = DEFAULTS.loops

    @cached_property
    def _numbers(self) -> LoopErrors:
        return LoopErrors.of(self.runs, self.units)

    @property
    def errors(self) -> Errors:
        """The simulated loop against the measurement."""
        return self._numbers.own

    @property
    def without_model(self) -> Errors:
        """The reference, and the torque of the control law, against the measurement."""
        return self._numbers.without_model

    @property
    def tracking(self) -> Errors:
        """The simulated loop against the reference (torque: against that of the control law)."""
        return self._numbers.tracking

    @property
    def noise(self) -> Errors | None:
        """Noise of the measurement over the measurement; None where it is unknown."""
        return self._numbers.noise

    @property
    def saturated(self) -> np.ndarray:
        """Share of all samples at which each joint's simulated command was at its limit, (n,)."""
        return self._numbers.saturated

    def error_of(self, run: LoopRun) -> Errors:
        """The simulated loop against the measurement, in one recording."""
        return Errors.between([(run.simulated, run.measured)], self.units)

    @cached_property
    def judgement(self) -> Judgement:
        """What is the matter with each joint."""
        return Judgement.of(self.joints, self._numbers, self.criteria)

    @property
    def verdict(self) -> Verdict:
        """Whether the loop is the recorded one, and says more of the motion than its reference."""
        return self.judgement.verdict if self.runs else "not_simulated"

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        return self.judgement.sentence if self.runs else "No loop could be simulated."

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentence, and what it rests on, in plain words."""
        rests_on = (*self.judgement.notes, ORIENTATION) if self.runs else ()
        return (self.sentence, *rests_on, *self.remarks)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        found: list[Table | str] = []
        if self.runs:
            found += [self.error_table(), self.yardstick_table()]
        if self.skipped or len(self.runs) > 1:
            found.append(self.recording_table())
        return (*found, *self.notes)

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

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `simulate --json`; numbers that are not known are null."""
        without, tracking, noise = self.without_model, self.tracking, self.noise
        known = bool(self.runs)
        return {
            "verdict": self.verdict,
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

    def brief_dict(self) -> dict[str, Any]:
        """The JSON of `compare --json`: verdict and errors."""
        return {
            "verdict": self.verdict,
            "reason": None,
            "error": self.errors.to_dict(),
            "joints": [{"name": name, **self.errors.at(j)} for j, name in enumerate(self.joints)],
        }


Loop = Validation | Unsimulated | None
"""Of one of several models; None where there is no loop to simulate."""


def loop_table(
    names: tuple[str, ...], loops: tuple[Loop, ...], joints: tuple[str, ...]
) -> Table | None:
    """Errors of torque and position of several models in closed loop.

    Parameters
    ----------
    names, loops : of the models, in one order.
    joints : names.

    Returns
    -------
    Two columns a model; None where there is no loop.
    """
    if all(loop is None for loop in loops):
        return None
    alone = len(names) == 1
    columns = ["joint"]
    for name in names:
        prefix = "in loop" if alone else f"{name}"
        columns += [f"{prefix}: torque", f"{prefix}: position"]
    rows = []
    for j, joint in enumerate((*joints, "all")):
        cells = [joint]
        for loop in loops:
            if not isinstance(loop, Validation):
                cells += ["-", "-"]
                continue
            errors = loop.errors.overall if j == len(joints) else loop.errors.joints[:, j]
            cells += [percent(float(errors[3])), percent(float(errors[0]), 3)]
        rows.append(tuple(cells))
    return Table("Simulated in closed loop", tuple(columns), tuple(rows), _notes(names, loops))


def _notes(names: tuple[str, ...], loops: tuple[Loop, ...]) -> tuple[str, ...]:
    found = []
    for name, loop in zip(names, loops, strict=True):
        whose = "In loop" if len(names) == 1 else name
        if isinstance(loop, Unsimulated):
            found.append(f"{whose}: not simulated. {loop.reason}.")
        elif loop is not None:
            if loop.verdict != "follows":
                found.append(f"{whose}: {loop.sentence}")
            found += [f"{whose}: {one.name} left out: {one.reason}." for one in loop.skipped]
    return tuple(found)


def _percents(values: np.ndarray) -> tuple[str, ...]:
    # Position errors are small: three decimals tell 0.014 % from 0.01 %.
    return tuple(
        percent(float(x), 3 if one == "position" else 2)
        for one, x in zip(QUANTITIES, values, strict=True)
    )
