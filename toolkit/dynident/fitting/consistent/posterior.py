"""The objective of a projection or a constrained fit: data in units of noise, and a prior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.constraints import ParameterSpace, Vanishing, Within
from dynident.errors import FitError
from dynident.fitting.consistent.metric import Metric
from dynident.fitting.consistent.prior import Prior
from dynident.inertia import margins
from dynident.nlp import Problem


def posterior(
    space: ParameterSpace,
    x_hat: np.ndarray,
    names: tuple[str, ...],
    prior: Prior,
    metric: Metric | None,
    within: Within,
) -> tuple[Problem, tuple[str, ...]]:
    """State a projection as a problem.

    Parameters
    ----------
    space : the s standard parameters.
    x_hat : (s,) what is projected.
    names : the model's parameters.
    prior, metric, within : as of `project`.

    Returns
    -------
    The problem, and what has to be noted about it.

    Raises
    ------
    FitError
        If the metric is one of other parameters.
    """
    if metric is None:
        # The divergence from a body that cannot be is infinite; the quadratic is its second order.
        A, b = replace(prior, distance="quadratic").rows(space, x_hat)
        notes = ("No data: nearest under the prior's own quadratic metric, link by link.",)
        return Problem(space, A, b, within), notes
    mapping = mapping_of(space, metric, names)
    space = sized(space, metric.R @ mapping, metric.rows, x_hat)
    rows = metric.R @ mapping
    centre, notes = prior_centre(space, x_hat)
    held, held_at = prior.rows(space, centre)
    off = [metric.names.index(name) for name in metric.irrelevant]
    if off:
        within = replace(within, sets=(*within.sets, Vanishing(mapping[off])))
        notes = (*notes, f"Irrelevant, and kept at zero: {', '.join(metric.irrelevant)}.")
    A, b = np.vstack([rows, held]), np.concatenate([rows @ x_hat, held_at])
    return Problem(space, A, b, within, entropy=prior.entropy(space)), (*metric.notes, *notes)


def mapping_of(space: ParameterSpace, metric: Metric, names: tuple[str, ...]) -> np.ndarray:
    """Return the map from standard parameters to those of the metric, (p, s).

    Parameters
    ----------
    space : the s standard parameters.
    metric : of the model's parameters, or of the standard ones.
    names : the model's parameters.

    Raises
    ------
    FitError
        If the metric is one of other parameters.
    """
    if metric.names == space.names:
        return np.eye(space.size)
    if metric.names == names:
        return space.combination
    what = f"the metric's {len(metric.names)} parameters are not those of the estimate"
    remedy = (
        f"state it for the model's {len(names)} ({names[0]}, ...), or all {space.size} standard"
    )
    raise FitError(what, remedy=remedy)


def sized(space: ParameterSpace, rows: np.ndarray, count: int, x_hat: np.ndarray) -> ParameterSpace:
    """Return the space with sizes of the effects' parameters: what makes a torque like the noise.

    Parameters
    ----------
    space : the s standard parameters.
    rows : (r, s) of the data, in units of noise.
    count : equations behind them.
    x_hat : (s,) whose effects are taken as their size where no data show them.
    """
    norms = np.linalg.norm(rows[:, space.rigid :], axis=0)
    values = np.abs(x_hat[space.rigid :])
    fallback = np.where(values > 0, values, 1.0)
    seen = norms > 0
    root = np.sqrt(max(count, len(rows), 1))
    sizes = np.where(seen, root / np.where(seen, norms, 1.0), fallback)
    return space.sized(sizes)


def prior_centre(space: ParameterSpace, x_hat: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the centre of a prior (s,), and what has to be noted about it.

    It is the description, links that no rigid body can have replaced by reference bodies of their
    size. Of the effects the description says nothing: their centre is what data say, `x_hat` (s,).
    """
    centre = np.concatenate([space.given[: space.rigid], x_hat[space.rigid :]])
    replaced = []
    for k, body in enumerate(space.bodies):
        part = slice(10 * k, 10 * k + 10)
        if not margins(centre[part]).consistent:
            centre[part] = space.references[k]
            replaced.append(body)
    if not replaced:
        return centre, ()
    words = f"The prior's own links are impossible: {', '.join(replaced)}."
    return centre, (f"{words} Its centre there is a reference body of their size.",)
