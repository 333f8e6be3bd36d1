"""A constrained identification problem: rows of least squares, prior, and constraint sets."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from dynident.constraints.sets import Linear, SecondOrder, Within
from dynident.constraints.space import ParameterSpace
from dynident.errors import FitError
from dynident.inertia import distance_rows, pseudo_inertia, spatial_inertia_matrix

_FREE = 1e-9  # of the largest: a singular value below it leaves a direction free
_ROUNDING = 1e-12  # of a body's size: what rounding takes from the eigenvalues of a flat body
_ROWS = 1024  # factorised at a time: few enough to stay in the cache
TOLERANCE = 1e-7
"""Of a parameter's size: what a solver may break a linear or second-order constraint by."""


@dataclass(frozen=True, eq=False)
class Entropy:
    """weight * sum over bodies of tr(Q^-1 P) - log det(Q^-1 P) - 4, Q the pseudo-inertia of centre.

    The log-det divergence from the centre's mass distribution (the entropic prior of Lee, Wensing,
    Park 2020); near the centre it is half the squared `inertia.distance_rows`.

    Attributes
    ----------
    centres : (n, 10) consistent bodies.
    """

    weight: float
    centres: np.ndarray


@dataclass(frozen=True, eq=False)
class Problem:
    """Minimise 1/2 |A x - b|^2 (+ entropy) over the standard parameters x within a set.

    Attributes
    ----------
    space : what x is.
    A, b : (r, s), (r,) rows of data and of a quadratic prior, each in units of its noise.
    within : the constraints.
    entropy : entropic prior, or None.
    """

    space: ParameterSpace
    A: np.ndarray
    b: np.ndarray
    within: Within
    entropy: Entropy | None = field(default=None, kw_only=True)

    # --- objective -----------------------------------------------------------------------------

    def objective(self, x: np.ndarray) -> float:
        """The objective at x (s,); infinite where the entropy is."""
        residual = self.A @ x - self.b
        return float(0.5 * residual @ residual) + self._entropy(x)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """Its gradient, (s,)."""
        return self.A.T @ (self.A @ x - self.b) + self.entropy_gradient(x)

    def entropy_gradient(self, x: np.ndarray) -> np.ndarray:
        """Gradient of the entropy alone, (s,)."""
        gradient = np.zeros(self.space.size)
        if self.entropy is None:
            return gradient
        basis = pseudo_basis()
        for k, centre in enumerate(self.entropy.centres):
            part = slice(10 * k, 10 * k + 10)
            pull = np.linalg.inv(pseudo_inertia(centre)) - np.linalg.inv(pseudo_inertia(x[part]))
            gradient[part] = self.entropy.weight * np.einsum("kij,ij->k", basis, pull)
        return gradient

    def _entropy(self, x: np.ndarray) -> float:
        if self.entropy is None:
            return 0.0
        total = 0.0
        for k, centre in enumerate(self.entropy.centres):
            ratio = np.linalg.solve(pseudo_inertia(centre), pseudo_inertia(x[10 * k : 10 * k + 10]))
            values = np.linalg.eigvals(ratio).real
            if np.any(values <= 0):
                return float("inf")
            total += float(np.sum(values - np.log(values) - 1.0))
        return self.entropy.weight * total

    # --- constraints ---------------------------------------------------------------------------

    @cached_property
    def linear(self) -> Linear:
        """All linear constraints, bounds of the effects' parameters included."""
        space = self.space
        bounded = np.flatnonzero(np.isfinite(space.lower) | np.isfinite(space.upper))
        unit = np.eye(space.size)
        parts = [
            Linear("bounds", unit[bounded], space.lower[bounded], space.upper[bounded]),
            *(c for c in self._constraints if isinstance(c, Linear)),
        ]
        # Scaled so that a row's value is in units of the parameters that it holds.
        A = np.vstack([p.A for p in parts])
        lower = np.concatenate([p.lower for p in parts])
        upper = np.concatenate([p.upper for p in parts])
        size = np.max(np.abs(A) * space.scale, axis=1, initial=0.0)
        size[size == 0] = 1.0
        return Linear("linear", A / size[:, None], lower / size, upper / size)

    @cached_property
    def cones(self) -> tuple[SecondOrder, ...]:
        """All second-order cones."""
        return tuple(c for c in self._constraints if isinstance(c, SecondOrder))

    @cached_property
    def cone_rows(self) -> list[np.ndarray]:
        """Each second-order cone's rows, on parameters in units of their size; entries near one."""
        scale = self.space.scale
        return [c.A * scale / np.max(np.abs(c.A) * scale) for c in self.cones]

    def cone_values(self, x: np.ndarray) -> list[np.ndarray]:
        """Each second-order cone's vector at x."""
        return [rows @ (x / self.space.scale) for rows in self.cone_rows]

    @cached_property
    def _constraints(self) -> tuple[Linear | SecondOrder, ...]:
        return tuple(c for one in self.within.sets for c in one.on(self.space))

    @cached_property
    def matrices(self) -> np.ndarray:
        """The matrix of a body per unit of each of its parameters, (10, d, d); (10, 0, 0) if free.

        Positive semidefinite for consistent bodies: the pseudo-inertia ("full") or the spatial
        inertia ("semi").
        """
        if self.within.consistency == "full":
            return pseudo_basis()
        if self.within.consistency == "semi":
            return np.array([spatial_inertia_matrix(unit) for unit in np.eye(10)])
        return np.zeros((10, 0, 0))

    def body_matrices(self, x: np.ndarray) -> np.ndarray:
        """The matrices of all bodies, in units of their size, (n, d, d).

        That is S M S with S diagonal, so that mass and inertia are both near one.
        """
        basis = self.scaled_matrices
        return np.einsum("nk,nkij->nij", x[: self.space.rigid].reshape(-1, 10), basis)

    @cached_property
    def scaled_matrices(self) -> np.ndarray:
        """`matrices` of each body in units of its size, (n, 10, d, d)."""
        scale = self.space.scale[: self.space.rigid].reshape(-1, 10)
        mass, inertia = scale[:, 0], scale[:, 4]
        if self.within.consistency == "full":  # rows: three of length, one of mass
            size = np.stack([inertia, inertia, inertia, mass], axis=1) ** -0.5
        elif self.within.consistency == "semi":
            size = np.stack([*[inertia] * 3, *[mass] * 3], axis=1) ** -0.5
        else:
            size = np.zeros((len(scale), 0))
        return np.einsum("ni,kij,nj->nkij", size, self.matrices, size)

    @cached_property
    def inset(self) -> np.ndarray:
        """What is taken off the parameters before they must be consistent, (s,)."""
        return self.within.inset * self.space.reference

    def body_violation(self, x: np.ndarray) -> float:
        """How far bodies are from consistent, relative to their size; 0 inside.

        The inset is not asked for: a body on the very boundary is inside.
        """
        if self.within.consistency == "none":
            return 0.0
        return max(0.0, float(-np.linalg.eigvalsh(self.body_matrices(x)).min(initial=0.0)))

    def violation(self, x: np.ndarray) -> float:
        """How far x breaks a linear or second-order constraint, relative to sizes; 0 inside."""
        worst, linear = 0.0, self.linear
        if len(linear.A):
            value = linear.A @ x
            worst = max(worst, *(linear.lower - value), *(value - linear.upper))
        for value in self.cone_values(x):
            worst = max(worst, float(np.linalg.norm(value[1:]) - value[0]))
        return float(worst)

    def feasible(self, x: np.ndarray) -> bool:
        """Whether x lies within: bodies up to rounding, other constraints up to `TOLERANCE`.

        A body with inertia but without mass is not: it is the limit of ever smaller masses ever
        further away.
        """
        within = self.body_violation(x) <= _ROUNDING and self.violation(x) <= TOLERANCE
        return within and not np.any(self._without_mass(x))

    def _without_mass(self, x: np.ndarray) -> np.ndarray:
        """Which bodies turn as if they had a mass, and have none, (n,) bool."""
        if self.within.consistency == "none":
            return np.zeros(len(self.space.bodies), dtype=bool)
        bodies, scale = (y[: self.space.rigid].reshape(-1, 10) for y in (x, self.space.scale))
        relative = np.abs(bodies / scale)
        return (relative[:, 0] <= _ROUNDING) & (relative[:, 4:].max(axis=1) > _ROUNDING)

    def retracted(self, x: np.ndarray) -> np.ndarray:
        """Return x with what a solver left outside the bounds and consistent bodies moved inside.

        An effect's parameter goes to its bound. Each body gets as much of its reference body as it
        takes to be the inset inside, no less: then no answer is better than the bound. The change
        is of the size of the solver's error.
        """
        x = np.array(x)
        for row, low, high in zip(self.linear.A, self.linear.lower, self.linear.upper, strict=True):
            at = np.flatnonzero(row)
            if len(at) == 1 and at[0] >= self.space.rigid:
                k = at[0]
                x[k] = np.clip(row[k] * x[k], low, high) / row[k]
        if self.within.consistency == "none":
            return x
        references = self.body_matrices(self.space.reference)
        for k, matrix in enumerate(self.body_matrices(x)):
            least = float(eigh(matrix, references[k], eigvals_only=True)[0])
            lacking = self.within.inset - least
            if lacking > 0:
                x[10 * k : 10 * k + 10] += lacking * self.space.references[k]
        return x

    # --- forms ---------------------------------------------------------------------------------

    @cached_property
    def free_directions(self) -> int:
        """Directions of x that neither data nor prior hold."""
        values = np.linalg.svd(self.A * self.space.scale, compute_uv=False)
        return self.space.size - int(np.sum(values > _FREE * values.max(initial=0.0)))

    def require_held(self) -> None:
        """Refuse a problem with a continuum of minimisers.

        Raises
        ------
        FitError
            If rows and prior leave directions free.
        """
        if self.entropy is None and self.free_directions:
            what = (
                f"the metric leaves {self.free_directions} of {self.space.size} directions free: "
                "there is a continuum of minimisers"
            )
            raise FitError(what, remedy="give a prior, the robot description for instance")

    @cached_property
    def unconstrained(self) -> np.ndarray | None:
        """The minimiser without constraints, (s,); None where the entropy makes it nonlinear."""
        if self.entropy is not None:
            return None
        scale = self.space.scale
        return scale * np.linalg.lstsq(self.A * scale, self.b, rcond=None)[0]

    @cached_property
    def origin(self) -> np.ndarray:
        """The minimiser without constraints, the entropy replaced by the quadratic near its centre.

        Where programs start to count: at the optimum, costs and steps from here are small numbers.
        """
        if self.entropy is None:
            assert self.unconstrained is not None
            return self.unconstrained
        space, root = self.space, np.sqrt(self.entropy.weight)
        rows = np.zeros((space.rigid, space.size))
        for k, centre in enumerate(self.entropy.centres):
            part = slice(10 * k, 10 * k + 10)
            rows[part, part] = root * distance_rows(centre)
        at = rows[:, : space.rigid] @ self.entropy.centres.ravel()
        near = replace(self, A=np.vstack([self.A, rows]), b=np.append(self.b, at), entropy=None)
        return near.origin

    def reduced(self) -> Problem:
        """The same problem in at most s + 1 rows, so that no solver sees the rows of the data."""
        if len(self.b) <= self.space.size + 1:
            return self
        rows, R = np.column_stack([self.A, self.b]), np.zeros((0, self.space.size + 1))
        for start in range(0, len(rows), _ROWS):
            part = np.vstack([R, rows[start : start + _ROWS]])
            R = np.asarray(np.linalg.qr(part, mode="r"))
        return replace(self, A=R[:, :-1], b=R[:, -1])


def pseudo_basis() -> np.ndarray:
    """The pseudo-inertia per unit of each of the ten parameters, (10, 4, 4)."""
    return np.array([pseudo_inertia(unit) for unit in np.eye(10)])
