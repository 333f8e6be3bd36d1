"""A designed recording: the motion, what it is predicted to tell, margins, and its files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dynident.closed_loop import Trajectory
from dynident.experiment_design.design_task import DesignTask
from dynident.experiment_design.motion_limits import MotionLimits
from dynident.experiment_design.motion_program import FINER, MotionProgram
from dynident.experiment_design.motion_solver import DesignedMotion
from dynident.experiment_design.telling.separation import NEVER, Separation
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.tables import Shown, Table, number, percent

_CAVEAT = (
    "Predicted from the training recordings, as if the residual of the fit, with all that the "
    "model lacks, were noise, and rows independent."
)


@dataclass(frozen=True, kw_only=True)
class LoadTried:
    """A load that the last link may carry in a recording.

    Attributes
    ----------
    mass : kg.
    tells : as `RecordingDesign.tells`; None where no motion was found.
    why : that is so.
    """

    mass: float
    tells: tuple[int, float] | None = None
    why: str = ""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class RecordingDesign(Shown):
    """The answer of `design`.

    Attributes
    ----------
    task : what it is for.
    model : whose parameters it tells.
    limits : that it keeps.
    program : that was solved.
    motion : what came out.
    usual : a random motion within the same limits, the median of twenty.
    estimate : of the recordings so far; where effects are to be told apart, with the first.
    labels : of what is told, those of interest last.
    separations : of the effects to be told apart, a group each; none for another task.
    loads_tried : each of several loads.
    """

    task: DesignTask
    model: Model
    limits: MotionLimits
    program: MotionProgram
    motion: DesignedMotion
    usual: np.ndarray
    estimate: Estimate
    labels: tuple[str, ...]
    separations: tuple[Separation, ...] = ()
    loads_tried: tuple[LoadTried, ...] = ()

    @property
    def trajectory(self) -> Trajectory:
        """One repetition."""
        return self.program.motions.trajectory(self.motion.variables)

    def sigma(self, variables: np.ndarray | None) -> np.ndarray:
        """Standard deviations of what is of interest, with those of the recordings so far.

        Parameters
        ----------
        variables : of a motion; None for the recordings so far alone.

        Returns
        -------
        (last,) in units of the parameters; infinite where nothing shows one.
        """
        information = self.program.information
        found = np.zeros_like(information.prior)
        if variables is not None:
            found = self.program.told(information, variables)
        return information.sigma(found)

    @property
    def tells(self) -> tuple[int, float]:
        """How much it tells: of two designs for one task, the larger one tells more.

        How many parameters, and one over the geometric mean of their standard deviations; of
        effects to be told apart, how many groups, and the standard deviations between those that
        are least apart; groups that no motion tells do not count.
        """
        if self.separations:
            told = [one.designed for one in self.separations if one.designed > NEVER]
            return len(told), min(told, default=0.0)
        after = self.sigma(self.motion.variables)
        seen = np.isfinite(after)
        return int(seen.sum()), 1.0 / _mean(after)

    @property
    def sentence(self) -> str:
        """What the recording is worth, in plain words."""
        carried = f" The last link carries {self.task.load:g} kg." if self.task.load else ""
        return f"{self._sentence}{carried}"

    @property
    def _sentence(self) -> str:
        length = self.task.duration * self.task.repeat
        if self.separations:
            return " ".join(one.sentence(length) for one in self.separations)
        before, after, usual = (self.sigma(x) for x in (None, self.motion.variables, self.usual))
        names = self.labels[len(self.labels) - len(after) :]
        seen = np.isfinite(after)
        shares = np.where(seen, after, 0.0) / np.where(seen, usual, 1.0)
        worst = int(np.argmax(shares))
        whose = self.task.of_what and f" of the parameters of {self.task.of_what}"
        told = (
            f"With {length:g} s of this the standard deviations{whose} are "
            f"{percent(_mean(shares), 0)} of those with a usual motion of that length (geometric "
            f"mean; the worst, {names[worst]}, {percent(float(shares[worst]), 0)})"
        )
        both = seen & np.isfinite(before)
        if np.any(both):
            told += f", and {percent(_mean(after[both] / before[both]), 0)} of what they are now"
        hidden = ", ".join(name for name, one in zip(names, seen, strict=True) if not one)
        return f"{told}." + (f" No motion tells on its own: {hidden}." if hidden else "")

    def sigma_table(self) -> Table:
        """Standard deviations: so far, with the design, with a usual motion."""
        last = self.program.information.last
        columns = [self.sigma(x) for x in (None, self.motion.variables, self.usual)]
        rows = tuple(
            (name, *(number(float(one[k]), 3) for one in columns))
            for k, name in enumerate(self.labels[-last:])
        )
        heads = ("parameter", "sigma so far", "with this", "with a usual motion")
        return Table("Predicted standard deviations", heads, rows)

    def limit_table(self) -> Table:
        """Largest share of each limit that the motion uses, on a fine grid."""
        program, limits = self.program, self.limits
        t = program.motions.times(FINER * program.instants)
        q, v, a = self.trajectory.at(t)
        rates = {"speed": (v, limits.speed), "acceleration": (a, limits.acceleration)}
        if limits.jerk_limited.any():
            whole = program.motions.to_the_end(len(t))
            rates["jerk"] = program.motions.jerk(self.motion.variables, whole), limits.jerk
        rates["torque"] = program.torque.farthest(t, q, v, a), limits.torque
        rows = []
        for j, (name, unit) in enumerate(
            zip(self.model.robot.names, self.model.robot.units, strict=True)
        ):
            span = limits.upper[j] - limits.lower[j]
            room = min(q[:, j].min() - limits.lower[j], limits.upper[j] - q[:, j].max())
            ends = (number(float(one), 3) for one in (q[:, j].min(), q[:, j].max()))
            shares = (
                percent(float(np.abs(signal[:, j]).max() / limit[j]), 0)
                if np.isfinite(limit[j])
                else "no limit"
                for signal, limit in rates.values()
            )
            moves = f"{' to '.join(ends)} {unit}"
            rows.append((name, moves, percent(float(room / span), 0), *shares))
        heads = ("joint", "moves", "room left", *rates)
        return Table("Shares of the limits that the motion uses", heads, tuple(rows))

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        tail = (_CAVEAT, self.motion.ended_in_words)
        told = () if self.separations else (self.sigma_table(),)
        near = () if self.least_distance is None else (self._clear_in_words(),)
        loads = (self.load_table(),) if self.loads_tried else ()
        return (self.sentence, *loads, *told, self.limit_table(), *near, *tail)

    def load_table(self) -> Table:
        """The loads that were tried, and what the recording tells with each."""
        count, best = self.tells
        rows = []
        for one in self.loads_tried:
            if one.tells is None:
                words = one.why
            elif self.separations:
                words = number(one.tells[1], 3)
            else:
                words = percent(best / one.tells[1], 0)
            if one.tells is not None and one.tells[0] < count:
                words += f", and {count - one.tells[0]} not at all"
            rows.append((f"{one.mass:g}", words))
        told = "sigma, over those of this design (geometric mean)"
        if self.separations:
            told = "standard deviations apart"
        return Table("Loads on the last link", ("load, kg", told), tuple(rows))

    @cached_property
    def least_distance(self) -> float | None:
        """Least distance between links on a fine grid, m; None where it is not looked at.

        What is a decimetre beyond the clearance that was asked for is that far.
        """
        clearance = self.program.workspace.clearance
        if clearance is None:
            return None
        t = self.program.motions.times(FINER * self.program.instants)
        return float(clearance.along(self.trajectory.at(t)[0]).min())

    def _clear_in_words(self) -> str:
        clearance, least = self.program.workspace.clearance, self.least_distance
        assert clearance is not None and least is not None
        around = " and from the obstacles" if self.limits.obstacles else ""
        words = (
            f"By the collision geometry of the description the links stay {1000 * least:.0f} mm "
            f"or more from each other{around} ({1000 * clearance.margin:g} mm asked for)."
        )
        if clearance.ignored:
            count = len(clearance.ignored)
            words += f" Not looked at: {count} pairs of shapes that are as near wherever it stands."
        return words

    def to_dict(self) -> dict[str, Any]:
        """The design as JSON has it."""
        return {
            "sentence": self.sentence,
            "duration": self.task.duration,
            "repeat": self.task.repeat,
            "load": self.task.load,
            "loads_tried": [
                {"load": one.mass, "tells": one.tells and list(one.tells), "why": one.why}
                for one in self.loads_tried
            ],
            "joints": list(self.model.robot.names),
            **self.trajectory.coefficients,
            "separations": [one.to_dict() for one in self.separations],
            "least_distance": self.least_distance,
            "status": self.motion.status,
            "settled": self.motion.settled,
        }


def _mean(ratios: np.ndarray) -> float:
    known = ratios[np.isfinite(ratios) & (ratios > 0)]
    return float(np.exp(np.mean(np.log(known)))) if len(known) else float("nan")
