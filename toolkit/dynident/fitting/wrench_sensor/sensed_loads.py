"""What hangs on a wrench sensor, as it was weighed, and the constants of the sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.fitting.estimate import DataSource
from dynident.fitting.loads import IdentifiedLoad
from dynident.recording import COMPONENTS
from dynident.tables import Shown, Table, finite, number, percent

UNITS = ("N", "N", "N", "N m", "N m", "N m")
_MUCH_LEFT = 0.2  # of a component


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SensedLoads(Shown):
    """Loads that a wrench sensor weighs; no drive has a part in it.

    Attributes
    ----------
    frame : the link in whose frame the wrench is stated.
    records : whether the sensor records what moves the load, or what the load does to it.
    loads : first what hangs on it in recordings that name no load, if there are such.
    constants : (6,) offset of each component as it is recorded, N and N m; NaN where it is not told
        apart.
    sigma : (6,) of them.
    residual_std : (6,) N and N m.
    wrench_rms : (6,) root mean square of what was recorded, less what was given of loads.
    lacking : whether what a load leaves is as slow as the motion, as of `ScatteredErrors`.
    rows, effective_rows : equations, and independent ones that would say as much.
    sources : the recordings.
    """

    frame: str
    records: str
    loads: tuple[IdentifiedLoad, ...]
    constants: np.ndarray
    sigma: np.ndarray
    residual_std: np.ndarray
    wrench_rms: np.ndarray
    lacking: bool
    rows: int
    effective_rows: float
    sources: tuple[DataSource, ...] = ()

    @property
    def is_consistent(self) -> bool:
        """Whether every load whose parameters are all known is one that a body can have."""
        return all(one.is_consistent for one in self.loads if one.is_whole)

    @property
    def remedy(self) -> str:
        """What would tell the parameters apart that are not; empty where all are."""
        missing = any(not one.is_whole for one in self.loads)
        return (
            "Inertia shows where the sensor turns fast, about several axes; mass and centre show "
            "in several poses. What is not told apart was not excited beyond the noise of the "
            "positions."
            if missing
            else ""
        )

    def table(self) -> Table:
        """The constants of the sensor, and what is left of each component."""
        rows = tuple(
            (name, number(value), number(sigma, 2), number(left, 3), unit)
            for name, value, sigma, left, unit in zip(
                COMPONENTS, self.constants, self.sigma, self.residual_std, UNITS, strict=True
            )
        )
        notes = [f"The sensor records {self.records}.", *filter(None, [self.remedy])]
        if self.lacking:
            notes.append(
                "What is left of the wrench is as slow as the motion, unlike most noise: the load "
                "moves on the sensor, something touches or pulls it, positions and wrench are not "
                "of one time, or the noise is as slow. sigma holds it, and values may be further "
                "off."
            )
        much = [
            f"{name} ({percent(left / whole, 0)})"
            for name, left, whole in zip(
                COMPONENTS, self.residual_std, self.wrench_rms, strict=True
            )
            if left > _MUCH_LEFT * whole
        ]
        if much:
            notes.append(f"A load leaves much of {', '.join(much)}.")
        title = f"The wrench sensor at '{self.frame}': constants, and what the loads leave"
        columns = ("component", "constant", "sigma", "left (std)", "unit")
        return Table(title, columns, rows, tuple(notes))

    def tables(self) -> tuple[Table | str, ...]:
        """Each load that was identified, then the sensor."""
        return (*(one.table() for one in self.loads if not one.load.is_known), self.table())

    def to_dict(self) -> dict[str, Any]:
        """Loads and constants as JSON has them."""
        return {
            "frame": self.frame,
            "records": self.records,
            "loads": [one.to_dict() for one in self.loads],
            "constants": [finite(x) for x in self.constants],
            "sigma": [finite(x) for x in self.sigma],
            "residual_std": self.residual_std.tolist(),
            "rows": self.rows,
            "effective_rows": self.effective_rows,
        }
