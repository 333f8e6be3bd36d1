"""Regressor and torque of many samples, beside a loop over Pinocchio.

    python benchmarks/batch_regressor.py [--samples 16384] [--links 2 7 30 60]

The arms of `problems/`, then chains of revolute joints, on one thread. What is printed is the time
a sample of a loop that keeps what Pinocchio computes, and of the same through `dynident.batch`, for
a block of samples as fits take them, replayed by NumPy and compiled; how many times quicker each
is; and the seconds to write the function out and to compile it. "base" is the columns of the base
parameters, "all" all of them.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio

from chain_length import chain
from dynident.batch import Kernel
from dynident.batch.newton_euler import regressor_equations, torque_equations
from dynident.robot import Robot, structural_base

pin: Any = pinocchio  # its bindings carry no types

PROBLEMS = Path(__file__).parents[1] / "problems"
ARMS = ("panda/panda.urdf", "iiwa/iiwa.urdf")
REPEATS = 5
LONGEST_PINOCCHIO = 200_000  # joints times samples of the loop
LONGEST_COMPILED = 30
MEMORY = 2**27  # bytes of the regressor of a block
LEAST = 2048


def seconds(what: Callable[[], Any]) -> float:
    """The least of some times, of the processor."""
    found = []
    for _ in range(REPEATS):
        start = time.process_time()
        what()
        found.append(time.process_time() - start)
    return min(found)


def through_pinocchio(robot: Robot, motion: tuple[np.ndarray, ...], what: str) -> float:
    """Seconds a sample."""
    model = robot.pinocchio()
    data = model.createData()
    q, v, a = (x[: max(1, LONGEST_PINOCCHIO // robot.n)] for x in motion)
    function = pin.rnea if what == "torque" else pin.computeJointTorqueRegressor
    shape = (robot.n,) if what == "torque" else (robot.n, 10 * robot.n)

    def loop() -> None:
        out = np.empty((len(q), *shape))
        for k in range(len(q)):
            out[k] = function(model, data, q[k], v[k], a[k])

    return seconds(loop) / len(q)


def made(robot: Robot, columns: tuple[int, ...]) -> Kernel:
    """A function of columns, or of the torque if there are none, written out now."""
    tree = robot.joint_tree
    if not columns:
        return Kernel(torque_equations(tree), (robot.n,))
    return Kernel(regressor_equations(tree, columns), (robot.n, len(columns)))


def show(name: str, robot: Robot, motion: tuple[np.ndarray, ...], what: str) -> None:
    parameters = robot.theta.tolist() if what == "torque" else []
    columns = {
        "base": structural_base(robot).independent,
        "all": tuple(range(10 * robot.n)),
        "torque": (),
    }[what]
    start = time.process_time()
    kernel = made(robot, columns)
    writing = time.process_time() - start
    samples = len(motion[0])

    def run() -> None:
        kernel(*motion, parameters=parameters)

    loop = through_pinocchio(robot, motion, what)
    os.environ["DYNIDENT_COMPILE"] = "never"
    times = [seconds(run) / samples]
    compiling = float("nan")
    if robot.n <= LONGEST_COMPILED:
        os.environ["DYNIDENT_COMPILE"] = "always"
        start = time.perf_counter()
        run()
        compiling = time.perf_counter() - start
        if kernel.evaluation.way == "compiled":
            times.append(seconds(run) / samples)
    both = "".join(f"{1e6 * one:9.3f} {loop / one:6.1f}" for one in times)
    words = f"{name:10s} {robot.n:6d} {what:7s} {1e6 * loop:9.2f} {both:32s}"
    print(f"{words} {writing:8.3f} {compiling:9.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--samples", type=int, default=16384)
    parser.add_argument("--links", type=int, nargs="*", default=[2, 7, 30, 60])
    said = parser.parse_args()
    head = f"{'Pinocchio':>9s} {'replayed':>9s} {'times':>6s}{'compiled':>9s} {'times':>6s}"
    print(f"{'robot':10s} {'joints':>6s} {'what':7s} {head}  write, s compile, s   (us a sample)")
    robots = {Path(arm).stem: Robot.from_file(PROBLEMS / arm) for arm in ARMS}
    robots |= {f"chain {n}": chain(n) for n in said.links}
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        for name, robot in robots.items():
            samples = min(said.samples, max(LEAST, MEMORY // (80 * robot.n**2)))
            motion = robot.random_motion(0, samples)
            for what in ("base", "all", "torque"):
                show(name, robot, motion, what)


if __name__ == "__main__":
    main()
