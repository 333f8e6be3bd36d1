"""Estimate, project, control: what an estimate is worth as the model of a computed torque.

Used by `vision_head/table.py` and `anthropomorphic_arm/table.py`: sinusoids in every joint, an
estimate by each method, each projected onto robots that can exist, and the closed loop in Drake
with it inside the controller, on the robot as it truly is.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

import dynident as di
from dynident.closed_loop import ClosedLoop, Fourier, Mechanism, Rollout, Task
from dynident.errors import SimulationError
from dynident.fit import Metric
from dynident.tables import Table, number, print_tables

RUN = 60.0
"""s of one recording; each has sinusoids of its own."""
FOLLOWED = 20.0
"""s that each motion lasts."""
MOTIONS = 6
"""How many motions each controller is given to follow."""
LOST = 1.0
"""RMS position error of a joint, in units of its upper limit, beyond which a loop has failed."""
FAILURES = ("unstable", "inertia", "massless")
"""Reasons for which an estimate, and not the setting, is to blame where a loop does not run."""

METHODS: dict[str, Any] = {
    "ridge": di.Regression("ridge"),
    "Bayes": di.Regression("bayes"),
    "LASSO": di.Regression("lasso"),
    "stepwise": di.Regression("stepwise"),
    "least squares": di.LeastSquares(),
    "Bayes, noise known": di.Regression("bayes", "encoders"),
    "corrected": di.Regression("corrected", "encoders"),
}

ADDED = "dry friction added"
"""Least squares again, with the effect that the model lacks."""


@dataclass(frozen=True, eq=False)
class Setting:
    """A robot with its recordings.

    Attributes
    ----------
    experiment : the robot as it truly is.
    model : rigid bodies and viscous friction, of the nominal description: eleven features a joint.
    richer : with the Coulomb friction that it lacks.
    dataset : recordings of it, all samples kept.
    published : the paper's figures, and the settings of the controller.
    """

    experiment: di.Experiment
    model: di.Model
    richer: di.Model
    dataset: di.Dataset
    published: dict[str, Any]


@dataclass(frozen=True)
class Tracking:
    """Root mean squares over all joints: rad, rad/s and N m of the feedback's command.

    The feedback is what the controller adds to the model's torque along the true motion: noise of
    the encoders that goes through the model counts as feedback.
    """

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
    model = di.Model(
        nominal,
        di.effects_of("viscous_friction", nominal),
        friction_width=experiment.friction_width,
    )
    richer = model
    for effect in di.effects_of("coulomb_friction", nominal):
        richer = richer + effect
    cutoff = published["position_cutoff_hz"]
    edge = 3.0 / cutoff
    n = nominal.n
    noise = di.Noise(
        experiment.sensors.each("position_std", n), experiment.sensors.each("torque_std", n)
    )
    settings = di.Filter(position_cutoff_hz=cutoff, edge_s=(edge, edge))
    dataset = di.Dataset(recordings, settings, noise)
    return Setting(experiment, model, richer, dataset, published)


def estimates(one: Setting, only: Collection[str]) -> Iterator[tuple[str, di.Estimate | str]]:
    """Each method's estimate, projected; or why there is none."""
    entrants = [(name, one.model, method) for name, method in METHODS.items()]
    entrants.append((ADDED, one.richer, di.LeastSquares()))
    metric_of = cache(lambda model: Metric.of_data(model, one.dataset))
    for name, model, method in entrants:
        if name in only:
            try:
                found = di.fit(model, one.dataset, method)
                metric = metric_of(model)
                yield name, di.project(found, metric=metric).estimate
            except di.DynidentError as error:
                yield name, str(error)


def believed(estimate: di.Estimate) -> Mechanism:
    """What a controller makes of an estimate: rigid bodies, and the friction fitted."""
    return Mechanism.of_model(estimate.model, estimate.values, estimate.robot.theta)


def tracked(
    one: Setting, nominal: Mechanism, motions: int = MOTIONS, duration: float = FOLLOWED
) -> tuple[Tracking, ...]:
    """Errors of the loop that has this model inside its controller; none where a motion fails."""
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
    mechanism = one.experiment.mechanism()
    tasks = [
        Task(
            mechanism,
            sinusoids(robot, 7000 + seed, one.published),
            duration,
            rng=np.random.default_rng([seed, 13]),
            nominal=nominal,
        )
        for seed in range(motions)
    ]
    try:
        rollouts = ClosedLoop().simulate(tasks, controller, one.experiment.sensors)
    except SimulationError as error:
        if error.reason not in FAILURES:
            raise
        return ()
    room = LOST * np.array([joint.upper for joint in robot.joints])
    off = [np.sqrt(np.mean((x.q_ref - x.q) ** 2, axis=0)) for x in rollouts]
    if np.any(off > room):
        return ()
    return tuple(_errors(*pair, nominal) for pair in zip(rollouts, tasks, strict=True))


def _errors(rollout: Rollout, task: Task, nominal: Mechanism) -> Tracking:
    _, _, a_ref = task.trajectory.at(rollout.t)
    ahead = nominal.inverse_dynamics(rollout.q, rollout.v, a_ref)
    each = (rollout.q_ref - rollout.q, rollout.v_ref - rollout.v, rollout.u - ahead)
    return Tracking(*(float(np.sqrt(np.mean(x**2))) for x in each))


def table(one: Setting, motions: int = MOTIONS, only: Collection[str] = (*METHODS, ADDED)) -> Table:
    """The paper's table: every method in the loop, over some motions, beside its figures."""
    rows, first = [], None
    for name, estimate in estimates(one, only):
        refused = isinstance(estimate, str)
        each = () if refused else tracked(one, believed(estimate), motions)
        first = each if first is None else first
        claimed = one.published["paper"].get(name.lower(), ())
        told = " / ".join(str(x) for x in claimed)
        rows.append((name, *_cells(each), _change(each, first), told, estimate if refused else ""))
    errors = ("position, rad", "velocity, rad/s", "feedback, N m")
    columns = ("method", *errors, f"position, against {rows[0][0]}", "paper", "")
    rate = one.experiment.controller.simulated_rate()
    samples = sum(recording.samples for recording in one.dataset.recordings)
    title = f"Computed torque, root mean squares over all joints; {samples} samples at {rate:g} Hz"
    return Table(title, columns, tuple(rows))


def _cells(each: Sequence[Tracking]) -> tuple[str, ...]:
    """Means over the motions, with standard errors; FAILURE where there is none."""
    if not each:
        return ("FAILURE",) * 3
    cells = []
    for part in ("position", "velocity", "feedback"):
        values = np.array([getattr(x, part) for x in each])
        doubt = f" +- {number(float(stats.sem(values)), 1)}" if len(values) > 1 else ""
        cells.append(number(float(np.mean(values)), 3) + doubt)
    return tuple(cells)


def _change(each: Sequence[Tracking], first: Sequence[Tracking]) -> str:
    """Change of the position error, motion by motion, with its standard error; per cent."""
    if each is first or not each or not first:
        return ""
    own, other = (np.array([x.position for x in some]) for some in (each, first))
    change = 100 * (own / other - 1)
    doubt = f" +- {float(stats.sem(change)):.1f}" if len(change) > 1 else ""
    return f"{float(np.mean(change)):+.1f}{doubt} %"


def main(folder: Path, doc: str) -> None:
    """Print the table of one robot."""
    from rich.progress import Progress

    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    published = tomllib.loads((folder / "published.toml").read_text())
    parser.add_argument("--samples", type=int, default=published["samples"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--motions", type=int, default=MOTIONS)
    names = (*METHODS, ADDED)
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="METHOD")
    asked = parser.parse_args()
    with Progress(transient=True) as bar:
        task = bar.add_task("recording", total=None)

        def tell(name: str, done: float, total: float) -> None:
            bar.update(task, completed=done, total=total)

        one = setting(folder, asked.samples, asked.seed, tell)
        bar.update(task, description="estimating and controlling", total=None)
        found = table(one, asked.motions, asked.only)
    print_tables(found)
