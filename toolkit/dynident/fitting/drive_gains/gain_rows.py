"""Rows of a robot whose torques were recorded in the unit of its drives.

At each joint i = kappa (Y theta + tau_known): i in amperes or percent, kappa = 1 / gain, and beside
the model's columns those of what is unknown of each load, and the torque of what is known of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from itertools import chain

import numpy as np

from dynident.effects import effects_of
from dynident.errors import StudyError
from dynident.fitting.loads import Load, LoadSplit, placement, split
from dynident.fitting.reversals.standing_joints import without_stops
from dynident.fitting.sampling import Sampled, sample
from dynident.inertia import frame_change
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, factorise
from dynident.recording import Dataset
from dynident.words import nearest

_ROUNDING = 1e-9  # of the largest entry of a combination of parameters


@dataclass(frozen=True, eq=False)
class GainProblem:
    """What is to be found, and from what.

    Attributes
    ----------
    model : of p parameters, in N m.
    dataset : its torques are in the unit of the drives.
    known : gain of each joint whose gain is known, N m (or N) per unit.
    loads : that the recordings name.
    trusted : links whose mass, centre and inertia in the description are right; what they alone
        make of the model's parameters is known.
    """

    model: Model
    dataset: Dataset
    known: Mapping[str, float] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()
    _: KW_ONLY
    trusted: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        robot = self.model.robot
        for joint, gain in self.known.items():
            if joint not in robot.names:
                remedy = f"joints: {', '.join(robot.names)}"
                raise StudyError(f"the robot has no joint '{joint}'", "drive_gains", remedy)
            if not (np.isfinite(gain) and gain != 0.0):
                raise StudyError(f"{joint} = {gain}", "drive_gains", "a gain is not zero")
        named = {load.name for load in self.loads}
        for recording in self.dataset.recordings:
            if recording.load and recording.load not in named:
                remedy = f"loads: {', '.join(named)}" if named else "describe it in [loads]"
                raise StudyError(f"no load '{recording.load}'", recording.where, remedy)
        for effect in self.model.effects:
            if effect.name == "drive_gain" and len(self.known) < robot.n:
                what = "the model's own drive gains and unknown units of the drives are one thing"
                raise StudyError(what, effect.label, "leave the effect out")
            if effect.is_payload and self.loads:
                what = "a load under study and loads by their names exclude one another"
                raise StudyError(what, effect.label, "leave the effect out: name the load instead")

    @cached_property
    def held(self) -> np.ndarray:
        """Which of the model's parameters trusted links make alone, (p,) bool.

        Raises
        ------
        StudyError
            If the robot has no such link, or what they make shows only together with others.
        """
        robot, found = self.model.robot, np.zeros(self.model.size, dtype=bool)
        if not self.trusted:
            return found
        names = [link.name for link in robot.links if link.joint != -1]
        for name in self.trusted:
            if name not in names:
                remedy = nearest(name, names, "links")
                raise StudyError(f"the robot has no moving link '{name}'", "trusted", remedy)
        others = {
            link.joint
            for link in robot.links
            if link.joint != -1 and link.name not in self.trusted and np.any(link.phi)
        }
        combination = self.model.base.combination
        columns = [k for j in sorted(others) for k in range(10 * j, 10 * j + 10)]
        size = np.abs(combination).max(axis=1)
        alone = np.all(np.abs(combination[:, columns]) <= _ROUNDING * size[:, None], axis=1)
        found[: len(alone)] = alone & (self.given_values()[: len(alone)] != 0.0)
        if not found.any():
            what = f"trusting {', '.join(self.trusted)} fixes nothing"
            remedy = "what a link weighs shows only with all links behind it: trust these too"
            raise StudyError(what, "trusted", remedy)
        return found

    @property
    def free(self) -> np.ndarray:
        """Which gains are unknown, (n,) bool."""
        return np.array([name not in self.known for name in self.model.robot.names])

    @cached_property
    def splits(self) -> dict[str, LoadSplit]:
        """Known and unknown parts of each load, in the last joint's frame."""
        found = {}
        for load in self.loads:
            change, parts = frame_change(*placement(load, self.model.robot)), split(load)
            found[load.name] = LoadSplit(parts.names, change @ parts.given, change @ parts.unknown)
        return found

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Columns of what is unknown of each load; they follow those of the model."""
        found, start = {}, self.model.size
        for name, parts in self.splits.items():
            found[name] = slice(start, start + len(parts.names))
            start += len(parts.names)
        return found

    @property
    def size(self) -> int:
        """Number of linear parameters: the model's, and the unknown ones of loads."""
        return self.model.size + sum(len(parts.names) for parts in self.splits.values())

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the linear parameters."""
        of_loads = (f"{name}.{own}" for name, parts in self.splits.items() for own in parts.names)
        return (*self.model.names, *of_loads)

    @cached_property
    def _carrying(self) -> Model:
        """The model with the columns of ten parameters on the last link."""
        return self.model + effects_of("payload", self.model.robot) if self.loads else self.model

    def given_values(self) -> np.ndarray:
        """The description's parameters, and nothing of loads, (size,)."""
        values = np.zeros(self.size)
        values[: self.model.size] = self.model.given_values()
        return values

    @cached_property
    def samples(self) -> tuple[Sampled, ...]:
        """The recordings, those with a load as carrying it."""
        found = []
        for recording in without_stops(self.model, self.dataset).recordings:
            if self.loads:
                recording = recording.replace(payload=bool(recording.load))
            found.append(sample(recording, self.dataset.filter))
        return tuple(found)

    def rows_of(
        self, sampled: Sampled, values: np.ndarray | None = None
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield blocks (T, n, size + 1) of a recording, and the currents (T, n).

        The columns are the torque per unit of parameters, and that of what is known of loads and
        trusted links. Rows of a joint that do not count are zero.

        Parameters
        ----------
        sampled : one of `samples`.
        values : (size,) at which columns that depend on the fitted model are taken.
        """
        p, load = self.model.size, sampled.recording.load
        given = self.model.given_values()
        if values is not None:
            values = np.append(values[:p], np.zeros(10 if self.loads else 0))
        for found, current in sampled.rows(self._carrying, values):
            block = np.zeros((*found.shape[:2], self.size + 1))
            block[:, :, :p] = found[:, :, :p]
            if load:
                parts = self.splits[load]
                block[:, :, self.slices[load]] = found[:, :, p:] @ parts.unknown
                block[:, :, -1] = found[:, :, p:] @ parts.given
            # A column of zeros is none that is solved for: its parameter stays as described.
            block[:, :, -1] += block[:, :, :p] @ np.where(self.held, given, 0.0)
            block[:, :, :p][:, :, self.held] = 0.0
            yield block, current

    def factors(self, values: np.ndarray | None = None) -> TriangularFactors:
        """Factors of the rows [columns, currents] of all recordings that count.

        Parameters
        ----------
        values : as of `rows_of`.
        """
        return factorise(chain.from_iterable(self.rows_of(one, values) for one in self.samples))
