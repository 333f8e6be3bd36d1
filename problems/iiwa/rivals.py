"""Estimators side by side on one noisy closed-loop recording of the seven-joint arm.

    python problems/iiwa/rivals.py
    python problems/iiwa/rivals.py --noise 1e-3 --seeds 3

Two errors, relative: of the torque along the true validation motion, and of the parameters, each in
units of the torque that it makes there. The filter is the toolkit's own: it leaves noise.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from table import HERE, Arm, arm

import dynident as di
from dynident.tables import Table, percent, print_tables

METHODS: dict[str, Any] = {
    "OLS": di.Regression("truncated"),
    "ridge": di.Regression("ridge"),
    "Bayes": di.Regression("bayes"),
    "Bayes, noise from the encoders": di.Regression("bayes", "encoders"),
    "corrected LS, noise from the encoders": di.Regression("corrected", "encoders"),
    "corrected LS, noise from repetitions": di.Regression("corrected", "repeats"),
}


@dataclass(frozen=True)
class Errors:
    """Of an estimate: in the torque and in the parameters."""

    torque: float
    parameters: float


def true_values(one: Arm) -> np.ndarray:
    """Return the parameters that the virtual arm has, (p,)."""
    experiment = di.closed_loop.load_experiment(HERE / "experiment.toml")
    values = one.model.given_values()
    for effect in experiment.effects:
        values[one.model.slices[effect.effect.label]] = effect.values
    return values


def errors(one: Arm, found: di.Estimate) -> Errors:
    """Judge an estimate along the true validation motion."""
    block, basis = one.model.block(one.t, one.q, one.v, one.a), found.basis
    # What data can tell: a rotor's inertia and that of its link count as their sum.
    kept = list(basis.independent)
    true = basis.coordinates(true_values(one))
    sizes = np.linalg.norm(one.model.columns(block).reshape(-1, one.model.size)[:, kept], axis=0)
    off = np.linalg.norm(sizes * (basis.coordinates(found.values) - true))
    off /= np.linalg.norm(sizes * true)
    return Errors(one.error(found), float(off))


def rivals(position_std: float, seed: int) -> dict[str, Errors | str]:
    """Errors of each estimator; the complaint of one that does not work here."""
    one = arm(position_std, seed)
    noise = di.recording.Noise(
        np.full(one.model.robot.n, position_std), np.zeros(one.model.robot.n)
    )
    dataset = di.Dataset(one.recordings, None, noise)
    methods = {**METHODS, "IV, simulated loop": di.IV(one.controller, start="regular")}
    found: dict[str, Errors | str] = {}
    for name, method in methods.items():
        try:
            found[name] = errors(one, di.fit(one.model, dataset, method))
        except di.DynidentError as error:
            found[name] = str(error)
    return found


def table(position_std: float, seeds: int) -> Table:
    """All estimators, with the spread over some draws of the noise."""
    every = [rivals(position_std, seed) for seed in range(1, seeds + 1)]
    rows = []
    for name in every[0]:
        each = [one[name] for one in every]
        sound = [x for x in each if isinstance(x, Errors)]
        words = next((x for x in each if isinstance(x, str)), "")
        cells = ["FAILURE", "FAILURE"]
        if len(sound) == len(each):
            cells = [
                f"{percent(min(x))} to {percent(max(x))}" if seeds > 1 else percent(x[0])
                for x in ([s.torque for s in sound], [s.parameters for s in sound])
            ]
        rows.append((name, *cells, words))
    title = f"Encoder noise {position_std:g} rad, default filter, {seeds} draws"
    return Table(title, ("estimator", "torque error", "parameter error", ""), tuple(rows))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--noise", type=float, default=1e-4, metavar="RAD")
    parser.add_argument("--seeds", type=int, default=3)
    asked = parser.parse_args()
    print_tables(table(asked.noise, asked.seeds))


if __name__ == "__main__":
    main()
