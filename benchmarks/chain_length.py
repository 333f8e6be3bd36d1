"""Time of a projection against the number of links.

    python benchmarks/chain_length.py [--links 5 10 20 30 60] [--nonlinear]

Chains of revolute joints with viscous friction, an estimate with much noise, the default prior with
a spread of 10: the optimum is on the boundary for most links. What is printed is the wall clock of
the program and its certificate, the gap that the certificate proves, and the exponent with which
the time grows from one length to the next. --nonlinear adds Ipopt, over virtual and over
log-Cholesky parameters, where it takes less than minutes: up to 10 links.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from dynident.constraints import Consistency, ParameterSpace, Within
from dynident.fitting.consistent.posterior import sized
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import Solver, solve
from dynident.model import Model
from dynident.nlp import Problem
from dynident.robot import Robot
from dynident.threads import single_threaded

SAMPLES_PER_LINK, NOISE, SPREAD = 30, 1.0, 10.0
LONGEST_NONLINEAR = 10


def chain(n: int) -> Robot:
    """A chain of n links, neighbouring axes at right angles."""
    rng = np.random.default_rng(n)
    parts = ['<robot name="chain"><link name="base"/>']
    for k in range(n):
        x, y, z = rng.uniform(-0.05, 0.15, 3)
        moments = rng.uniform(0.01, 0.02, 3)
        entries = " ".join(f'i{a}{a}="{m}"' for a, m in zip("xyz", moments, strict=True))
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="{x} {y} {z}"/>'
            f'<mass value="{rng.uniform(1, 4)}"/><inertia {entries}/></inertial></link>'
            f'<joint name="j{k}" type="revolute">'
            f'<parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="0 0 {0.3 if k else 0}" rpy="{1.5708 * (-1) ** k} 0 0"/>'
            '<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="9"/></joint>'
        )
    return Robot.from_text("".join(parts) + "</robot>")


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
def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--links", type=int, nargs="*", default=[5, 10, 20, 30, 60])
    parser.add_argument("--nonlinear", action="store_true")
    said = parser.parse_args()
    solvers: tuple[Solver, ...] = ("conic", "nlp") if said.nonlinear else ("conic",)
    print(f"{'set':5s} {'solver':6s} {'links':>5s} {'unknowns':>8s} {'s':>8s} {'grows':>6s} gap")
    notions: tuple[Consistency, ...] = ("full", "semi")
    for consistency in notions:
        for solver in solvers:
            before: tuple[int, float] | None = None
            for n in said.links:
                if solver == "nlp" and n > LONGEST_NONLINEAR:
                    continue
                posed = problem(n, consistency)
                start = time.perf_counter()
                certificate = solve(posed, solver).certificate
                seconds = time.perf_counter() - start
                grows = ""
                if before:
                    grows = f"n^{np.log(seconds / before[1]) / np.log(n / before[0]):.1f}"
                before = (n, seconds)
                size, gap = posed.space.size, certificate.gap
                print(
                    f"{consistency:5s} {solver:6s} {n:5d} {size:8d} {seconds:8.3f} {grows:>6s} "
                    f"{gap:.1e}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
