"""Constrained least squares by semidefinite program, beside Clarabel alone and figaroh.

    python benchmarks/constrained_fit.py [--repeats 7] [--figaroh PYTHON]

A seven-joint arm, 1000 noisy samples: 7000 rows, 91 parameters (ten of each link, rotor inertia,
viscous and Coulomb friction). All solve the same problem: weighted least squares plus a quadratic
prior over fully consistent links. Times are the median of several runs, in one process, in
milliseconds of wall clock; "reading" is all from the rows in memory to the program.

  by hand, solve only    the same cone program written by hand in Drake, rows reduced beforehand:
                         only Clarabel's solve is timed
  by hand, all           its reading (QR and symbolic-free constraints) and solve
  by hand, 7000 rows     the same without the reduction
  dynident               reading, solve, bound and certificate
  figaroh                solve_direct_effort_fit (PICOS, CVXOPT), with figaroh's own prior term, in
                         its own environment: --figaroh PYTHON names an interpreter that has it
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver, MathematicalProgram

from dynident.constraints import ParameterSpace, Within
from dynident.fitting.consistent.posterior import sized
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import solve
from dynident.inertia import pseudo_inertia
from dynident.model import Model
from dynident.nlp import Problem
from dynident.threads import single_threaded
from least_squares_memory import arm

SAMPLES, NOISE = 1000, 2.0  # N m: enough that least squares alone is impossible in most links

FIGAROH = """
import json, sys, time
import numpy as np
from figaroh.identification.physical_fit import PhysicalPolicy, build_problem
from figaroh.identification.physical_fit import solve_direct_effort_fit
data = np.load(sys.argv[1])
times = []
for _ in range(int(sys.argv[2])):
    start = time.perf_counter()
    problem = build_problem(data["Y"], data["tau"], list(data["names"]), list(data["joints"]),
                            prior=data["prior"], policy=PhysicalPolicy(prior_weight=1e-6))
    record = solve_direct_effort_fit(problem, solver="cvxopt")
    times.append(time.perf_counter() - start)
theta = record.theta
residual = None if theta is None else float(np.linalg.norm(data["Y"] @ theta - data["tau"]))
print(json.dumps({"times": times, "status": record.solver_status, "residual": residual}))
"""


def rows() -> tuple[ParameterSpace, np.ndarray, np.ndarray, Prior, np.ndarray]:
    """Space, columns (7000, 91), torque (7000,), prior and the truth, in units of the noise."""
    robot = arm()
    model = Model(robot) + "rotor_inertia" + "viscous_friction" + "coulomb_friction"
    space = ParameterSpace.of(model)
    rng = np.random.default_rng(0)
    q, v, a = robot.random_motion(0, SAMPLES)
    q, v, a = 0.3 * q, 0.2 * v, 0.2 * a
    block = model.block(np.arange(SAMPLES) * 0.01, q, v, a)
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


def timed(what, repeats: int) -> tuple[float, Any]:
    times, result = [], None
    for _ in range(repeats):
        start = time.perf_counter()
        result = what()
        times.append(time.perf_counter() - start)
    return 1e3 * median(times), result


def reduced(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    R = np.asarray(np.linalg.qr(np.column_stack([A, b]), mode="r"))
    return R[:, :-1], R[:, -1]


@single_threaded
def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--figaroh", metavar="PYTHON", help="interpreter that has figaroh")
    said = parser.parse_args()
    space, Y, tau, prior, truth = rows()
    whole = problem_of(space, Y, tau, prior)
    solver = ClarabelSolver()

    A, b = reduced(whole.A, whole.b)
    program, z = by_hand(space, A, b)
    alone, result = timed(lambda: solver.Solve(program), said.repeats)
    hand = space.scale * result.GetSolution(z)

    def all_by_hand():
        return solver.Solve(by_hand(space, *reduced(whole.A, whole.b))[0])

    written, _ = timed(all_by_hand, said.repeats)
    tall, _ = timed(lambda: solver.Solve(by_hand(space, whole.A, whole.b)[0]), said.repeats)
    ours, answer = timed(lambda: solve(problem_of(space, Y, tau, prior), "conic"), said.repeats)
    print(f"{len(Y)} rows, {space.size} parameters; objective relative to dynident's")
    print(f"{'':22s} {'ms':>9s} {'of solve only':>14s} {'objective':>12s}")
    best = whole.objective(answer.x)
    for name, ms, x in (
        ("by hand, solve only", alone, hand),
        ("by hand, all", written, hand),
        ("by hand, 7000 rows", tall, hand),
        ("dynident", ours, answer.x),
    ):
        print(f"{name:22s} {ms:9.1f} {ms / alone:14.2f} {whole.objective(x) / best:12.8f}")
    certificate = answer.certificate
    print(f"dynident's certificate: gap {certificate.gap:.1e}; {certificate.sentence}")
    if not said.figaroh:
        print("figaroh: not run (--figaroh PYTHON)")
        return
    own = beside(said.figaroh, space, NOISE * Y, NOISE * tau, said.repeats)
    ms = 1e3 * median(own["times"])
    print(f"{'figaroh':22s} {ms:9.1f} {ms / alone:14.2f} {own['status']:>12s}")
    mine, true = (NOISE * np.linalg.norm(Y @ x - tau) for x in (answer.x, truth))
    words = f"dynident {mine:.6g}, figaroh {own['residual']:.6g}, truth {true:.6g}"
    print(f"residual, N m: {words}")


def beside(
    python: str, space: ParameterSpace, Y: np.ndarray, tau: np.ndarray, repeats: int
) -> dict:
    """Run figaroh on the same rows in its own environment."""
    joints = [f"j{k}" for k in range(7)]
    names = [
        *(f"{p.partition('.')[0]}_{joints[k // 10]}" for k, p in enumerate(space.names[:70])),
        *(f"extra_{name}" for name in space.names[70:]),
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "rows.npz"
        np.savez(file, Y=Y, tau=tau, names=names, joints=joints, prior=space.given)
        command = [python, "-c", FIGAROH, str(file), str(repeats)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
