"""Time of a projection against the number of links.

Chains of revolute joints with viscous friction, an estimate with much noise, the default prior with
a spread of 10: the optimum is on the boundary for most links. Program and certificate; Ipopt, over
virtual and over log-Cholesky parameters, where it takes less than minutes.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from arms import chain
from dynident.constraints import Consistency, ParameterSpace, Within
from dynident.fitting.consistent.posterior import sized
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import Solver, solve
from dynident.model import Model
from dynident.nlp import Problem
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

SAMPLES_PER_LINK, NOISE, SPREAD = 30, 1.0, 10.0
LONGEST_NONLINEAR = 5
NAMES: dict[Solver, str] = {"conic": "dynident, Clarabel", "nlp": "Ipopt"}


def problem(n: int, consistency: Consistency) -> Problem:
    """The projection of a noisy estimate of a chain."""
    robot = chain(n)
    model = Model(robot) + "viscous_friction"
    space = ParameterSpace.of(model)
    rng = np.random.default_rng(0)
    samples = SAMPLES_PER_LINK * n
    columns = model.columns(model.block(np.arange(samples), *robot.random_motion(0, samples)))
    X = columns.reshape(-1, model.size) @ space.combination
    truth = space.given + 0.1 * (np.arange(space.size) >= space.rigid)
    torque = X @ truth
    std = NOISE * np.sqrt(np.mean(torque**2))
    rows = np.column_stack([X, torque + std * rng.normal(size=len(X))]) / std
    R = np.asarray(np.linalg.qr(rows, mode="r"))[:-1]
    space = sized(space, R[:, :-1], len(X), truth)
    held, at = Prior(robot, spread=SPREAD).rows(space, truth)
    A, b = np.vstack([R[:, :-1], held]), np.append(R[:, -1], at)
    return Problem(space, A, b, Within(consistency))


@single_threaded
def lines(size: Size) -> Iterator[Line]:
    links = {"tiny": (2,), "quick": (5, 10), "full": (5, 10, 20, 30, 60)}[size]
    notions: tuple[Consistency, ...] = ("full", "semi")
    for consistency in notions:
        for n in links:
            for solver, who in NAMES.items():
                if solver == "nlp" and n > LONGEST_NONLINEAR:
                    continue
                posed = problem(n, consistency)
                spent, found = cpu(lambda p=posed, s=solver: solve(p, s))
                figures = {
                    "CPU, s": spent,
                    "unknowns": float(posed.space.size),
                    "gap proved": found.certificate.gap,
                }
                case = f"{n} links, {consistency} consistency"
                at = float(n) if consistency == "full" else None
                yield Line(case=case, who=who, figures=figures, at=at)


BENCHMARK = Benchmark(
    title="A projection against the number of links",
    work="The nearest physically consistent parameters of a noisy estimate of a chain, with the "
    "certificate that bounds how far they are from the best. Ipopt solves the same program in "
    "other coordinates.",
    compared="CPU, s",
    lines=lines,
    axis="links",
)
