"""The same arm and recording identified by the package and by what one would use instead.

The peers are scripts of `peers/`, each in a process of its own; what they answer is judged here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import dynident as di
from dynident.closed_loop import load_experiment
from dynident.fitting.sampling import sample
from dynident.robot.patching import patched
from side_by_side.line import Benchmark, Line, Size
from side_by_side.peer import Peer, PeerMissing

IIWA = Path(__file__).parents[1] / "problems" / "iiwa"
KINDS = ("rotor_inertia", "viscous_friction")
CUTOFF_HZ, EDGE_S = 10.0, (0.5, 0.5)
POSITION_STD, TORQUE_STD = 1e-5, 0.05  # rad, N m
MASSES_TOLD, EFFECTS_TOLD = 1.3, 0.6
"""Shares of the truth that the description says: where an iteration starts."""
RATE_HZ = 1000.0  # of the long recording
TEXTBOOK = "dynident.fit, textbook sigma"
CONTESTANTS = {
    "dynident.fit": Peer(script="dynident_fit.py"),
    TEXTBOOK: Peer(script="dynident_fit.py"),
    "loop over Pinocchio, NumPy lstsq": Peer(script="pinocchio_fit.py"),
    "figaroh": Peer(script="figaroh_fit.py", environment="figaroh"),
    "mujoco-sysid, NumPy lstsq": Peer(script="mujoco_regressor_fit.py", environment="mujoco-sysid"),
    "mujoco.sysid (rollouts)": Peer(script="mujoco_rollout_fit.py", environment="mujoco"),
}
ROLLOUTS = "mujoco.sysid (rollouts)"


@dataclass(frozen=True, eq=False)
class Judge:
    """The truth and a motion of its own to compare on.

    Attributes
    ----------
    truth : (12 n,) ten of each link, rotor inertias, viscous friction.
    held_out : (T, n, 12 n) columns of a motion that nobody was given.
    """

    truth: np.ndarray
    held_out: np.ndarray

    def errors(self, theta: np.ndarray) -> dict[str, float]:
        """Of base parameters, each weighted by the torque that it makes, and of the torque."""
        rows = self.held_out.reshape(-1, len(self.truth))
        off = rows @ (theta - self.truth)
        independent, combination = base(rows)
        sizes = np.linalg.norm(rows[:, independent], axis=0)
        true = combination @ self.truth
        wrong = sizes * (combination @ (theta - self.truth))
        return {
            "parameter error, %": 100 * float(np.linalg.norm(wrong) / np.linalg.norm(sizes * true)),
            "held-out error, %": 100
            * float(np.linalg.norm(off) / np.linalg.norm(rows @ self.truth)),
        }


def base(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Independent columns, the first ones that are, and how all combine to their parameters."""
    R = np.asarray(np.linalg.qr(rows, mode="r"))
    diagonal = np.abs(np.diag(R))
    independent = np.flatnonzero(diagonal > 1e-9 * diagonal.max())
    combination = np.linalg.lstsq(R[:, independent], R, rcond=None)[0]
    return independent, combination


def columns(robot: di.Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Of ten parameters of each link, rotor inertias and viscous friction, (T, n, 12 n)."""
    n = robot.n
    found = np.zeros((len(q), n, 12 * n))
    found[:, :, : 10 * n] = robot.regressor(q, v, a)
    joints = np.arange(n)
    found[:, joints, 10 * n + joints] = a
    found[:, joints, 11 * n + joints] = v
    return found


def experiment(seconds: float) -> Any:
    """The arm of problems/iiwa with rotors and viscous friction, under its own controller."""
    found = load_experiment(IIWA / "experiment.toml")
    effects = tuple(e for e in found.effects if e.effect.label.partition("@")[0] in KINDS)
    runs = tuple(replace(r, duration=seconds) for r in found.runs if r.use == "train")
    sensors = replace(found.sensors, position_std=POSITION_STD, torque_std=TORQUE_STD)
    return replace(found, effects=effects, runs=runs, sensors=sensors)


def posed() -> tuple[di.Robot, np.ndarray, Judge]:
    """The true robot, its effects' values (2, n), and the judge."""
    one = experiment(1.0)
    robot = one.mechanism().robot
    values = {e.effect.label: e.values[0] for e in one.effects}
    effects = np.array([[values[f"{kind}@{j}"] for j in robot.names] for kind in KINDS])
    (test,) = (r for r in load_experiment(IIWA / "experiment.toml").runs if r.use == "test")
    q, v, a = test.trajectory.at(np.arange(0.0, test.duration, 0.01))
    truth = np.concatenate([robot.theta, effects.ravel()])
    return robot, effects, Judge(truth, columns(robot, q, v, a))


def closed_loop_recording(seconds: float) -> di.Recording:
    (recording,) = experiment(seconds).run()
    return recording


def long_recording(robot: di.Robot, truth: np.ndarray, samples: int) -> di.Recording:
    """A motion of five harmonics at 1 kHz with noisy torques."""
    rng = np.random.default_rng(1)
    t = np.arange(samples) / RATE_HZ
    w = 2 * np.pi / 10.0 * np.arange(1, 6)
    s = rng.normal(size=(robot.n, 5)) * 0.5 / np.arange(1, 6)
    q, v = np.sin(t[:, None] * w) @ s.T, np.cos(t[:, None] * w) @ (s * w).T
    a = -np.sin(t[:, None] * w) @ (s * w**2).T
    n = robot.n
    tau = robot.inverse_dynamics(q, v, a) + truth[10 * n : 11 * n] * a + truth[11 * n :] * v
    q = q + POSITION_STD * rng.normal(size=q.shape)
    return di.Recording(t, q, tau + TORQUE_STD * rng.normal(size=tau.shape), robot.names)


def work(robot: di.Robot, effects: np.ndarray, recording: di.Recording) -> dict[str, Any]:
    """What every contestant is given: the recording, and the same rows filtered."""
    told = robot.with_theta(MASSES_TOLD * robot.theta)
    settings = di.Filter(position_cutoff_hz=CUTOFF_HZ, edge_s=EDGE_S, ends="keep")
    rows = sample(recording, settings)
    first, last = rows.motion.first, rows.motion.first + rows.motion.samples
    return {
        "urdf": patched(told),
        "rotors": EFFECTS_TOLD * effects[0],
        "viscous": EFFECTS_TOLD * effects[1],
        "t_raw": recording.t,
        "q_raw": recording.q,
        "tau_raw": recording.tau,
        "torque": recording.torque,
        "cutoff_hz": CUTOFF_HZ,
        "edge_s": EDGE_S,
        **{name: getattr(rows, name) for name in ("t", "q", "v", "a", "tau")},
        # For rollouts: states at the samples at which a command begins.
        "t_sim": recording.t[first:last],
        "q_sim": rows.motion.q,
        "v_sim": rows.motion.v,
        "tau_sim": recording.tau[first:last],
    }


def lines(size: Size) -> Iterator[Line]:
    robot, effects, judge = posed()
    seconds, samples = {"tiny": (3.0, 3000), "quick": (5.0, 20_000), "full": (6.0, 100_000)}[size]
    recording = closed_loop_recording(seconds)
    yield from contest(
        f"{recording.samples} samples, closed loop at 200 Hz",
        work(robot, effects, recording),
        judge,
        tuple(CONTESTANTS),
    )
    recording = long_recording(robot, judge.truth, samples)
    yield from contest(
        f"{samples} samples at 1 kHz",
        work(robot, effects, recording),
        judge,
        tuple(name for name in CONTESTANTS if name != ROLLOUTS),
    )


def contest(case: str, given: dict[str, Any], judge: Judge, who: tuple[str, ...]) -> Iterator[Line]:
    for name in who:
        try:
            settings = {"errors": "independent"} if name == TEXTBOOK else {}
            said = CONTESTANTS[name].ask(given, **settings)
        except PeerMissing as missing:
            yield Line(case=case, who=name, missing=str(missing))
            continue
        figures = {
            "warm, s": said["warm"],
            "from the start, s": said["imports"] + said["cold"],
            **judge.errors(np.array(said["values"])),
            "peak memory, MiB": said["peak"],
        }
        yield Line(case=case, who=name, figures=figures)


BENCHMARK = Benchmark(
    title="Identifying a seven-joint arm",
    work="The arm of `problems/iiwa` with rotor inertias and viscous friction, 84 parameters, from "
    "a recording with noisy encoders and torques. The peers are given positions, velocities and "
    "accelerations as the package filters them, outside of their time; the package is given the "
    "recording, weighs the joints and finds sigma: by default from errors that hang together from "
    "row to row, which takes another pass, or as textbooks have it. mujoco.sysid fits the "
    "positions in windows of half a second, at most 15 rounds from a description whose masses are "
    "30 % too large and effects 40 % too small; the others need no start. Parameter error: of base "
    "parameters, each by the torque that it makes; held-out error: of the torque along another "
    "motion, both against the truth. "
    "From the start: imports and the first answer. Memory is that of the whole process, libraries "
    "included.",
    compared="warm, s",
    lines=lines,
)
