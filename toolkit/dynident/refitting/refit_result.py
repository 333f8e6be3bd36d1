"""What a refit found: the projection, torque errors beside it, and a file that is proved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dynident.consistency import check
from dynident.evidence import Comparison
from dynident.fitting import Projection
from dynident.inertia import to_com
from dynident.robot import Robot
from dynident.robot.verify import Verification, write_verified
from dynident.tables import Shown, Table, number, percent

_FAR = 30.0
"""Radius of gyration over that of a body of the link's size, beyond which the mass is doubted."""


@dataclass(frozen=True, eq=False)
class TorqueErrors:
    """Torque errors of the parameters as given, of least squares, and of the refit.

    Attributes
    ----------
    recordings : which recordings of the study.
    comparison : of the three, in this order.
    """

    recordings: Literal["test", "training"]
    comparison: Comparison

    def table(self) -> Table:
        """The errors joint by joint."""
        results = self.comparison.results
        last = results[-1]
        floor: list[float | None] = [None] * len(last.joint_errors)
        if last.noise_std is not None:
            safe = np.where(last.torque_rms > 0, last.torque_rms, np.nan)
            floor = list(last.noise_std / safe)
        rows = [
            (joint, *(percent(float(r.joint_errors[j])) for r in results), percent(floor[j]))
            for j, joint in enumerate(self.comparison.models[0].robot.names)
        ]
        rows.append(("all", *(percent(r.error) for r in results), percent(last.floor)))
        columns = ("joint", *self.comparison.names, "noise floor")
        title = f"Relative torque error on the {self.recordings} recordings"
        notes = ("Least squares is without constraints; its links may be impossible.",)
        return Table(title, columns, tuple(rows), notes)

    def to_dict(self) -> dict[str, Any]:
        """The errors as JSON holds them."""
        said = self.comparison.to_dict()
        models = {
            one["name"].replace(" ", "_"): {"error": one["error"], "joints": one["joints"]}
            for one in said["models"]
        }
        return {"recordings": self.recordings, "noise_floor": said["noise"]["floor"], **models}


_OF_SHAPES = {"centre_of_mass", "spread"}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Refit(Shown):
    """Given parameters, made consistent.

    Attributes
    ----------
    projection : the nearest consistent parameters, and the proof.
    robot : the given description with these parameters.
    consistency : that was asked for.
    errors : on the recordings of a study, if there is one.
    source : the file of the description, whose bytes are kept if nothing has to change.
    """

    projection: Projection
    robot: Robot
    consistency: Literal["full", "semi"]
    errors: TorqueErrors | None = None
    source: Path | None = None

    @cached_property
    def unchanged(self) -> bool:
        """Whether the given parameters were consistent already."""
        return np.array_equal(self.projection.x, self.projection.x_before)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        notion = "fully consistent" if self.consistency == "full" else "semi-consistent"
        if self.unchanged:
            return f"Nothing to fix: all that is given is {notion} already."
        space, step = self.projection.space, self.projection.x - self.projection.x_before
        inertial = step[: space.rigid].reshape(-1, 10)
        links = [name for name, d in zip(space.bodies, inertial, strict=True) if np.any(d)]
        others = " and parameters of effects" if np.any(step[space.rigid :]) else ""
        moved = f"{len(links)} of {len(space.bodies)} links"
        return f"Made {notion}: {moved}{others} moved."

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Caveats: what was made possible, but is not likely."""
        space, x = self.projection.space, self.projection.x
        light = []
        for k, body in enumerate(space.bodies):
            phi, before = (y[10 * k : 10 * k + 10] for y in (x, self.projection.x_before))
            reference = space.references[k]
            if np.array_equal(phi, before) or not _gyration(phi) > _FAR * _gyration(reference):
                continue
            light.append(f"{body} ({number(float(phi[0]), 2)} kg)")
        words = "is hardly enough for the inertia within such an extent: weigh the link"
        notes = [f"The mass of {', '.join(light)} {words}."] if light else []
        # A body that could be somewhere need not fit into this link's shapes.
        beyond = [
            link.name
            for link in check(self.robot).links
            if any(rule.rule in _OF_SHAPES for rule in link.broken)
        ]
        # Which semi-consistent bodies no mass distribution has is in the certificate.
        beyond = beyond if self.consistency == "full" else []
        if beyond:
            names = ", ".join(beyond)
            notes.append(
                f"Possible as bodies, but not within the shapes of their links: {names} (wrong "
                "units, or another frame?). `dynident check` says what is wrong."
            )
        return tuple(notes)

    def effects(self) -> Table | None:
        """Parameters of effects before and after, None without a study; no description has them."""
        projection, start = self.projection, self.projection.space.rigid
        space = projection.space
        if self.errors is None or space.size == start:
            return None
        rows = tuple(
            (name, number(old, 5), number(new, 5), unit)
            for name, old, new, unit in zip(
                space.names[start:],
                projection.x_before[start:],
                projection.x[start:],
                space.units[start:],
                strict=True,
            )
        )
        notes = ("They are part of the study, not of the robot description.",)
        title = "Parameters of effects before and after"
        return Table(title, ("parameter", "before", "after", "unit"), rows, notes)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        effects = self.effects()
        return (
            self.sentence,
            *self.projection.tables(),
            *self.notes,
            *((effects,) if effects else ()),
            *((self.errors.table(),) if self.errors else ()),
        )

    def to_dict(self) -> dict[str, Any]:
        """The refit as JSON holds it."""
        projection, start = self.projection, self.projection.space.rigid
        space = projection.space
        effects = [
            {"name": space.names[i], "before": float(projection.x_before[i]), "after": float(x)}
            for i, x in enumerate(projection.x[start:], start=start)
        ]
        return {
            "consistency": self.consistency,
            "unchanged": self.unchanged,
            **projection.to_dict(),
            "notes": [*projection.notes, *self.notes],
            "effects": effects,
            "torque_errors": self.errors.to_dict() if self.errors else None,
        }

    def write_robot(self, path: str | Path) -> Verification:
        """Write the description, read back and verified before it replaces an old file.

        Raises
        ------
        RobotError
            If it cannot be written, or fails the verification; an old file stays as it is.
        FileError
            If the file cannot be written.
        """
        return write_verified(self.robot, path, self.consistency, self.source)


def _gyration(phi: np.ndarray) -> float:
    """Root mean square distance of the mass from the centre of mass, m."""
    if not phi[0] > 0:
        return float("inf") if np.any(phi) else 0.0
    return float(np.sqrt(max(np.trace(to_com(phi).inertia_com) / (2 * phi[0]), 0.0)))
