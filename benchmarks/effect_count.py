"""Time of a fit against the number of effects in the model."""

from __future__ import annotations

from collections.abc import Iterator

from arms import FULL_RATE, arm, recording
from dynident.fitting import fit
from dynident.model import Model
from dynident.recording import Dataset
from dynident.threads import single_threaded
from side_by_side.line import Benchmark, Line, Size
from side_by_side.measuring import cpu

EFFECTS = (
    "viscous_friction",
    "coulomb_friction",
    "rotor_inertia",
    "torque_offset",
    "asymmetric_friction",
    "quadratic_drag",
    "joint_spring",
)
"""Of every joint, in the order in which they come in; all linear in their parameters."""


@single_threaded
def lines(size: Size) -> Iterator[Line]:
    samples = {"tiny": 2_000, "quick": 10_000, "full": 100_000}[size]
    most = 1 if size == "tiny" else len(EFFECTS)
    model = Model(arm())
    data = Dataset((recording(model, model.given_values(), 0, samples),), FULL_RATE)
    for count in range(most + 1):
        if count:
            model += EFFECTS[count - 1]
        first, _ = cpu(lambda m=model: fit(m, data))
        spent, _ = cpu(lambda m=model: fit(m, data))
        figures = {
            "CPU, s": spent,
            "first, s": first,
            "us a sample": 1e6 * spent / samples,
            "parameters": float(model.size),
        }
        yield Line(
            case=f"{len(model.effects)} effects", who="dynident.fit", figures=figures, at=model.size
        )


BENCHMARK = Benchmark(
    title="A fit against the number of effects",
    work="The arm of seven joints, 100 000 samples, every row; one more kind of effect at every "
    "joint from line to line: " + ", ".join(EFFECTS).replace("_", " ") + ".",
    compared="CPU, s",
    lines=lines,
    axis="parameters",
)
