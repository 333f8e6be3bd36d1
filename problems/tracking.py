"""Estimate, project, control: what an estimate is worth as the model of a computed torque.

Used by `vision_head/table.py` and `anthropomorphic_arm/table.py`: sinusoids in every joint, an
estimate by each method, each projected onto robots that can exist, and the closed loop in Drake
with it inside the controller, on the robot as it truly is.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import dynident as di
from dynident.closed_loop import ClosedLoop, Fourier, Mechanism, Rollout, Task
from dynident.errors import SimulationError
from dynident.fit import Metric
from dynident.tables import Table, number, print_tables

RUN = 60.0
"""s of one recording; each has sinusoids of its own."""
FOLLOWED = 20.0
"""s that each controller is given to follow."""
LOST = 1.0
"""rad, RMS of the position error beyond which a loop counts as failed."""

METHODS: dict[str, Any] = {
    "ridge": di.Regression("ridge"),
    "Bayes": di.Regression("bayes"),
    "LASSO": di.Regression("lasso"),
    "stepwise": di.Regression("stepwise"),
    "least squares": di.LeastSquares(),
    "Bayes, noise known": di.Regression("bayes", "encoders"),
    "corrected": di.Regression("corrected", "encoders"),
}


@dataclass(frozen=True, eq=False)
class Setting:
    """A robot with its recordings.

    Attributes
    ----------
    experiment : the robot as it truly is.
    model : rigid bodies and viscous friction, of the nominal description: eleven features a joint.
    dataset : recordings of it, all samples kept.
    published : the paper's figures, and the settings of the controller.
    """

    experiment: di.Experiment
    model: di.Model
    dataset: di.Dataset
    published: dict[str, Any]


@dataclass(frozen=True)
class Tracking:
    """Root mean squares over all joints: rad, rad/s and N m of the feedback's command."""

    position: float
    velocity: float
    feedback: float


def sinusoids(robot: di.Robot, seed: int, published: dict[str, Any]) -> Fourier:
    """One sinusoid for each joint, of a frequency and a phase of its own."""
    rng = np.random.default_rng([seed, 11])
    period, highest = published["period"], published["harmonics"]
    k = rng.integers(1, highest + 1, robot.n)
    phase = rng.uniform(0, 2 * np.pi, robot.n)
    room = np.array([published["range"] * joint.upper for joint in robot.joints])
    fastest = np.array([published["range"] * joint.velocity for joint in robot.joints])
    size = np.minimum(room, fastest * period / (2 * np.pi * k))
    sine, cosine = np.zeros((2, robot.n, highest))
    rows = np.arange(robot.n)
    sine[rows, k - 1], cosine[rows, k - 1] = size * np.cos(phase), size * np.sin(phase)
    return Fourier(period, np.zeros(robot.n), sine, cosine)


def setting(folder: Path, samples: int, seed: int = 1, progress: Any = None) -> Setting:
    """Record a robot for so many samples, in pieces of a minute."""
    published = tomllib.loads((folder / "published.toml").read_text())
    experiment = di.load_experiment(folder / "experiment.toml")
    rate = experiment.controller.simulated_rate()
    lengths = [RUN] * int(samples / (rate * RUN))
    if (rest := samples / rate - RUN * len(lengths)) > 2.0:
        lengths.append(rest)
    (first,) = experiment.runs
    runs = tuple(
        replace(
            first,
            file=f"train{k}.npz",
            duration=length,
            trajectory=sinusoids(experiment.robot, 100 * seed + k, published),
        )
        for k, length in enumerate(lengths)
    )
    experiment = replace(experiment, runs=runs, seed=seed)
    recordings = tuple(one.replace(period=None) for one in experiment.run(progress))
    nominal = experiment.nominal or experiment.robot
    model = di.Model(nominal, di.effects_of("viscous_friction", nominal))
    cutoff = published["position_cutoff_hz"]
    edge = 3.0 / cutoff
    n = nominal.n
    noise = di.Noise(
        experiment.sensors.each("position_std", n), experiment.sensors.each("torque_std", n)
    )
    settings = di.Filter(position_cutoff_hz=cutoff, edge_s=(edge, edge))
    return Setting(experiment, model, di.Dataset(recordings, settings, noise), published)


def estimates(one: Setting) -> Iterator[tuple[str, di.Estimate | None, str]]:
    """Each method's estimate, projected; or None and why there is none."""
    metric = Metric.of_data(one.model, one.dataset)
    for name, method in METHODS.items():
        try:
            found = di.fit(one.model, one.dataset, method)
            yield name, di.project(found, metric=metric).estimate, ""
        except di.DynidentError as error:
            yield name, None, str(error)


def tracked(one: Setting, estimate: di.Estimate, seed: int = 0) -> Tracking | None:
    """Errors of the loop with an estimate inside its controller; None where it fails."""
    settings, robot = one.published["controller"], one.experiment.robot
    w, damping = 2 * np.pi * settings["natural_frequency_hz"], settings["damping"]
    controller = di.Controller(
        "computed_torque",
        one.experiment.controller.rate_hz,
        kp=(w**2,) * robot.n,
        kd=(2 * damping * w,) * robot.n,
        derivative_cutoff_hz=settings["derivative_cutoff_hz"],
        limit=tuple(joint.effort for joint in robot.joints),
    )
    believed = Mechanism.of_model(estimate.model, estimate.values, estimate.robot.theta)
    task = Task(
        one.experiment.mechanism(),
        sinusoids(robot, 7000 + seed, one.published),
        FOLLOWED,
        rng=np.random.default_rng([seed, 13]),
        nominal=believed,
    )
    try:
        (rollout,) = ClosedLoop().simulate([task], controller, one.experiment.sensors)
    except SimulationError:
        return None
    found = _errors(rollout, task, believed)
    return found if found.position < LOST else None


def _errors(rollout: Rollout, task: Task, believed: Mechanism) -> Tracking:
    _, _, a_ref = task.trajectory.at(rollout.t)
    ahead = believed.inverse_dynamics(rollout.q, rollout.v, a_ref)
    each = (rollout.q_ref - rollout.q, rollout.v_ref - rollout.v, rollout.u - ahead)
    return Tracking(*(float(np.sqrt(np.mean(x**2))) for x in each))


def table(one: Setting, trials: int = 3) -> Table:
    """The paper's table: every method in the loop, over some motions, beside its figures."""
    rows = []
    paper = one.published["paper"]
    for name, estimate, why in estimates(one):
        each = [] if estimate is None else [tracked(one, estimate, k) for k in range(trials)]
        sound = [x for x in each if x is not None]
        if estimate is None or len(sound) < trials:
            cells = ("FAILURE",) * 3
        else:
            cells = tuple(
                number(float(np.sqrt(np.mean([getattr(x, part) ** 2 for x in sound]))), 3)
                for part in ("position", "velocity", "feedback")
            )
        claimed = paper.get(name.lower())
        told = "" if claimed is None else " / ".join(str(x) for x in claimed)
        rows.append((name, *cells, told, why))
    columns = ("method", "position, rad", "velocity, rad/s", "feedback, N m", "paper", "")
    rate = one.experiment.controller.simulated_rate()
    samples = sum(recording.samples for recording in one.dataset.recordings)
    title = f"Computed torque, root mean squares over all joints; {samples} samples at {rate:g} Hz"
    return Table(title, columns, tuple(rows))


def main(folder: Path, doc: str) -> None:
    """Print the table of one robot."""
    from rich.progress import Progress

    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    published = tomllib.loads((folder / "published.toml").read_text())
    parser.add_argument("--samples", type=int, default=published["samples"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trials", type=int, default=3)
    asked = parser.parse_args()
    with Progress(transient=True) as bar:
        task = bar.add_task("recording", total=None)

        def tell(name: str, done: float, total: float) -> None:
            bar.update(task, completed=done, total=total)

        one = setting(folder, asked.samples, asked.seed, tell)
        bar.update(task, description="estimating and controlling", total=None)
        found = table(one, asked.trials)
    print_tables(found)
