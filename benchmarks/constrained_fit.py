"""Constrained least squares by semidefinite program, beside what one writes by hand and figaroh.

A seven-joint arm, 1000 noisy samples: 7000 rows, 91 parameters (ten of each link, rotor inertia,
viscous and Coulomb friction). All solve the same problem, weighted least squares plus a quadratic
prior over fully consistent links, from the rows in memory; figaroh has a prior of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from arms import arm
from dynident.constraints import ParameterSpace, Within
from dynident.fitting.consistent.posterior import sized
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import solve
from dynident.inertia import pseudo_inertia
from dynident.model import Model
from dynident.nlp import Problem
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu
from side_by_side.peer import Peer, PeerMissing

NOISE = 2.0  # N m: enough that least squares alone is impossible in most links


def rows(samples: int) -> tuple[ParameterSpace, np.ndarray, np.ndarray, Prior, np.ndarray]:
    """Space, columns (7000, 91), torque (7000,), prior and the truth, in units of the noise."""
    robot = arm()
    model = Model(robot) + "rotor_inertia" + "viscous_friction" + "coulomb_friction"
    space = ParameterSpace.of(model)
    rng = np.random.default_rng(0)
    q, v, a = robot.random_motion(0, samples)
    q, v, a = 0.3 * q, 0.2 * v, 0.2 * a
    block = model.block(np.arange(samples) * 0.01, q, v, a)
    effects = model.columns(block)[:, :, len(model.base.independent) :]
    Y = np.concatenate([robot.regressor(q, v, a), effects], axis=2).reshape(-1, space.size)
    truth = np.concatenate([robot.theta, np.full(7, 0.2), np.full(7, 2.0), np.full(7, 4.0)])
    tau = Y @ truth + NOISE * rng.normal(size=len(Y))
    space = sized(space, Y / NOISE, len(Y), truth)
    return space, Y / NOISE, tau / NOISE, Prior(robot, spread=3.0), truth


def problem_of(space: ParameterSpace, Y: np.ndarray, tau: np.ndarray, prior: Prior) -> Problem:
    held, at = prior.rows(space, space.given)
    return Problem(space, np.vstack([Y, held]), np.append(tau, at), Within("full", inset=0.0))


def by_hand(space: ParameterSpace, A: np.ndarray, b: np.ndarray) -> tuple[Any, np.ndarray]:
    """The cone program as one writes it in Drake, parameters in units of their size."""
    program: Any = MathematicalProgram()
    z = program.NewContinuousVariables(space.size)
    program.AddL2NormCost(np.asfortranarray(A * space.scale), -b, z)
    basis = [pseudo_inertia(unit) for unit in np.eye(10)]
    for k in range(len(space.bodies)):
        part = slice(10 * k, 10 * k + 10)
        S = np.diag([space.scale[10 * k + 4] ** -0.5] * 3 + [space.scale[10 * k] ** -0.5])
        F = [s * S @ one @ S for s, one in zip(space.scale[part], basis, strict=True)]
        program.AddLinearMatrixInequalityConstraint([np.zeros((4, 4)), *F], z[part])
    bounded = np.flatnonzero(np.isfinite(space.lower))
    program.AddBoundingBoxConstraint(0.0, np.inf, z[bounded])
    return program, z


def reduced(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    R = np.asarray(np.linalg.qr(np.column_stack([A, b]), mode="r"))
    return R[:, :-1], R[:, -1]


@single_threaded
def lines(size: Size) -> Iterator[Line]:
    samples, repeats = {"tiny": (100, 1), "quick": (1000, 2), "full": (1000, 7)}[size]
    space, Y, tau, prior, truth = rows(samples)
    whole = problem_of(space, Y, tau, prior)
    case = f"{len(Y)} rows, {space.size} parameters"
    solver = ClarabelSolver()

    def all_by_hand(A: np.ndarray, b: np.ndarray) -> np.ndarray:
        program, z = by_hand(space, A, b)
        return space.scale * solver.Solve(program).GetSolution(z)

    ours, answer = cpu(lambda: solve(problem_of(space, Y, tau, prior), "conic"), repeats)
    best = whole.objective(answer.x)

    def line(who: str, seconds: float, x: np.ndarray) -> Line:
        figures = {
            "CPU, ms": 1e3 * seconds,
            "objective over ours": whole.objective(x) / best,
            "residual, N m": NOISE * float(np.linalg.norm(Y @ x - tau)),
        }
        return Line(case=case, who=who, figures=figures)

    yield line("dynident, certificate included", ours, answer.x)
    spent, x = cpu(lambda: all_by_hand(*reduced(whole.A, whole.b)), repeats)
    yield line("Drake by hand, rows reduced by QR first", spent, x)
    spent, x = cpu(lambda: all_by_hand(whole.A, whole.b), 1)
    yield line("Drake by hand", spent, x)
    bodies = len(space.bodies)
    nonnegative = np.flatnonzero(np.isfinite(space.lower))
    given = {"scale": space.scale, "bodies": bodies, "nonnegative": nonnegative}
    cone = Peer(script="cvxpy_constrained.py", environment="cvxpy")
    A, b = reduced(whole.A, whole.b)
    for who, asked in (
        ("cvxpy by hand, rows reduced by QR first", {"A": A, "b": b}),
        ("cvxpy by hand", {"A": whole.A, "b": whole.b}),
    ):
        yield from beside(case, who, cone, {**given, **asked}, line)
    yield from beside(
        case,
        "figaroh, its own prior",
        Peer(script="figaroh_constrained.py", environment="figaroh"),
        {"Y": NOISE * Y, "tau": NOISE * tau, "prior": space.given, **figaroh_names(space)},
        line,
    )
    figures = {k: v for k, v in line("", 0.0, truth).figures.items() if k != "CPU, ms"}
    yield Line(case=case, who="the truth", figures=figures)


def beside(
    case: str, who: str, peer: Peer, work: dict[str, Any], line: Callable[..., Line]
) -> Iterator[Line]:
    try:
        said = peer.ask(work)
    except PeerMissing as missing:
        yield Line(case=case, who=who, missing=str(missing))
    else:
        yield line(who, said["warm"], np.array(said["values"]))


def figaroh_names(space: ParameterSpace) -> dict[str, list[str]]:
    """Columns as it calls them: kind and joint."""
    joints = [f"j{k}" for k in range(len(space.bodies))]
    rigid = 10 * len(joints)
    names = [
        *(f"{p.partition('.')[0]}_{joints[k // 10]}" for k, p in enumerate(space.names[:rigid])),
        *(f"extra_{name}" for name in space.names[rigid:]),
    ]
    return {"names": names, "joints": joints}


BENCHMARK = Benchmark(
    title="Physically consistent least squares",
    work="Weighted least squares plus a quadratic prior over links whose pseudo-inertia is "
    "positive semidefinite, with noise so large that least squares alone is impossible in most "
    "links. From the rows in memory to the answer; all but figaroh use Clarabel.",
    compared="CPU, ms",
    lines=lines,
)
