"""Logs of a seven-joint arm as bags of ROS 1 and ROS 2, begun with `dynident init`.

    python benchmarks/bag_logs.py --out bags

The recordings of `problems/seven_joint_arm` as a driver of ROS reports them: joints with a prefix,
the states of a gripper on the same topic, lines of a log on another, times of arrival that jitter;
once as `.bag`, once as `.mcap`, once as `.db3`. Of each kind it runs

    dynident init arm.urdf bags/mcap/*/run/*.mcap

and, without touching that study, `explain`; and `explain` with the study of the problem, which was
written by hand: it names the rotors, a filter and the controller, of which the draft knows nothing.
It prints both answers side by side.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ampere_logs import dynident
from dynident.recording import Recording, read
from ros_bags import KINDS, JointMessage, messages_of, write_bag

PROBLEM = Path(__file__).resolve().parents[1] / "problems" / "seven_joint_arm"
PREFIX = "lbr/"


def as_driver_reports(recording: Recording, seed: int) -> list[JointMessage]:
    """A recording as messages of an arm whose gripper reports on the same topic."""
    arm = messages_of(recording, [f"{PREFIX}{joint}" for joint in recording.joints])
    seconds = float(recording.t[-1] - recording.t[0])
    gripper = [
        JointMessage(["finger"], 0.1 * k + 1e-3, [0.02], [], [2.0])
        for k in range(int(10 * seconds))
    ]
    late = np.random.default_rng(seed).uniform(0.5e-3, 4e-3, len(arm) + len(gripper))
    messages = sorted(arm + gripper, key=lambda one: one.stamp or 0.0)
    return [
        JointMessage(
            one.names,
            one.stamp,
            one.position,
            one.velocity,
            one.effort,
            received=(one.stamp or 0.0) + float(delay),
        )
        for one, delay in zip(messages, late, strict=True)
    ]


def write_bags(folder: Path, kind: str) -> list[Path]:
    """Write every recording of the problem as a bag, in a folder of its name; return the bags."""
    bags = []
    for number, file in enumerate(sorted(PROBLEM.glob("*.npz"))):
        place = folder / kind / file.stem
        place.mkdir(parents=True, exist_ok=True)
        bags.append(write_bag(place, kind, as_driver_reports(read(file), number), text=20))
    return bags


def answer(study: Path, stated: Sequence[str]) -> dict[str, Any]:
    """The answer to a study: what is in the model at the end, and the held-out errors.

    Parameters
    ----------
    study : the file.
    stated : effects that it names.
    """
    told = dynident("explain", study)
    found = [f"{one['effect']}@{one['joint']}" for one in told["steps"]]
    return {
        "verdict": told["verdict"],
        "stated": list(stated),
        "found": found,
        "error before": told["test_error"]["before"],
        "error after": told["test_error"]["after"],
        "noise floor": told["test_error"]["noise_floor"],
    }


def drafted_answer(folder: Path, kind: str) -> dict[str, Any]:
    """The answer to what `init` drafts of the bags of one kind."""
    study = folder / f"{kind}.toml"
    study.unlink(missing_ok=True)
    draft = dynident("init", PROBLEM / "arm.urdf", *write_bags(folder, kind), "--out", study)
    for one in draft["decisions"]:
        print(f"  {one['subject']}: {one['chosen']} ({one['reason']})")
    return answer(study, ("viscous_friction", "coulomb_friction", "torque_offset"))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the bags, a new one")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    said = parser.parse_args()
    stated = ("viscous_friction", "coulomb_friction", "rotor_inertia")
    answers = {"by hand": answer(PROBLEM / "study.toml", stated)}
    for kind in said.kinds:
        print(f"{kind}, as `init` takes it:")
        answers[kind] = drafted_answer(said.out, kind)
    for name, one in answers.items():
        print(f"\n{name}")
        for key, value in one.items():
            print(f"  {key}: {value if isinstance(value, str | list) else f'{100 * value:.4f} %'}")


if __name__ == "__main__":
    main()
