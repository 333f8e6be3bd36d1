"""Virtual experiments on disk: pieces of their files, put together."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from synthetic import ARM

HEAD = """\
robot = "arm.urdf"
joints = ["shoulder", "elbow"]
seed = 3
lead_in = 0.5
"""
HIDDEN_STRIBECK = """
[[effects]]
effect = "stribeck_friction@elbow"
values = {Fs = 0.3}
shape = {vs = 0.1}
hidden = true
"""
STIFF = """
[controller]
kind = "pd"
kp = [300.0, 100.0]
kd = [40.0, 5.0]
rate_hz = 250.0
"""
SHORT_RUN = """
[[recordings]]
file = "run1.csv"
duration = 1.0
period = 0.5
trajectory = {harmonics = 2, speed = 2.0, seed = 1}
"""

QUIET = """
[controller]
kind = "pd"
kp = [200.0, 60.0]
kd = [25.0, 4.0]
rate_hz = 250.0

[sensors]
position_std = 1e-5
torque_std = [0.1, 0.05]
"""
"""A loop and sensors with which a search finds what is hidden."""
LONG_RUN = """
[[recordings]]
file = "{use}{seed}.csv"
use = "{use}"
duration = {duration}
period = {period}
trajectory = {{ harmonics = {harmonics}, speed = 2.0, seed = {seed} }}
"""


def write_search(
    folder: Path, effects: str, runs: Iterable[tuple[str, int]], period: float, harmonics: int
) -> Path:
    """Write the arm and an experiment with effects to look for; return the experiment's path.

    Each run, of a use and the seed of its motion, lasts two periods.
    """
    (folder / "arm.urdf").write_text(ARM)
    motion = {"duration": 2 * period, "period": period, "harmonics": harmonics}
    recordings = (LONG_RUN.format(use=use, seed=seed, **motion) for use, seed in runs)
    text = f'robot = "arm.urdf"\nseed = 3\n{effects}{QUIET}{"".join(recordings)}'
    path = folder / "experiment.toml"
    path.write_text(text)
    return path
