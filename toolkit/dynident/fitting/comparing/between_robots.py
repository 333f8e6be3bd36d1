"""Values of robots of one kind: what is usual, how much robots spread, and who is beyond that.

theta_i = mu + b_i + e_i: robots spread by nature (b, variance tau^2, unknown) and each value has
its own uncertainty (e, variance s_i^2, from its estimate). With few robots tau is known badly,
which is why the tail is Student's and not the normal one.

Sources: Paule and Mandel, "Consensus values and weighting factors", J. Res. NBS 87, 1982;
DerSimonian and Kacker, "Random-effects model for meta-analysis of clinical trials", Contemp. Clin.
Trials 28, 2007 (its solution by Newton's method); Satterthwaite, Biometrics Bull. 2, 1946; Holm,
Scand. J. Stat. 6, 1979.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from dynident.fitting.estimate import Estimate
from dynident.robot import BaseParameters, base_parameters

_SAME = 1e-6  # sine of the angle below which two robots' unidentified directions are one
_ROUNDING = 1e-12  # share of a value below which a standard deviation is rounding
_STEPS = 100  # of Newton's method, which comes from below; ten are the rule


@dataclass(frozen=True, eq=False, kw_only=True)
class UsualValue:
    """What is usual among some robots, parameter by parameter, (k,) each.

    Attributes
    ----------
    mean : mu, weighted.
    spread : tau, the standard deviation between robots beyond their own uncertainty.
    weights : (m, k) of the robots in the mean, 1 / (s^2 + tau^2).
    """

    mean: np.ndarray
    spread: np.ndarray
    weights: np.ndarray

    @property
    def variance(self) -> np.ndarray:
        """Variance of the mean."""
        return 1.0 / np.sum(self.weights, axis=0)


@dataclass(frozen=True, eq=False, kw_only=True)
class AgainstOthers:
    """Each robot against the others, (m, k) each; what they are says `RobotComparison`."""

    usual: np.ndarray
    spread: np.ndarray
    z: np.ndarray
    freedom: np.ndarray
    p_value: np.ndarray


def common_basis(bases: Sequence[BaseParameters]) -> BaseParameters:
    """Return the combinations that each of some bases of the same parameters identifies."""
    scale = np.sum([one.scale / np.linalg.norm(one.scale) for one in bases], axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    # What is open in any robot is open in common; in units of torque, where angles mean something.
    open_ = [np.linalg.qr(_open_directions(one, scale))[0] for one in bases]
    hidden = _span(np.hstack(open_))
    for one in bases:
        if len(one.dependent) == hidden.shape[1]:
            return one
    return _orthogonal_to(hidden, scale, bases[0].names)


def part_of_basis(basis: BaseParameters, kept: np.ndarray) -> BaseParameters:
    """Return the combinations of some parameters alone that a basis identifies.

    Parameters
    ----------
    basis : of p parameters.
    kept : their places, in the order of the answer.
    """
    if np.array_equal(kept, np.arange(len(basis.names))):
        return basis
    scale = np.where(basis.scale > 0, basis.scale, 1.0)
    # A combination of these is seen if no open direction changes it, whatever else that changes.
    open_ = np.linalg.qr(_open_directions(basis, scale))[0][kept]
    return _orthogonal_to(_span(open_), scale[kept], [basis.names[i] for i in kept])


def _open_directions(basis: BaseParameters, scale: np.ndarray) -> np.ndarray:
    """Directions (p, p - r) that a basis leaves open, in units of torque."""
    null = np.zeros((len(scale), len(basis.dependent)))
    null[list(basis.independent)] = -basis.K
    null[list(basis.dependent), np.arange(len(basis.dependent))] = 1.0
    return scale[:, None] * null


def _span(directions: np.ndarray) -> np.ndarray:
    vectors, sizes, _ = np.linalg.svd(directions, full_matrices=False)
    return vectors[:, sizes > _SAME]


def _orthogonal_to(hidden: np.ndarray, scale: np.ndarray, names: Sequence[str]) -> BaseParameters:
    shown = np.eye(len(scale)) - hidden @ hidden.T
    shown[:, np.linalg.norm(shown, axis=0) < _SAME] = 0.0
    return base_parameters(shown * scale, names, _SAME)


def values_in_common(
    estimates: Sequence[Estimate], basis: BaseParameters
) -> tuple[np.ndarray, np.ndarray]:
    """Return combinations' values in every robot, and their variances, (m, r) each.

    Parameters
    ----------
    estimates : of m robots.
    basis : of `common_basis`.
    """
    B = basis.combination
    values = np.array([B @ one.values for one in estimates])
    # A covariance is that of a robot's own combinations, at their heads: these make up the row.
    variances = [np.einsum("ij,jk,ik->i", B, one.covariance, B) for one in estimates]
    return values, np.maximum(variances, 0.0)


def usual_value(values: np.ndarray, variances: np.ndarray) -> UsualValue:
    """Return mean and spread of robots by Paule and Mandel.

    The spread is where the weighted squares about the weighted mean are what they should be, one
    for each degree of freedom; zero where their own uncertainties explain them.

    Parameters
    ----------
    values, variances : (m, k) of m robots, at least two, with the variance of each value.
    """
    freedom = len(values) - 1
    least = (_ROUNDING * np.max(np.abs(values), axis=0)) ** 2 + np.finfo(float).tiny
    own = np.maximum(variances, least)
    # The solution is nowhere below this, and Newton's steps from below never pass it.
    tau2 = np.maximum(np.var(values, axis=0, ddof=1) - np.max(own, axis=0), 0.0)
    for _ in range(_STEPS):
        weights = 1.0 / (own + tau2)
        mean = np.sum(weights * values, axis=0) / np.sum(weights, axis=0)
        squares = weights * (values - mean) ** 2
        excess = np.sum(squares, axis=0) - freedom
        step = np.maximum(excess, 0.0) / np.maximum(
            np.sum(weights * squares, axis=0), np.finfo(float).tiny
        )
        tau2 = tau2 + step
        if np.all(step <= 1e-10 * (tau2 + np.min(own, axis=0))):
            break
    weights = 1.0 / (own + tau2)
    mean = np.sum(weights * values, axis=0) / np.sum(weights, axis=0)
    return UsualValue(mean=mean, spread=np.sqrt(tau2), weights=weights)


def against_others(values: np.ndarray, variances: np.ndarray) -> AgainstOthers:
    """Judge each robot by the others alone.

    z = (theta_i - mu) / sqrt(s_i^2 + tau^2 + var(mu)), mu and tau without robot i. Its degrees of
    freedom are Satterthwaite's for the variance below the root, and never more than the m - 2 that
    the others have: an estimate of tau that happens to be small would promise too many.

    Parameters
    ----------
    values, variances : (m, k) of m robots, at least three.
    """
    rows = []
    for i, (value, variance) in enumerate(zip(values, variances, strict=True)):
        others = np.arange(len(values)) != i
        usual = usual_value(values[others], variances[others])
        total = variance + usual.spread**2 + usual.variance
        share = usual.weights * usual.variance
        # Standard deviation of tau^2 over sqrt(2), and how the whole variance follows tau^2.
        doubt = np.sqrt(len(share) - 1) / np.sum(usual.weights * (1.0 - share), axis=0)
        slope = 1.0 + np.sum(share**2, axis=0)
        freedom = np.minimum((total / (doubt * slope)) ** 2, len(share) - 1)
        z = (value - usual.mean) / np.sqrt(total)
        rows.append((usual.mean, usual.spread, z, freedom, 2.0 * stdtr(freedom, -np.abs(z))))
    usual, spread, z, freedom, p = (np.array(column) for column in zip(*rows, strict=True))
    return AgainstOthers(usual=usual, spread=spread, z=z, freedom=freedom, p_value=p)


def holm(p_values: np.ndarray) -> np.ndarray:
    """Return p values corrected for their number, of any shape: that any is a false alarm."""
    order = np.argsort(p_values, axis=None)
    left = np.arange(len(order), 0, -1)
    found = np.empty(len(order))
    found[order] = np.minimum(np.maximum.accumulate(left * p_values.flat[order]), 1.0)
    return found.reshape(p_values.shape)
