"""A load as it was identified: what it weighs, how sure that is, and whether it can exist."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident.fitting.loads.load import SYMMETRIC, Load, LoadSplit
from dynident.inertia import (
    PARAMETERS,
    frame_change,
    inertia_matrix,
    margins,
    pseudo_inertia,
)
from dynident.tables import Table, number

if TYPE_CHECKING:
    from dynident.fitting.loads.nearest_possible import PossibleLoad

_STEP = 1e-6  # relative, of central differences
_PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
QUANTITIES = ("mass", "x", "y", "z", *SYMMETRIC)
UNITS = ("kg", "m", "m", "m", *(("kg m^2",) * 6))


@dataclass(frozen=True, eq=False, kw_only=True)
class IdentifiedLoad:
    """The ten parameters of a load, and their errors.

    Attributes
    ----------
    load : what was known of it.
    phi : (10,) in the frame of its link, see `dynident.inertia.PARAMETERS`; NaN where the data do
        not tell a parameter apart.
    covariance : (10, 10) of phi, that of the gains in it; zero for what was given.
    acting : (10,) in the frame of the last joint, or of the sensor, with what is not told apart at
        some value: together they make the load's torque.
    scale : the joints whose common scale phi is known up to; empty where the scale is fixed.
    """

    load: Load
    phi: np.ndarray
    covariance: np.ndarray
    acting: np.ndarray
    scale: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """Whether all ten parameters are known."""
        return bool(np.all(np.isfinite(self.phi)))

    @property
    def values(self) -> np.ndarray:
        """Mass (kg), centre (m), and inertia about it (kg m^2), (10,) as `QUANTITIES`."""
        return _quantities(self.phi)

    @property
    def sigma(self) -> np.ndarray:
        """Their standard deviations, (10,), by first derivatives; NaN where there is no value."""
        change = np.zeros((10, 10))
        steps = _STEP * np.maximum(np.abs(np.nan_to_num(self.phi)), 1e-3)
        for k, step in enumerate(steps):
            shift = step * np.eye(10)[k]
            difference = _quantities(self.phi + shift) - _quantities(self.phi - shift)
            change[:, k] = difference / (2 * step)
        sigma = np.full(10, np.nan)
        for row in range(10):
            used = np.isfinite(change[row]) & (change[row] != 0.0)
            if np.isfinite(self.values[row]):
                one = change[row, used]
                sigma[row] = np.sqrt(max(one @ self.covariance[np.ix_(used, used)] @ one, 0.0))
        return sigma

    @property
    def least_eigenvalue(self) -> tuple[float, float]:
        """Smallest eigenvalue of the pseudo-inertia, lengths in units of the body's own, and sigma.

        Both are of the pseudo-inertia over the mass, with the radius of gyration about the origin
        for the unit of length; NaN where a parameter is not known.
        """
        if not self.is_whole or self.phi[0] == 0.0:
            return np.nan, np.nan
        # A unit of length, so that kg m^2, kg m and kg can be compared.
        length = np.sqrt(max(abs(np.trace(inertia_matrix(self.phi))) / abs(self.phi[0]), 1e-12))
        unit = np.diag([1 / length] * 3 + [1.0]) / np.sqrt(abs(self.phi[0]))
        values, vectors = np.linalg.eigh(unit @ pseudo_inertia(self.phi) @ unit)
        v = unit @ vectors[:, 0]
        slope = np.array([v @ pseudo_inertia(one) @ v for one in np.eye(10)])
        return float(values[0]), float(np.sqrt(max(slope @ self.covariance @ slope, 0.0)))

    @property
    def is_consistent(self) -> bool:
        """Whether a rigid body can have these parameters; False where they are not all known."""
        return self.is_whole and margins(self.phi).consistent

    @property
    def verdict(self) -> str:
        """Whether a rigid body can have these parameters, by the whole pseudo-inertia."""
        if not self.is_whole:
            missing = [n for n, x in zip(PARAMETERS, self.phi, strict=True) if not np.isfinite(x)]
            return f"not judged: the data do not tell {', '.join(missing)} apart"
        value, sigma = self.least_eigenvalue
        if self.is_consistent:
            return "possible: its pseudo-inertia is positive definite"
        rules = {
            "mass": "the mass is negative",
            "inertia_com_min_eig": "a principal moment about the centre of mass is negative",
            "triangle": "one principal moment exceeds the sum of the others",
        }
        why = "; ".join(rules[one] for one in margins(self.phi).broken)
        if value + 2 * sigma >= 0:
            return f"not possible as it is ({why}), but a possible body is within the errors"
        return f"not possible: {why}, by more than the errors explain"

    @cached_property
    def possible(self) -> PossibleLoad | None:
        """The nearest body that can exist, by the errors; None where this one can, or is not whole.

        Raises
        ------
        FitError
            If the program that finds it is not solved.
        """
        if not self.is_whole or self.is_consistent:
            return None
        # Programs take long to load, and most loads need none.
        from dynident.fitting.loads.nearest_possible import nearest_possible

        return nearest_possible(self.phi, self.covariance)

    def table(self) -> Table:
        """Mass, centre and inertia, the verdict, and where it is negative the nearest body."""
        load = self.load
        given = [load.mass is not None] + [load.centre is not None] * 3
        given += [load.inertia is not None] * 6
        nearest = self.possible
        near = np.full(10, np.nan) if nearest is None else _quantities(nearest.phi)
        rows = []
        for name, unit, value, sigma, known, other in zip(
            QUANTITIES, UNITS, self.values, self.sigma, given, near, strict=True
        ):
            how = "given" if known else "identified" if np.isfinite(value) else "not told apart"
            row = (name, number(value), number(np.nan if known else sigma, 2), unit, how)
            rows.append(row if nearest is None else (*row, number(other)))
        notes = [f"A body with these parameters is {self.verdict}."] if self.is_whole else []
        if not self.is_whole:
            notes.append(f"Whether a body can have these parameters is {self.verdict}.")
        if self.scale and not load.is_known:
            notes.append(
                "Mass and inertia are known up to the common scale of the drives of "
                f"{', '.join(self.scale)}; the centre is not touched by it."
            )
        if nearest is not None:
            notes.append(
                f"The nearest body that can exist is {number(nearest.distance, 3)} standard "
                f"deviations away. {nearest.certificate.sentence}"
            )
        where = f"in the frame of '{load.link}'" if load.link else "in the last link's frame"
        title = f"Load '{load.name}': centre {where}, inertia about the centre"
        columns = ("quantity", "value", "sigma", "unit", "found")
        columns = columns if nearest is None else (*columns, "possible")
        return Table(title, columns, tuple(rows), tuple(notes))

    def to_dict(self) -> dict[str, Any]:
        """The load as JSON has it."""
        values = [float(x) if np.isfinite(x) else None for x in self.values]
        sigma = [float(x) if np.isfinite(x) else None for x in self.sigma]
        return {
            "name": self.load.name,
            "mass": values[0],
            "centre": values[1:4],
            "inertia": values[4:],
            "sigma": {"mass": sigma[0], "centre": sigma[1:4], "inertia": sigma[4:]},
            "given": [
                k for k in ("mass", "centre", "inertia") if getattr(self.load, k) is not None
            ],
            "verdict": self.verdict,
            "consistent": self.is_consistent if self.is_whole else None,
            "common_scale_of": list(self.scale),
            "nearest_possible": self._possible_as_json(),
        }

    def _possible_as_json(self) -> dict[str, Any] | None:
        if self.possible is None:
            return None
        values = _quantities(self.possible.phi).tolist()
        return {
            "mass": values[0],
            "centre": values[1:4],
            "inertia": values[4:],
            "distance": self.possible.distance,
            "certificate": self.possible.certificate.to_dict(),
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class SolvedParts:
    """What was found of the k unknown parameters of a load, see `LoadSplit`.

    Attributes
    ----------
    values : (k,).
    covariance : (k, k).
    alone : (k,) bool, which are identified on their own.
    scale : joints whose common scale they are known up to.
    """

    values: np.ndarray
    covariance: np.ndarray
    alone: np.ndarray
    scale: tuple[str, ...] = ()


def identified_load(
    load: Load,
    parts: LoadSplit,
    solved: SolvedParts,
    placement: tuple[np.ndarray, np.ndarray],
) -> IdentifiedLoad:
    """Return a load in the frame of its link, from what was solved for in another frame.

    Parameters
    ----------
    load : what was known of it.
    parts : known and unknown parts, in the frame in which they act.
    solved : the unknown ones.
    placement : R (3, 3), p (3,) in m of the load's link in that frame.
    """
    # Parameters that are not told apart make those NaN that they are part of, and no others.
    held = parts.unknown != 0.0
    phi = parts.given + parts.unknown @ np.where(solved.alone, solved.values, 0.0)
    phi[np.any(held & ~solved.alone, axis=1)] = np.nan
    R, p = placement
    back = frame_change(R.T, -R.T @ p)
    moved = np.full(10, np.nan)
    for row in range(10):
        used = back[row] != 0.0
        moved[row] = back[row, used] @ phi[used]
    covariance = parts.unknown @ solved.covariance @ parts.unknown.T
    return IdentifiedLoad(
        load=load,
        phi=moved,
        covariance=back @ covariance @ back.T,
        acting=parts.given + parts.unknown @ solved.values,
        scale=solved.scale,
    )


def _quantities(phi: np.ndarray) -> np.ndarray:
    """Mass, centre and inertia about the centre, (10,); NaN where they rest on a NaN."""
    found = np.full(10, np.nan)
    mass, moment = phi[0], phi[1:4]
    found[0] = mass
    if not np.isfinite(mass) or mass == 0.0:
        return found
    found[1:4] = moment / mass
    # Each entry of the shifted inertia rests on one parameter, on the mass, and on two moments.
    about_origin = inertia_matrix(phi)
    for at, (i, j) in enumerate(_PLACES, 4):
        shift = -np.sum(np.delete(moment, i) ** 2) if i == j else moment[i] * moment[j]
        found[at] = about_origin[i, j] + shift / mass
    return found
