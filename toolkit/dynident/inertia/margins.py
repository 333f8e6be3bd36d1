"""How far ten inertial parameters are inside, or outside, of what a body can have.

A margin is positive inside, negative outside: the report first, the verdict second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dynident.inertia.parameters import pseudo_inertia, to_com

# Rounding in the file (a triangle met with equality, a thin plate written with six digits) is
# not a violation: relative to the size of the inertia, this much is forgiven.
_ROUNDING = 1e-9


@dataclass(frozen=True)
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
        Largest magnitude among the parameters, against which rounding is forgiven.
    """

    mass: float
    inertia_com_min_eig: float
    triangle: float
    pseudo_inertia_min_eig: float
    scale: float

    def _rules(self) -> list[tuple[str, float]]:
        return [
            ("mass", self.mass),
            ("inertia_com_min_eig", self.inertia_com_min_eig),
            ("triangle", self.triangle),
            ("pseudo_inertia_min_eig", self.pseudo_inertia_min_eig),
        ]

    @property
    def consistent(self) -> bool:
        """Whether some mass distribution has these parameters (rounding forgiven)."""
        # Written so that a NaN margin is a violation.
        return all(value >= -_ROUNDING * self.scale for _, value in self._rules())

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
        return Margins(float(phi[0]), nan, nan, nan, 1.0)
    inertia_com = to_com(phi).inertia_com
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
        scale=float(np.max(np.abs(phi))),
    )
