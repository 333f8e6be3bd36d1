"""Time of a fit against the number of joints, beside a loop over Pinocchio and a dense solve."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio

from arms import FULL_RATE, chain, recording
from dynident.fitting import LeastSquares, fit
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

SAMPLES = 5_000
LONGEST_DENSE = 30  # joints: 0.4 GB of regressor
TEXTBOOK = LeastSquares(errors="independent")
pin: Any = pinocchio  # its bindings carry no types


def by_hand(model: Model, one: Recording) -> np.ndarray:
    """Base parameters, as one writes it."""
    motion = sample(one, FULL_RATE).motion
    robot = model.robot.pinocchio()
    data = robot.createData()
    columns = list(model.base.independent)
    rows = np.empty((*motion.q.shape, len(columns)))
    for k, (q, v, a) in enumerate(zip(motion.q, motion.v, motion.a, strict=True)):
        rows[k] = pin.computeJointTorqueRegressor(robot, data, q, v, a)[:, columns]
    return np.linalg.lstsq(rows.reshape(-1, len(columns)), motion.tau.ravel(), rcond=None)[0]


@single_threaded
def lines(size: Size) -> Iterator[Line]:
    links, samples = {
        "tiny": ((2,), 1_000),
        "quick": ((2, 7, 15), SAMPLES),
        "full": ((2, 7, 15, 30, 60), SAMPLES),
    }[size]
    for n in links:
        model = Model(chain(n))
        one = recording(model, model.given_values(), 0, samples)
        data = Dataset((one,), FULL_RATE)
        case = f"{n} joints, {model.size} base parameters"
        first, _ = cpu(lambda m=model, d=data: fit(m, d))
        spent, _ = cpu(lambda m=model, d=data: fit(m, d))
        figures = {"CPU, s": spent, "first, s": first}
        yield Line(case=case, who="dynident.fit", figures=figures, at=n)
        spent, _ = cpu(lambda m=model, d=data: fit(m, d, TEXTBOOK))
        yield Line(case=case, who="dynident.fit, textbook sigma", figures={"CPU, s": spent}, at=n)
        who = "loop over Pinocchio, NumPy lstsq"
        if n <= LONGEST_DENSE:
            spent, _ = cpu(lambda m=model, o=one: by_hand(m, o))
            yield Line(case=case, who=who, figures={"CPU, s": spent}, at=n)
        else:
            yield Line(case=case, who=who, missing=f"not tried beyond {LONGEST_DENSE} joints")


BENCHMARK = Benchmark(
    title="A fit against the number of joints",
    work=f"Chains of revolute joints, {SAMPLES} samples, every row, rigid body. The package's "
    "estimate has its sigma: by default from errors that hang together from row to row, which "
    "takes another pass, or as textbooks have it. The loop has none.",
    compared="CPU, s",
    lines=lines,
    axis="joints",
)
