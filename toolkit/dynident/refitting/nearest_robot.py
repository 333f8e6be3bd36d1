"""The verb `refit`: the nearest robot that can be, from parameters that somebody gives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import lsq_linear

from dynident.arguments import checked
from dynident.constraints import Within
from dynident.errors import FitError
from dynident.evidence import compare
from dynident.fitting import Estimate, Metric, Prior, Projection, fit, given_estimate, project, rows
from dynident.fitting.consistent.programs import Solver
from dynident.fitting.parameter_file import GivenParameters
from dynident.model import Model
from dynident.moments import factorise
from dynident.refitting.refit_result import Refit, TorqueErrors
from dynident.refitting.refit_subject import (
    RefitSubject,
    aligned,
    in_study,
    read_subject,
    require_usable,
)
from dynident.robot import Robot
from dynident.study import Study
from dynident.threads import single_threaded


@checked
@single_threaded
def refit(
    what: Robot | Estimate | GivenParameters | RefitSubject | str | Path,
    study: Study | None = None,
    prior: Robot | Prior | None = None,
    within: Within | None = None,
    solver: Solver = "conic",
) -> Refit:
    """Make given parameters physically consistent, moving them as little as can be.

    Without recordings the distance is that of the prior (a description, a list of numbers), or the
    covariance of an estimate. With a study it is X'X of the training recordings: the parameters
    move where those do not mind.

    Parameters
    ----------
    what : see `read_subject`.
    study : recordings, and effects that the torque has beside the rigid body. Effects' parameters
        that are not given are fitted to the torque that the given inertias leave.
    prior : decides where data do not; default: the study's description, else that
        of the parameters.
    within : default: fully consistent links.
    solver : "conic" or "nlp", see `project`.

    Returns
    -------
    The nearest consistent parameters, with the proof that they are the nearest.

    Raises
    ------
    FitError
        If nothing satisfies the constraints, or the solver fails; if links need not be consistent.
    RobotError, FileError
        If what is given cannot be read, or is not finite, or beyond any robot.
    """
    within = within or Within()
    if within.consistency == "none":
        raise FitError("a refit makes links consistent", remedy="choose full or semi consistency")
    subject = what
    if not isinstance(subject, RefitSubject):
        known = study.model if study else prior.robot if isinstance(prior, Prior) else prior
        subject = read_subject(subject, known)
    subject.require_usable()
    centre = prior.robot if isinstance(prior, Prior) else prior
    require_usable(centre or (study.robot if study else subject.described))
    if study is None:
        given = subject.estimate or subject.robot
        found = project(given, prior or subject.described, within=within, solver=solver)
        return _refit(subject, found, within)
    subject = in_study(subject, study.model)
    prior = _prior(prior, study.robot)
    free = fit(study.model, study.train)
    model = replace(free.model, robot=subject.robot)
    factors = factorise(rows(model, study.train, free.values))
    R, p = factors.pooled(1.0 / free.torque_std), model.size
    start = replace(given_estimate(model.robot, model), values=_values(subject, model, R))
    metric = Metric(
        R[:p, :p], model.names, rows=factors.rows, source="X'X of the training recordings"
    )
    found = project(start, prior, metric, within, solver)
    judges = study.test if len(study.test) else study.train
    three = {"as given": start, "least squares": free, "refit": found.estimate}
    compared = compare(three, judges, criteria=study.criteria)
    errors = TorqueErrors("test" if len(study.test) else "training", compared)
    return _refit(subject, found, within, errors)


def _refit(
    subject: RefitSubject, found: Projection, within: Within, errors: TorqueErrors | None = None
) -> Refit:
    # What is written is the given description, also where another one is the prior.
    robot = subject.robot.with_links(found.estimate.links or {})
    consistency = "semi" if within.consistency == "semi" else "full"
    return Refit(
        projection=found, robot=robot, consistency=consistency, errors=errors, source=subject.source
    )


def _prior(prior: Robot | Prior | None, robot: Robot) -> Robot | Prior:
    """The prior over the joints of the study."""
    if isinstance(prior, Prior):
        return replace(prior, robot=aligned(prior.robot, robot, "prior"))
    return aligned(prior, robot, "prior") if prior is not None else robot


def _values(subject: RefitSubject, model: Model, R: np.ndarray) -> np.ndarray:
    """Parameters of a model (p,): the given ones; what is not given fits the torque left by them.

    Parameters
    ----------
    R : (p + 1, p + 1) factor of columns and torque.
    """
    values, rigid = model.given_values(), len(model.base.independent)
    open_ = []
    for i, name in enumerate(model.names[rigid:], start=rigid):
        if name in subject.effects:
            values[i] = subject.effects[name]
        else:
            open_.append(i)
    if not open_:
        return values
    bounds = [one for effect in model.effects for one in effect.parameters(model.robot)]
    lower = np.array([bounds[i - rigid].lower for i in open_])
    upper = np.array([bounds[i - rigid].upper for i in open_])
    left = R[:, -1] - R[:, :-1] @ values
    columns = R[:, open_]
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    # Within their bounds, so that a robot that can be comes back as it is.
    found = lsq_linear(columns / size, left, (lower * size, upper * size), method="bvls")
    values[open_] = np.clip(found.x / size, lower, upper)
    return values
