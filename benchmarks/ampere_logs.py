"""Logs as a controller of a six-joint arm writes them, begun with `dynident init`.

    python benchmarks/ampere_logs.py --out logs [--seconds 60] [--seed 1]

Amperes instead of torques, no header line, a clock that jitters, columns of targets and
temperatures that nobody asked for, and 2.8 kg in the gripper in some of the recordings. The script
writes the robot's description (whose masses are off by a third) and the logs; then it runs

    dynident init arm.urdf run_*.txt --load "run_load_*=2.8"

and, without touching that study, `explain` and `payload`; and the same with a study written by
hand, from logs with names and an even clock. It prints both answers side by side, and what is true.
Arm, gains and friction are invented.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from dynident.effects import effects_of
from dynident.inertia import from_com
from dynident.model import Model
from dynident.robot import Robot

RATE_HZ = 125.0
N = 6
MASS = 2.8
"""kg of the load, as a scale showed it."""
LOAD = from_com(MASS, [0.01, -0.03, 0.09], np.diag([0.011, 0.012, 0.007]))
GAINS = np.array([13.2, 12.1, 9.6, 7.9, 7.4, -7.7])
"""N m/A; the last drive counts the other way."""
HIDDEN = "stribeck_friction@elbow"
JOINTS = ("base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3")
_NOISE = np.array([0.04, 0.04, 0.04, 0.02, 0.02, 0.02])  # A
_POSITION_STD = 1e-5  # rad
_LINKS = (  # mass, centre, radii of gyration, xyz and rpy of the joint
    (7.0, (0.0, -0.02, 0.02), (0.08, 0.08, 0.06), "0 0 0.18", "0 0 0"),
    (12.0, (-0.30, 0.0, 0.16), (0.06, 0.25, 0.25), "0 0 0", "1.5707963 0 0"),
    (4.2, (-0.26, 0.0, 0.05), (0.05, 0.20, 0.20), "-0.61 0 0", "0 0 0"),
    (2.0, (0.0, -0.01, 0.02), (0.04, 0.03, 0.04), "-0.57 0 0.17", "0 0 0"),
    (2.0, (0.0, 0.01, 0.02), (0.04, 0.03, 0.04), "0 -0.12 0", "1.5707963 0 0"),
    (0.5, (0.01, 0.02, -0.03), (0.03, 0.03, 0.02), "0 0.11 0", "-1.5707963 0 0"),
)


def description(masses: tuple[float, ...] = (1.0,) * N) -> str:
    """The arm as URDF, its links so many times as heavy."""
    parts, parent = ['<robot name="six"><link name="floor"/>'], "floor"
    for name, (m, c, r, xyz, rpy), factor in zip(JOINTS, _LINKS, masses, strict=True):
        x, y, z = (m * factor * radius**2 for radius in r)
        parts.append(
            f'<link name="{name}_link"><inertial><origin xyz="{c[0]} {c[1]} {c[2]}"/>'
            f'<mass value="{m * factor}"/><inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" '
            f'iyz="0"/></inertial></link><joint name="{name}" type="revolute">'
            f'<parent link="{parent}"/><child link="{name}_link"/><origin xyz="{xyz}" rpy="{rpy}"/>'
            '<axis xyz="0 0 1"/><limit lower="-6.28" upper="6.28" velocity="3.1" effort="300"/>'
            "</joint>"
        )
        parent = f"{name}_link"
    return "\n".join([*parts, "</robot>"])


@cache
def true_robot() -> tuple[Model, np.ndarray]:
    """The arm as it is, with its friction and rotors, and the hidden effect."""
    model = Model(Robot.from_text(description()))
    for name in ("viscous_friction", "coulomb_friction", "torque_offset", "rotor_inertia"):
        model = model + name
    (hidden,) = effects_of(HIDDEN, model.robot)
    model = model + replace(hidden, shape=(0.12,))
    values, rng = model.given_values(), np.random.default_rng(5)
    for name, sizes in (
        ("viscous_friction", (12, 14, 8, 2.2, 2.0, 1.6)),
        ("coulomb_friction", (8, 9, 6, 1.6, 1.5, 1.3)),
        ("torque_offset", (0.5, -0.8, 0.3, 0.1, -0.1, 0.05)),
        ("rotor_inertia", (3.1, 3.3, 1.5, 0.4, 0.4, 0.35)),
    ):
        for joint, size in zip(JOINTS, sizes, strict=True):
            values[model.slices[f"{name}@{joint}"]] = size * rng.uniform(0.9, 1.1)
    values[model.slices[HIDDEN]] = 5.0
    return model, values


@dataclass(frozen=True, kw_only=True)
class Log:
    """A file: its name, whether it is to judge by, and whether the load is on board."""

    name: str
    use: str
    carries: bool
    seed: int


LOGS = (
    Log(name="run_1", use="train", carries=False, seed=1),
    Log(name="run_load_1", use="train", carries=True, seed=2),
    Log(name="run_test", use="test", carries=False, seed=3),
)


def samples(log: Log, seconds: float, t: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    """What the controller reports at times t, (T, 6) each: targets, positions, speeds, currents."""
    rng = np.random.default_rng([seed, log.seed])
    k = 2 * np.pi / (seconds / 3) * np.arange(1, 7)  # three repetitions
    s, c = rng.normal(size=(2, N, len(k))) * 0.42 / np.arange(1, len(k) + 1) ** 0.7
    middle = np.array([0.0, -1.4, 1.2, -0.6, 0.7, 0.2])
    sin, cos = np.sin(t[:, None] * k), np.cos(t[:, None] * k)
    q = middle + sin @ s.T + cos @ c.T
    v = (cos * k) @ s.T - (sin * k) @ c.T
    a = -(sin * k**2) @ s.T - (cos * k**2) @ c.T
    model, values = true_robot()
    if log.carries:
        model, values = model + effects_of("payload", model.robot), np.append(values, LOAD)
    block = model.block(t, q, v, a, carries_payload=log.carries)
    current = model.torque(block, values) / GAINS
    noise = np.random.default_rng([seed, log.seed, 9])
    return {
        "target": q + 2e-4 * np.sin(3 * v),
        "q": q + _POSITION_STD * noise.normal(size=q.shape),
        "v": v + 2e-3 * noise.normal(size=q.shape),
        "current": current + _NOISE * noise.normal(size=q.shape),
        "temperature": 30 + t[:, None] / 60 + np.arange(N) + 0.1 * noise.normal(size=q.shape),
    }


def write_logs(folder: Path, seconds: float, seed: int) -> None:
    """Write the description and the logs, those of the controller and those of a tidy user."""
    folder.mkdir(parents=True, exist_ok=True)
    masses = np.exp(0.3 * np.random.default_rng([seed, 4]).normal(size=N))
    (folder / "arm.urdf").write_text(description(tuple(masses)))
    even = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    for log in LOGS:
        jitter = np.random.default_rng([seed, log.seed, 8]).normal(0, 0.06, len(even)) / RATE_HZ
        t = even + np.clip(jitter, -0.3 / RATE_HZ, 0.3 / RATE_HZ)
        found = samples(log, seconds, t, seed)
        order = ("target", "q", "v", "current", "temperature")
        rows = np.column_stack([1723.0 + t, *(found[name] for name in order)])
        np.savetxt(folder / f"{log.name}.txt", rows, fmt="%.6f", delimiter=" ")
        rows = np.column_stack([t, *(found[name] for name in ("q", "current"))])
        names = [f"{signal}.{joint}" for signal in ("q", "tau") for joint in JOINTS]
        header = ",".join(["t", *names])
        tidy = folder / f"{log.name}.csv"
        np.savetxt(tidy, rows, fmt="%.9g", delimiter=",", header=header, comments="")
    (folder / "by_hand.toml").write_text(by_hand(seconds))


def by_hand(seconds: float) -> str:
    """The study as somebody writes it who knows the arm."""
    parts = [
        'robot = "arm.urdf"\ntorque_unit = "A"\neffects = ["viscous_friction", "coulomb_friction", '
        f'"torque_offset", "rotor_inertia"]\n\n[loads.load]\nmass = {MASS}\n'
    ]
    for log in LOGS:
        load = '\npayload = "load"' if log.carries else ""
        parts.append(
            f'\n[[recordings]]\nfile = "{log.name}.csv"\nuse = "{log.use}"\n'
            f"period = {seconds / 3!r}{load}\n"
        )
    return "".join(parts)


def dynident(*arguments: str | Path) -> dict[str, Any]:
    """Run a command; what it answers as JSON."""
    command = [sys.executable, "-m", "dynident.cli", *map(str, arguments), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def answers(study: Path) -> dict[str, Any]:
    """Gains, the load's centre, and the steps of the search."""
    weighed, told = dynident("payload", study), dynident("explain", study)
    (load,) = weighed["loads"]
    return {
        "gains, N m/A": [round(one["gain"], 3) for one in weighed["joints"]],
        "sigma": [round(one["sigma"] or 0.0, 3) for one in weighed["joints"]],
        "centre of the load, m": [round(x, 4) for x in load["centre"]],
        "verdict": told["verdict"],
        "effects found": [f"{one['effect']}@{one['joint']}" for one in told["steps"]],
        "error before": told["test_error"]["before"],
        "error after": told["test_error"]["after"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the logs")
    parser.add_argument("--seconds", type=float, default=60.0, help="of each log")
    parser.add_argument("--seed", type=int, default=1)
    said = parser.parse_args()
    write_logs(said.out, said.seconds, said.seed)
    drafted = said.out / "drafted.toml"
    drafted.unlink(missing_ok=True)
    logs = [said.out / f"{log.name}.txt" for log in LOGS]
    load = f"run_load_*={MASS}"
    draft = dynident("init", said.out / "arm.urdf", *logs, "--out", drafted, "--load", load)
    for one in draft["decisions"]:
        print(f"{one['subject']}: {one['chosen']} ({one['reason']})")
    print("\ntrue:", json.dumps({"gains, N m/A": GAINS.tolist(), "hidden": HIDDEN}))
    for study in (said.out / "by_hand.toml", drafted):
        print(f"\n{study.name}:", json.dumps(answers(study), indent=1))


if __name__ == "__main__":
    main()
