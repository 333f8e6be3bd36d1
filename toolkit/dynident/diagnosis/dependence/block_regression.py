"""Kernel regressions in which each block of rows is predicted from the others.

Kernels are exp(-distance), those of rough functions: they take jumps and bends as well as smooth
shapes, and have no width that would have to be right. A held-out block needs no fit of its own:
what is left of it follows from the inverse of the whole (Rasmussen and Williams, Gaussian Processes
for Machine Learning, 2006, section 5.4.2, for blocks in place of single rows).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import get_blas_funcs, get_lapack_funcs
from scipy.spatial.distance import pdist, squareform

from dynident.diagnosis.dependence.joint_inputs import JointInputs
from dynident.diagnosis.dependence.motion_blocks import HeldOutUnit
from dynident.errors import FitError

FINE = 0.3
"""Width, over the spread of an input, of kernels for what varies fast in that input alone."""


def kernel(*columns: np.ndarray, width: float = 1.0) -> np.ndarray:
    """Similarity of all rows in some inputs, exp(-distance / width), (T, T).

    Parameters
    ----------
    columns : (T, k) each, in units of their spread.
    width : in these units.
    """
    return _of_pairs(_alike(*columns, width=width))


def _alike(*columns: np.ndarray, width: float = 1.0) -> np.ndarray:
    """Similarity of each pair of different rows, as `pdist` has them: half of what there is."""
    distance = pdist(np.hstack(columns))
    distance /= -width
    return np.exp(distance, out=distance)


def _of_pairs(similarity: np.ndarray) -> np.ndarray:
    """The kernel (T, T) whose rows are alike by 1 to themselves, from that of each pair."""
    found = squareform(similarity)
    np.fill_diagonal(found, 1.0)
    return found


def centred(similarity: np.ndarray) -> np.ndarray:
    """Return a kernel of functions whose mean over the rows is zero, (T, T)."""
    mean = similarity.mean(axis=0)
    return similarity - mean - mean[:, None] + mean.mean()


def of_state(x: JointInputs) -> np.ndarray:
    """Kernel of functions of position and velocity of the joint."""
    together = _alike(x.position, x.velocity, x.direction)
    slow = _alike(x.velocity, x.direction, width=FINE)
    return _of_pairs(0.25 * (1.0 + together + slow + _alike(x.position, width=FINE)))


def of_acceleration(x: JointInputs) -> np.ndarray:
    """Kernel of what acceleration and load add, at any velocity."""
    every = (_alike(x.acceleration, x.load), _alike(x.acceleration), _alike(x.load))
    return _at_any_state(x, _of_pairs(_mean(every)))


def of_past(x: JointInputs) -> np.ndarray:
    """Kernel of what each of the inputs of the past adds, at any velocity."""
    return _at_any_state(x, _of_pairs(_mean([_alike(column[:, None]) for column in x.past.T])))


def of_speeds(x: JointInputs) -> np.ndarray:
    """Kernel of what the speeds of other joints add: with that of the joint, and their products."""
    others = [one[:, :1] for one in x.others]
    if not others:
        return np.zeros((len(x.time),) * 2)
    together = _of_pairs(_mean([_alike(x.velocity, one) for one in others]))
    straight = _mean([one @ one.T for one in (x.velocity, *others)])
    return 0.5 * centred(together + straight**2)


def of_position_errors(x: JointInputs) -> np.ndarray:
    """Kernel of what errors of the measured positions do, where they depend on the position."""
    columns = x.position_errors
    return columns @ columns.T / max(columns.shape[1], 1)


def of_others(x: JointInputs) -> np.ndarray:
    """Kernel of what the motion of each other joint adds, at any velocity."""
    found = []
    for one in x.others:
        velocity, direction, acceleration, position = np.split(one, [1, 2, 3], axis=1)
        found += [_alike(position), _alike(velocity, direction), _alike(acceleration)]
    return _at_any_state(x, _of_pairs(_mean(found))) if found else np.zeros((len(x.time),) * 2)


def of_time(x: JointInputs) -> np.ndarray:
    """Kernel of what the time in the session and the recording add, at any velocity.

    Smooth functions of time only: a rough one would follow slow noise across a held-out block.
    """
    record = np.equal.outer(x.record, x.record).astype(float)
    smooth = np.exp(-0.5 * squareform(pdist(x.time, "sqeuclidean")))
    return _at_any_state(x, 0.5 * (smooth + record))


def _mean(similarities: Sequence[np.ndarray]) -> np.ndarray:
    return sum(similarities[1:], similarities[0]) / len(similarities)


def _at_any_state(x: JointInputs, similarity: np.ndarray) -> np.ndarray:
    """Let what inputs add differ between states of the joint; a function of the state is none."""
    own = kernel(x.position, x.velocity, x.direction)
    straight = x.velocity @ x.velocity.T + x.direction @ x.direction.T
    return 0.25 * (1.0 + own + straight) * centred(similarity)


def left_of_each_unit(
    similarity: np.ndarray, residual: np.ndarray, units: Sequence[HeldOutUnit]
) -> np.ndarray:
    """Return what a regression leaves of each unit when it is fitted to the others.

    Parameters
    ----------
    similarity : (T, T) kernel, in units of the variance of what it does not predict.
    residual : (T,) what is to be predicted.
    units : which rows are held out together; every row is in one of them.

    Returns
    -------
    (T,) in the unit of the residual.

    Raises
    ------
    FitError
        If the kernel is not positive definite beside noise.
    """
    whole = similarity.T.copy(order="F")  # it is symmetric: as it lies in memory, for LAPACK
    whole[np.diag_indices_from(whole)] += 1.0
    factorised, inverted, solved = get_lapack_funcs(("potrf", "trtri", "posv"), (whole,))
    (product,) = get_blas_funcs(("trmv",), (whole,))
    # Of the inverse of the whole its blocks alone are needed: products of that of its factor.
    factor, status = factorised(whole, lower=1, overwrite_a=1)
    if status == 0:
        factor, status = inverted(factor, lower=1, overwrite_c=1)
    if status != 0:
        raise FitError("a kernel regression on the residual is singular")
    weights = product(factor, product(factor, residual, lower=1), lower=1, trans=1)
    if not np.all(np.isfinite(weights)):
        raise FitError("a kernel regression on the residual is not finite")
    left = np.empty_like(residual)
    for unit in units:
        out = unit.left_out
        part = factor[out[0] :, out]  # above it is zero
        # Thousands of small systems: checks of their numbers would take longer than they do.
        _, predicted, status = solved(part.T @ part, weights[out], lower=1)
        if status != 0:
            raise FitError("a kernel regression on a part of the residual is singular")
        left[unit.rows] = predicted[np.searchsorted(out, unit.rows)]
    return left
