"""Small studies on disk: the two-link arm of `synthetic`, its recordings, and a study file."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from dynident.model import Model
from dynident.recording import Recording, write
from synthetic import ARM, arm, synthetic, true_values

STUDY = """\
# The arm of the tests.
robot = "arm.urdf"
joints = ["shoulder", "elbow"]   # base first
effects = ["viscous_friction"]
torque = "measured"

[[recordings]]
file = "train.csv"   # the long one
use = "train"
period = 8.0

[[recordings]]
file = "test.csv"
use = "test"
period = 8.0
"""
"""Viscous friction is known; dry friction at the elbow is not."""

CONTROLLER = """
[controller]
kind = "pd"
kp = [3000.0, 1500.0]
kd = [120.0, 50.0]
rate_hz = 1000.0
"""

RATE_HZ = 100.0


def true_model() -> Model:
    """What the recordings were made with."""
    return Model(arm()) + "viscous_friction" + "coulomb_friction@elbow"


@cache
def recording(seed: int, duration: float = 16.0) -> Recording:
    """A recording of the arm, 16 s with a period of 8 s at 100 Hz."""
    model = true_model()
    values = true_values(model, Fv__shoulder=2.0, Fv__elbow=1.0, Fc__elbow=1.5)
    return synthetic(
        model,
        values,
        seed,
        rate_hz=RATE_HZ,
        duration=duration,
        position_std=1e-5,
        torque_std=0.05,
    )


@cache
def csv_text(seed: int) -> str:
    """A recording of the arm as the text of a CSV file."""
    made = recording(seed)
    header = ["t", *(f"{s}.{joint}" for s in ("q", "tau") for joint in made.joints)]
    rows = np.column_stack([made.t, made.q, made.tau])
    lines = [",".join(header), *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    return "\n".join(lines) + "\n"


def write_study(folder: Path, text: str = STUDY) -> Path:
    """Write robot, recordings and study into a folder; return the study's path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(ARM)
    (folder / "train.csv").write_text(csv_text(0))
    (folder / "test.csv").write_text(csv_text(1))
    path = folder / "study.toml"
    path.write_text(text)
    return path


def edited(*changes: tuple[str, str], text: str = STUDY) -> str:
    """A text with parts of it replaced; each part must be there."""
    for old, new in changes:
        assert old in text, f"'{old}' is not in the text"
        text = text.replace(old, new)
    return text


def reordered(made: Recording, joints: tuple[str, ...], path: Path) -> Path:
    """Write a recording with its columns in another order of joints."""
    return write(made.select(joints), path)


def degrees(made: Recording) -> np.ndarray:
    """Positions of a recording in degrees."""
    return made.q * 180.0 / math.pi


def listing(folder: Path) -> dict[str, bytes]:
    """Every file below a folder with its content, to show that nothing was written."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
    }
