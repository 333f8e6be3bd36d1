"""Regressor and torque of many samples, beside a loop over Pinocchio.

The arms of `problems/`, then chains of revolute joints: a loop that keeps what Pinocchio computes,
and the same through `dynident.batch` for a block of samples as fits take them, replayed by NumPy
and compiled. "base" is the columns of the base parameters, "all" all of them.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio

from arms import chain
from dynident.batch import Kernel
from dynident.batch.newton_euler import regressor_equations, torque_equations
from dynident.robot import Robot, structural_base
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

pin: Any = pinocchio  # its bindings carry no types

PROBLEMS = Path(__file__).parents[1] / "problems"
ARMS = ("panda/panda.urdf", "iiwa/iiwa.urdf")
REPEATS = 5
LONGEST_PINOCCHIO = 200_000  # joints times samples of the loop
LONGEST_COMPILED = 30
LONGEST_ALL = 15  # joints; of longer ones the base alone
MEMORY = 2**27  # bytes of the regressor of a block
SAMPLES, LEAST = 16384, 2048


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

    return cpu(loop, REPEATS)[0] / len(q)


def made(robot: Robot, columns: tuple[int, ...]) -> Kernel:
    """A function of columns, or of the torque if there are none, written out now."""
    tree = robot.joint_tree
    if not columns:
        return Kernel(torque_equations(tree), (robot.n,))
    return Kernel(regressor_equations(tree, columns), (robot.n, len(columns)))


def times(name: str, robot: Robot, motion: tuple[np.ndarray, ...], what: str) -> Iterator[Line]:
    """Lines of one robot and one function of it."""
    parameters = robot.theta.tolist() if what == "torque" else []
    columns = {
        "base": structural_base(robot).independent,
        "all": tuple(range(10 * robot.n)),
        "torque": (),
    }[what]
    writing, kernel = cpu(lambda: made(robot, columns))
    samples = len(motion[0])
    at = float(robot.n) if name.startswith("chain") and what == "base" else None
    case = f"{name}, {robot.n} joints, {what}"

    def run() -> None:
        kernel(*motion, parameters=parameters)

    ways = ["never", *(["always"] if robot.n <= LONGEST_COMPILED else [])]
    for way in ways:
        os.environ["DYNIDENT_COMPILE"] = way
        first, _ = cpu(run)
        # What falls back to NumPy where there is no compiler is no second way.
        if way == "always" and kernel.evaluation.way != "compiled":
            yield Line(case=case, who="dynident, compiled", missing="no compiler is found")
            continue
        spent, _ = cpu(run, REPEATS)
        figures = {
            "us a sample": 1e6 * spent / samples,
            "to write and first run, s": writing + first,
        }
        who = "dynident, replayed by NumPy" if way == "never" else "dynident, compiled"
        yield Line(case=case, who=who, figures=figures, at=at)
    loop = through_pinocchio(robot, motion, what)
    yield Line(case=case, who="loop over Pinocchio", figures={"us a sample": 1e6 * loop}, at=at)


def lines(size: Size) -> Iterator[Line]:
    links = {"tiny": (2,), "quick": (2, 7), "full": (2, 7, 15, 30, 60)}[size]
    robots = {f"chain {n}": chain(n) for n in links}
    if size == "full":
        robots = {Path(arm).stem: Robot.from_file(PROBLEMS / arm) for arm in ARMS} | robots
    before = os.environ.get("DYNIDENT_COMPILE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        for name, robot in robots.items():
            most = LEAST if size == "tiny" else SAMPLES
            samples = min(most, max(LEAST, MEMORY // (80 * robot.n**2)))
            motion = robot.random_motion(0, samples)
            for what in ("base", "all", "torque") if robot.n <= LONGEST_ALL else ("base",):
                yield from times(name, robot, motion, what)
    if before is not None:
        os.environ["DYNIDENT_COMPILE"] = before


BENCHMARK = Benchmark(
    title="Regressor and torque against the number of joints",
    work="A block of 16 384 samples (fewer for long chains), one thread. The loop keeps what "
    "Pinocchio computes. Beyond 30 joints compilation takes too long to be tried.",
    compared="us a sample",
    lines=lines,
    axis="joints",
)
