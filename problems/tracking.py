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
from joblib import Parallel, delayed
from rich.progress import track
from scipy import stats

import dynident as di
from dynident.closed_loop import ClosedLoop, Fourier, Mechanism, Rollout, Task
from dynident.errors import SimulationError
from dynident.fitting import Metric
from dynident.tables import Table, number, print_tables
from dynident.threads import single_threaded

RUN = 60.0
"""s of one recording; each has sinusoids of its own."""
FOLLOWED = 20.0
"""s that each motion lasts."""
MOTIONS = 6
"""How many motions each controller is given to follow."""
SETS = 5
"""Training sets that a table is a mean over."""
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

ADDED: dict[str, Any] = {
    "dry friction added": di.LeastSquares(),
    "dry friction added, corrected": di.Regression("corrected", "encoders"),
}
"""Once more, with the effect that the model lacks."""

EVERY = (*METHODS, *ADDED)


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

    experiment: di.closed_loop.Experiment
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


def setting(folder: Path, samples: int, seed: int = 1) -> Setting:
    """Record a robot for so many samples, in pieces of a minute."""
    published = tomllib.loads((folder / "published.toml").read_text())
    experiment = di.closed_loop.load_experiment(folder / "experiment.toml")
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
    recordings = tuple(one.replace(period=None) for one in experiment.run())
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
    noise = di.recording.Noise(
        experiment.sensors.each("position_std", n), experiment.sensors.each("torque_std", n)
    )
    settings = di.Filter(position_cutoff_hz=cutoff, edge_s=(edge, edge))
    dataset = di.Dataset(recordings, settings, noise)
    return Setting(experiment, model, richer, dataset, published)


def estimates(one: Setting, only: Collection[str]) -> Iterator[tuple[str, di.Estimate | str]]:
    """Each method's estimate, projected; or why there is none."""
    entrants = [(name, one.model, method) for name, method in METHODS.items()]
    entrants += [(name, one.richer, method) for name, method in ADDED.items()]
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
    controller = di.closed_loop.Controller(
        kind="computed_torque",
        rate_hz=one.experiment.controller.rate_hz,
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


Outcome = tuple[Tracking, ...] | str
"""Of an estimate: its errors, motion by motion, none where the loop failed; or why it is none."""


@single_threaded
def trial(
    folder: Path, samples: int, seed: int, motions: int = MOTIONS, only: Collection[str] = EVERY
) -> dict[str, Outcome]:
    """Record one training set, and try every method that it is asked for in the loop."""
    one = setting(folder, samples, seed)
    return {
        name: found if isinstance(found, str) else tracked(one, believed(found), motions)
        for name, found in estimates(one, only)
    }


def table(trials: Sequence[dict[str, Outcome]], paper: dict[str, Any]) -> Table:
    """The paper's table: means over training sets and motions, beside its figures.

    Standard errors are those between training sets, whose motions are the same.
    """
    first, *_ = names = tuple(trials[0])
    base = [one[first] for one in trials]
    rows = []
    for name in names:
        each = [one[name] for one in trials]
        told = " / ".join(str(x) for x in paper.get(name.lower(), ()))
        refused = next((x for x in each if isinstance(x, str)), "")
        change = "" if name == first else _change(each, base)
        rows.append((name, *_cells(each), change, told, refused))
    errors = ("position, rad", "velocity, rad/s", "feedback, N m")
    columns = ("method", *errors, f"position, against {first}", "paper", "")
    title = "Computed torque, root mean squares over all joints"
    sets = f"Mean of {len(trials)} training sets, and its standard error."
    return Table(title, columns, tuple(rows), (sets,))


def _cells(each: Sequence[Outcome]) -> tuple[str, ...]:
    """Means over the training sets, with standard errors; FAILURE where there is none."""
    sound = [one for one in each if one and not isinstance(one, str)]
    if len(sound) < len(each):
        lost = len(each) - len(sound)
        return ("FAILURE" if len(each) == 1 else f"FAILURE in {lost} of {len(each)}",) * 3
    cells = []
    for part in ("position", "velocity", "feedback"):
        values = np.array([np.mean([getattr(x, part) for x in one]) for one in sound])
        doubt = f" +- {number(float(stats.sem(values)), 1)}" if len(values) > 1 else ""
        cells.append(number(float(np.mean(values)), 3) + doubt)
    return tuple(cells)


def _change(each: Sequence[Outcome], first: Sequence[Outcome]) -> str:
    """Change of the position error, set by set, with its standard error; per cent."""
    changes = []
    for pair in zip(each, first, strict=True):
        if any(isinstance(one, str) or not one for one in pair):
            return ""
        own, other = (np.mean([x.position for x in one]) for one in pair)  # type: ignore[union-attr]
        changes.append(100 * (own / other - 1))
    doubt = f" +- {float(stats.sem(changes)):.1f}" if len(changes) > 1 else ""
    return f"{float(np.mean(changes)):+.1f}{doubt} %"


def main(folder: Path, doc: str) -> None:
    """Print the table of one robot."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    published = tomllib.loads((folder / "published.toml").read_text())
    parser.add_argument("--samples", type=int, default=published["samples"])
    parser.add_argument("--sets", type=int, default=SETS, help="training sets")
    parser.add_argument("--motions", type=int, default=MOTIONS)
    parser.add_argument("--only", nargs="+", choices=EVERY, default=EVERY, metavar="METHOD")
    parser.add_argument("--jobs", type=int, default=1, help="training sets at a time; 2 GB each")
    asked = parser.parse_args()
    work = Parallel(n_jobs=asked.jobs, return_as="generator")(
        delayed(trial)(folder, asked.samples, seed, asked.motions, asked.only)
        for seed in range(1, asked.sets + 1)
    )
    shown: Any = track(work, "training sets", total=asked.sets, transient=True)
    print_tables(table(list(shown), published["paper"]))
