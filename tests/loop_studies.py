"""A small study on disk whose recordings were made in a closed loop, with their references."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from dynident.closed_loop import Controller, Experiment, ExperimentRun, Fourier, TrueEffect
from dynident.recording import Recording, write
from synthetic import ARM, arm

LOOP_STUDY = """\
robot = "arm.urdf"
joints = ["shoulder", "elbow"]
effects = ["viscous_friction"]
torque = "held_command"

[[recordings]]
file = "train.csv"
use = "train"

[[recordings]]
file = "test.csv"
use = "test"

[controller]
kind = "pd"
kp = [400.0, 120.0]
kd = [50.0, 8.0]
rate_hz = 250.0
"""


@cache
def recordings() -> tuple[Recording, ...]:
    """Training and test recording of the arm under a PD controller, 4 s each, two periods."""
    robot = arm()
    truth = TrueEffect.of("viscous_friction@shoulder", robot, [2.0])
    runs = [
        ExperimentRun(
            trajectory=Fourier.random(robot, 2.0, seed, harmonics=3), duration=4.0, file=name
        )
        for seed, name in enumerate(("train.csv", "test.csv"))
    ]
    controller = Controller(kind="pd", rate_hz=250.0, kp=(400.0, 120.0), kd=(50.0, 8.0))
    return Experiment(
        robot=robot, controller=controller, runs=tuple(runs), effects=truth, lead_in=1.0
    ).run()


def write_loop_study(folder: Path, text: str = LOOP_STUDY, *, reference: bool = True) -> Path:
    """Write robot, recordings and study into a folder; return the study's path."""
    (folder / "arm.urdf").write_text(ARM)
    for made in recordings():
        write(made if reference else made.replace(q_ref=None), folder / made.name)
    path = folder / "study.toml"
    path.write_text(text)
    return path
