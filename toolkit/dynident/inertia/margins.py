"""How far ten inertial parameters are inside, or outside, of what a body can have.

A margin is positive inside, negative outside: the report first, the verdict second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dynident.inertia.parameters import pseudo_inertia, to_com

# Rounding in the file (a triangle met with equality, a thin plate written with seven digits) is
# not a violation: relative to the inertia about the origin, this much is forgiven.
_DIGITS = 1e-6

# Nor is a mass of -1e-18 kg that a sum should have made zero: relative to the largest parameter.
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Margins:
    """The margin of every rule of physical consistency for one body.

    Attributes
    ----------
    mass : float
        The mass, kg: must not be negative.
    inertia_com_min_eig : float
        Smallest principal moment about the centre of mass, kg m^2: must not be negative.
    triangle : float
        Smallest of I1 + I2 - I3 over the principal moments about the centre of mass, kg m^2:
        must not be negative (no principal moment exceeds the sum of the others).
    pseudo_inertia_min_eig : float
        Smallest eigenvalue of the 4x4 pseudo-inertia (mixed units): not negative exactly when
        all of the above hold together.
    scale : float
        Largest magnitude among the parameters, against which rounding of the mass is forgiven.
    inertia_scale : float
        Largest magnitude among the moments and products of inertia about the origin, kg m^2,
        against which rounding of the moments is forgiven.
    """

    mass: float
    inertia_com_min_eig: float
    triangle: float
    pseudo_inertia_min_eig: float
    scale: float
    inertia_scale: float

    def _rules(self) -> list[tuple[str, float]]:
        return [
            ("mass", self.mass),
            ("inertia_com_min_eig", self.inertia_com_min_eig),
            ("triangle", self.triangle),
            ("pseudo_inertia_min_eig", self.pseudo_inertia_min_eig),
        ]

    @property
    def broken(self) -> tuple[str, ...]:
        """The broken ones among mass, inertia_com_min_eig and triangle (rounding forgiven)."""
        forgiven = _DIGITS * self.inertia_scale
        held = {
            "mass": self.mass >= -_ROUNDING * self.scale,
            "inertia_com_min_eig": self.inertia_com_min_eig >= -forgiven,
            "triangle": self.triangle >= -forgiven,
        }
        # A NaN margin holds nothing.
        return tuple(rule for rule, holds in held.items() if not holds)

    @property
    def semi_consistent(self) -> bool:
        """Whether neither the mass nor a moment about the centre of mass is negative.

        What equation (5) of Ting et al., RSS 2006, ensures: the spatial inertia is positive
        semidefinite. No mass distribution need have such parameters.
        """
        return not {"mass", "inertia_com_min_eig"} & set(self.broken)

    @property
    def consistent(self) -> bool:
        """Whether some mass distribution has these parameters (rounding forgiven)."""
        return not self.broken

    @property
    def worst(self) -> tuple[str, float]:
        """The rule with the smallest margin and that margin; a NaN is the worst of all."""
        return min(self._rules(), key=lambda rule: -np.inf if np.isnan(rule[1]) else rule[1])


def margins(phi: ArrayLike) -> Margins:
    """Return the margins of ten inertial parameters (10,).

    Non-finite parameters give NaN margins. Where the mass is zero but the first moment is not,
    there is no centre of mass, and the two margins about it are NaN.
    """
    phi = np.asarray(phi, dtype=float)
    if not np.all(np.isfinite(phi)):
        nan = float("nan")
        return Margins(
            mass=float(phi[0]),
            inertia_com_min_eig=nan,
            triangle=nan,
            pseudo_inertia_min_eig=nan,
            scale=1.0,
            inertia_scale=1.0,
        )
    scale = float(np.max(np.abs(phi)))
    inertia_com = to_com(_without_lost_mass(phi, _ROUNDING * scale)).inertia_com
    if np.all(np.isfinite(inertia_com)):
        moments = np.linalg.eigvalsh(inertia_com)
        smallest = float(moments[0])
        triangle = float(moments[0] + moments[1] - moments[2])
    else:
        smallest = triangle = float("nan")
    return Margins(
        mass=float(phi[0]),
        inertia_com_min_eig=smallest,
        triangle=triangle,
        pseudo_inertia_min_eig=float(np.linalg.eigvalsh(pseudo_inertia(phi))[0]),
        scale=scale,
        inertia_scale=float(np.max(np.abs(phi[4:]))),
    )


def _without_lost_mass(phi: NDArray[np.float64], rounding: float) -> NDArray[np.float64]:
    """Return phi with a mass below zero by rounding, and the first moment's rounding, made zero.

    Such a mass would put the centre of mass anywhere, and moments about it that look right.
    """
    if not -rounding <= phi[0] < 0:
        return phi
    lost = np.abs(phi) <= rounding
    lost[4:] = False
    return np.where(lost, 0.0, phi)
