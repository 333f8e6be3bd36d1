"""Torque errors of the arm on a validation motion: least squares and instruments, three encoders.

    python problems/iiwa/table.py
    python problems/iiwa/table.py --noise 1e-4 --seed 3
    python problems/iiwa/table.py --bandwidth

The error is that of the identified model's torque along the true validation motion (without any
noise) against the true torque, relative, in the mean of the joints.
"""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

import dynident as di
from dynident.fitting.instrumental import SimulatedLoop
from dynident.tables import Table, number, percent, print_tables

HERE = Path(__file__).parent
PUBLISHED = tomllib.loads((HERE / "published.toml").read_text())
LEVELS: tuple[float, ...] = tuple(PUBLISHED["position_std"])
SHARES = (1.0, 1 / 2, 1 / 3, 1 / 4)
"""Of the real bandwidth, that the simulated loop is given."""
UNFILTERED = di.Filter()


@dataclass(frozen=True, eq=False)
class Arm:
    """The virtual arm with an encoder of some noise.

    Attributes
    ----------
    model : what is identified.
    filter : of the study.
    controller : of the recorded loop.
    recordings : to fit.
    t, q, v, a, tau : the validation motion without noise, and its torque, (T,) and (T, n).
    """

    model: di.Model
    filter: di.Filter
    controller: di.closed_loop.Controller
    recordings: tuple[di.Recording, ...]
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    tau: np.ndarray

    def error(self, found: di.Estimate) -> float:
        """Relative torque error of an estimate on the validation motion, mean of the joints."""
        block = self.model.block(self.t, self.q, self.v, self.a)
        off = self.model.torque(block, found.values) - self.tau
        return float(np.mean(np.linalg.norm(off, axis=0) / np.linalg.norm(self.tau, axis=0)))

    def fit(self, method: di.LeastSquares | di.IV, settings: di.Filter) -> di.Estimate:
        """Identify it."""
        return di.fit(self.model, di.Dataset(self.recordings, settings), method)


@cache
def arm(position_std: float, seed: int = 1, duration: float | None = None) -> Arm:
    """Record the arm with encoders of this noise (rad), for some time (s)."""
    experiment = di.closed_loop.load_experiment(HERE / "experiment.toml")
    train = tuple(
        replace(run, duration=duration or run.duration)
        for run in experiment.runs
        if run.use == "train"
    )
    (test,) = (run for run in experiment.runs if run.use == "test")
    sensors = replace(experiment.sensors, position_std=position_std)
    recordings = replace(experiment, runs=train, sensors=sensors, seed=seed).run()
    t = np.arange(round(test.duration * 100.0)) / 100.0
    q, v, a = test.trajectory.at(t)
    tau = experiment.mechanism().command(t, q, v, a)
    study = di.load(HERE / "study.toml")
    assert study.train.filter is not None
    return Arm(study.model, study.train.filter, experiment.controller, recordings, t, q, v, a, tau)


def loop(one: Arm, share: float = 1.0) -> di.IV:
    """Instruments from the simulated loop, at a share of its real bandwidth."""
    if share == 1.0:
        return di.IV(one.controller, start="regular")
    real = np.array(PUBLISHED["natural_frequency_hz"])
    settings = SimulatedLoop(one.controller, natural_frequency_hz=tuple(share * real))
    return di.IV(settings, start="regular")


def errors(one: Arm) -> dict[str, di.Estimate]:
    """The four estimates of the table."""
    return {
        "least squares, unfiltered": one.fit(di.LeastSquares(), UNFILTERED),
        "instruments, unfiltered": one.fit(loop(one), UNFILTERED),
        "least squares, filtered": one.fit(di.LeastSquares(), one.filter),
        "instruments, filtered": one.fit(loop(one), one.filter),
    }


def told(one: Arm, found: di.Estimate) -> tuple[str, str, str]:
    """Error, iterations and status of an estimate, as cells."""
    rounds = "" if found.history is None else str(len(found.history.rounds))
    return percent(one.error(found)), rounds, found.status


def noise_table(levels: tuple[float, ...], seed: int) -> Table:
    """All estimates at some levels of encoder noise."""
    rows = []
    for std in levels:
        one = arm(std, seed)
        for name, found in errors(one).items():
            rows.append((f"{std:g}", name, *told(one, found)))
    columns = ("encoder noise, rad", "estimate", "torque error", "iterations", "status")
    return Table("Validation motion without noise", columns, tuple(rows))


def bandwidth_table(position_std: float, seed: int) -> Table:
    """What a wrong bandwidth costs: instruments alone are concerned, not the regressor."""
    one = arm(position_std, seed)
    rows = []
    for share in SHARES:
        for name, settings in (("unfiltered", UNFILTERED), ("filtered", one.filter)):
            label = f"{number(share, 2)} of the real"
            try:
                rows.append((label, name, *told(one, one.fit(loop(one, share), settings))))
            except di.DynidentError as error:
                rows.append((label, name, "-", "", str(error)))
    title = f"Assumed bandwidth, encoder noise {position_std:g} rad"
    columns = ("natural frequencies", "regressor", "torque error", "iterations", "status")
    return Table(title, columns, tuple(rows))


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noise", type=float, nargs="+", default=list(LEVELS), metavar="RAD")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bandwidth", action="store_true", help="only what a wrong one costs")
    asked = parser.parse_args()
    if not asked.bandwidth:
        print_tables(noise_table(tuple(asked.noise), asked.seed))
    print_tables(bandwidth_table(LEVELS[1], asked.seed))


if __name__ == "__main__":
    main()
