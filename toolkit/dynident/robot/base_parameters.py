"""Base parameters: the combinations of parameters that data can tell apart.

Pivoted QR of the stacked regressor (Gautier, "Numerical calculation of the base inertial
parameters of robots", 1991), on columns of unit norm so that units do not decide. One number says
what counts as shown, for structures as for data: `RANK_TOLERANCE`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

from dynident.errors import FitError
from dynident.moments.factors import RANK_TOLERANCE
from dynident.robot.pivoted_columns import ROUNDING, PivotedColumns
from dynident.robot.robot import Robot
from dynident.robot.tree import Array

# A coefficient of a combination this small (in units of column norms) is rounding.
_NEGLIGIBLE = 1e-8
# Weight of a mass against the other parameters: where no torque shows it, it stays as described.
_MASS_STAYS = 1e-3
# Share of the typical mass below which a described mass cannot carry a first moment.
_NEXT_TO_NOTHING = 1e-6


@dataclass(frozen=True, eq=False, kw_only=True)
class BaseParameters:
    """A basis of the identifiable combinations of parameters.

    theta_base = theta[independent] + K theta[dependent], and X theta = X[:, independent]
    theta_base for the regressor X it was computed from (and any other with the same null space).

    Attributes
    ----------
    names : tuple of str
        All parameters.
    independent : tuple of int
        Columns that are kept, ascending: one base parameter each.
    dependent : tuple of int
        The other columns, ascending.
    K : (r, p - r) ndarray
    expressions : tuple of str
        Each base parameter written out, as in "Izz.link1 + 0.25 m.link2".
    scale : (p,) ndarray
        Norm of each column (zero where it shows nothing): how much torque a unit of it makes.
    diagonal : (min(rows, p),) ndarray
        Magnitudes of the diagonal of R for unit columns: what the rank was decided on.
    tolerance : float
        A diagonal entry below tolerance times the largest counts as zero.
    nearly_hidden : tuple of str
        Parameters that count as not shown, or not shown apart from others, although more than
        rounding of double precision shows them.
    """

    names: tuple[str, ...]
    independent: tuple[int, ...]
    dependent: tuple[int, ...]
    K: Array
    expressions: tuple[str, ...]
    scale: Array
    diagonal: Array
    tolerance: float
    nearly_hidden: tuple[str, ...] = ()

    @property
    def rank(self) -> int:
        """Number of base parameters."""
        return len(self.independent)

    @property
    def gap(self) -> float:
        """Smallest kept over largest dropped diagonal entry; near 1, the rank is a matter of taste.

        Infinite where nothing nonzero was dropped.
        """
        kept, dropped = self.diagonal[: self.rank], self.diagonal[self.rank :]
        if not len(kept) or not len(dropped) or not np.any(dropped):
            return float("inf")
        return float(kept[-1] / dropped[0])

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Parameters that appear in no base parameter: no torque depends on them."""
        used = np.any(self.K != 0.0, axis=0)
        return tuple(
            self.names[column]
            for column, is_used in zip(self.dependent, used, strict=True)
            if not is_used
        )

    @property
    def combination(self) -> Array:
        """The (r, p) matrix B with theta_base = B theta."""
        B = np.zeros((self.rank, len(self.names)))
        B[np.arange(self.rank), list(self.independent)] = 1.0
        B[:, list(self.dependent)] = self.K
        return B

    @property
    def told(self) -> Array:
        """`combination` without what is too small to be told by any torque, (r, p).

        Of a parameter that is identified on its own one row has a one, and nothing else.
        """
        B = self.combination
        size = self.scale[list(self.independent)]
        # In units of the columns' norms: the part of a parameter's torque that the row's makes.
        B[np.abs(B) * size[:, None] < RANK_TOLERANCE * self.scale] = 0.0
        return B

    def coordinates(self, theta: ArrayLike) -> Array:
        """Return the base values (r,) of standard parameters (p,)."""
        theta = self._vector(theta, len(self.names), "theta")
        dependent = theta[list(self.dependent)]
        # Parameters without influence may be anything, NaN included.
        used = np.any(self.K != 0.0, axis=0)
        return theta[list(self.independent)] + self.K[:, used] @ dependent[used]

    def lift(
        self, base_values: ArrayLike, theta_prior: ArrayLike, mobility: ArrayLike = 1.0
    ) -> Array:
        """Return the standard parameters (p,) nearest to a prior that have these base values.

        Nearest in the norm that weights each parameter with the torque that a unit of it makes
        (`scale`), so the choice does not depend on units. What no torque depends on keeps its
        prior value.

        Parameters
        ----------
        base_values : (r,) array_like
        theta_prior : (p,) array_like
        mobility : float or (p,) array_like
            Divides the weight of each parameter: the smaller it is, the nearer to the prior.

        Raises
        ------
        FitError
            If a shape does not fit.
        """
        values = self._vector(base_values, self.rank, "base_values")
        prior = self._vector(theta_prior, len(self.names), "theta_prior")
        norm = np.divide(1.0, self.scale, out=np.zeros_like(self.scale), where=self.scale > 0)
        weight = norm * mobility
        B = self.combination * weight
        correction = np.linalg.lstsq(B, values - self.coordinates(prior), rcond=None)[0]
        theta = np.asarray(prior + weight * correction, dtype=float)
        # One step of refinement puts what rounding is left into the independent parameters.
        theta[list(self.independent)] += values - self.coordinates(theta)
        return theta

    def reduce(self, regressor: Array) -> Array:
        """Return the columns (..., r) of a regressor (..., p) that the base parameters multiply."""
        return regressor[..., list(self.independent)]

    def _vector(self, values: ArrayLike, size: int, what: str) -> Array:
        array = np.asarray(values, dtype=float)
        if array.shape != (size,):
            raise FitError(f"{what} has shape {array.shape} where ({size},) is needed")
        return array


def base_parameters(
    matrix: ArrayLike,
    names: Sequence[str],
    tolerance: float = ROUNDING,
    borne: ArrayLike = 0.0,
) -> BaseParameters:
    """Return the base parameters of a stacked regressor, or of its R factor.

    Parameters
    ----------
    matrix : (rows, p) array_like
        Any matrix X, or the R of X = QR (they have the same dependencies and column norms).
    names : sequence of str
        One name per column.
    tolerance : float
        Relative threshold on the diagonal of R, for columns of unit norm. The default separates
        dependence from rounding in double precision.
    borne : float or (p,) array_like
        Norm of a column whose parameter an axis bears in full, at least. A shorter column is
        scaled by this instead of its own norm, so that it counts as little as it shows, and below
        tolerance times this it counts as zero.

    Raises
    ------
    FitError
        If shapes do not match, or the matrix is not finite.
    """
    X = np.asarray(matrix, dtype=float)
    names = tuple(names)
    if X.ndim != 2 or X.shape[1] != len(names):
        raise FitError(f"a regressor of shape {X.shape} does not fit {len(names)} parameter names")
    if not np.all(np.isfinite(X)):
        column = int(np.argmin(np.all(np.isfinite(X), axis=0)))
        raise FitError("the regressor is not finite", f"column '{names[column]}'")
    found = PivotedColumns.of(X, tolerance, borne)
    scale, near, shown, norms = found.scale, found.near.copy(), found.shown, found.norms
    R, pivots, diagonal, rank = found.R, found.pivots, found.diagonal, found.rank
    # In unit columns first: there a coefficient can be compared with 1.
    unit = solve_triangular(R[:rank, :rank], R[:rank, rank:]) if rank else np.zeros((0, len(shown)))
    unit[np.abs(unit) < _NEGLIGIBLE] = 0.0
    kept, rest = shown[pivots[:rank]], shown[pivots[rank:]]
    dropped = shown[pivots[rank : len(diagonal)]]
    near[dropped] = diagonal[rank:] > ROUNDING * np.max(diagonal, initial=0.0)
    full = np.zeros((len(names), len(names)))
    full[np.ix_(kept, rest)] = unit * norms[pivots[rank:]] / norms[pivots[:rank]][:, None]
    independent = found.independent
    dependent = np.setdiff1d(np.arange(len(names)), independent)
    K = full[np.ix_(independent, dependent)]
    for array in (K, scale, diagonal):
        array.setflags(write=False)
    return BaseParameters(
        names=names,
        independent=tuple(int(i) for i in independent),
        dependent=tuple(int(i) for i in dependent),
        K=K,
        expressions=tuple(
            written_out(names[i], K[row], [names[j] for j in dependent])
            for row, i in enumerate(independent)
        ),
        scale=scale,
        diagonal=diagonal,
        tolerance=tolerance,
        nearly_hidden=tuple(name for name, is_near in zip(names, near, strict=True) if is_near),
    )


def structural_base(robot: Robot, seed: int = 0) -> BaseParameters:
    """Return the base parameters of a robot's inertial parameters, whatever the motion.

    Computed on random motion within the limits (`Robot.random_motion`): what it cannot show, no
    recording can. That an angle of a right angle is written with some digits (1.5707963, 1.5708)
    would show parameters by a hundred-thousandth of themselves; `RANK_TOLERANCE` leaves these out.
    """
    q, v, a = structural_motion(robot, seed)
    regressor = robot.regressor(q, v, a).reshape(-1, 10 * robot.n)
    borne = np.tile(_borne(robot, a), robot.n)
    return base_parameters(regressor, robot.parameter_names, RANK_TOLERANCE, borne)


def structural_motion(robot: Robot, seed: int = 0) -> tuple[Array, Array, Array]:
    """Return the random motion (q, v, a) that shows all that any motion of a robot does."""
    return robot.random_motion(seed, 20 * robot.n + 20)


def structurally_independent(robot: Robot, regressor: Array, a: Array) -> list[int]:
    """Return which columns `structural_base` keeps, ascending, for a regressor that is known.

    Parameters
    ----------
    robot : Robot
    regressor : (T, n, 10 n) ndarray
        Along its `structural_motion`.
    a : (T, n) ndarray
        Accelerations of that.
    """
    borne = np.tile(_borne(robot, a), robot.n)
    rows = regressor.reshape(-1, 10 * robot.n)
    return [int(i) for i in PivotedColumns.of(rows, RANK_TOLERANCE, borne).independent]


def _borne(robot: Robot, a: Array) -> Array:
    """Norm of the columns of a body's parameters where an axis bears them in full, (10,).

    A mass a typical distance away from an axis that it weighs on, a first moment that gravity
    turns, an inertia that the joint's own acceleration turns: at least that is seen of what is not
    hidden by the geometry. Without gravity nothing is known of the first two.

    Parameters
    ----------
    robot : Robot
    a : (T, n) ndarray
        Accelerations of the motion, rad/s^2 or m/s^2.
    """
    distances = np.array([np.linalg.norm(joint.p) for joint in robot.joints])
    distance = float(np.median(distances[distances > 0])) if np.any(distances > 0) else 0.0
    weight = float(np.linalg.norm(robot.gravity))
    turned = float(np.sqrt(np.mean(a**2)))
    each = np.array([weight * distance, *(3 * [weight]), *(6 * [turned])])
    return np.sqrt(len(a)) * each


def written_out(name: str, coefficients: Array, others: Sequence[str]) -> str:
    """Return a parameter and multiples of others as a sum in words.

    Parameters
    ----------
    name : of the parameter that comes first, once.
    coefficients : of the others, (m,); what is zero is left out.
    others : their names, m.
    """
    text = name
    for value, other in zip(coefficients, others, strict=True):
        if value:
            sign = "+" if value > 0 else "-"
            size = f"{abs(value):.6g}"
            text += f" {sign} {other}" if size == "1" else f" {sign} {size} {other}"
    return text


def nearest_parameters(base: BaseParameters, given: Array, wanted: Array) -> Array:
    """Return the standard parameters nearest to a description, masses kept where they can be.

    The bodies need not be physically possible: every base value is kept. A body without a mass gets
    one, so that it can carry a first moment.

    Parameters
    ----------
    base : BaseParameters
        Of the robot.
    given : (10 n,) ndarray
        The description's parameters of the moving bodies.
    wanted : (b,) ndarray
        Base values.

    Returns
    -------
    (10 n,) ndarray
        Parameters of the moving bodies, each in its joint's frame.
    """
    theta = np.array(given)
    masses = theta[0::10]
    known = masses[np.isfinite(masses) & (masses > 0)]
    typical = float(np.median(known)) if known.size else 1.0
    theta[0::10] = np.where(masses > _NEXT_TO_NOTHING * typical, masses, typical)
    theta = np.where(np.isfinite(theta), theta, 0.0)
    mobility = np.ones(len(theta))
    mobility[0::10] = _MASS_STAYS
    return base.lift(wanted, theta, mobility)
