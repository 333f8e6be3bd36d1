"""EMPS in its closed loop: the simulated motion beside the record, and a noisier encoder.

    python problems/emps/closed_loop.py [--seed 0]

First the four errors of the simulated loop beside the published ones. Then white noise of 5e-5 m
is added to the measured position, and the carriage identified by least squares and with
instruments from its simulated loop.
"""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynident as di
from dynident.tables import Table, number, percent, print_tables

HERE = Path(__file__).parent
PUBLISHED = tomllib.loads((HERE / "published.toml").read_text())
QUANTITIES = ("q", "v", "a", "tau")
MASS = "m.carriage"


def load() -> di.Study:
    """The study of the closed loop."""
    return di.load(HERE / "study_closed_loop.toml")


def noisier(study: di.Study, seed: int = 0, duration: float | None = None) -> di.Dataset:
    """The record, or the first s of it, with white noise added to its position."""
    (recording,) = study.train.recordings
    if duration is not None:
        recording = recording.cut(None, float(recording.t[0]) + duration)
    noise = np.random.default_rng(seed).standard_normal(recording.q.shape)
    q = recording.q + PUBLISHED["noise"]["position_std"] * noise
    return replace(study.train, recordings=(recording.replace(q=q),))


def instruments(study: di.Study) -> di.IV:
    """Instruments from the simulated loop.

    Least squares is no start here: unfiltered it leaves a mass of 18 g, whose loop is so stiff
    that simulating it takes minutes.
    """
    assert study.controller is not None
    return di.IV(study.controller, start="regular")


def loop_errors(study: di.Study) -> dict[str, float]:
    """Relative errors of the simulated loop against the measurement."""
    found = di.fit(study.model, study.train, di.LeastSquares("none"))
    assert study.controller is not None
    validation = di.validate(found, study.train, study.controller)
    return {name: float(x) for name, x in zip(QUANTITIES, validation.errors.overall, strict=True)}


def loop_table(study: di.Study) -> Table:
    """The four errors beside the published ones."""
    ours, theirs = loop_errors(study), PUBLISHED["closed_loop"]
    rows = tuple((name, percent(theirs[name], 3), percent(ours[name], 4)) for name in QUANTITIES)
    return Table("Simulated loop against the measurement", ("", "published", "ours"), rows)


def noise_table(study: di.Study, seed: int) -> Table:
    """Least squares and instruments on the noisier record, with two filters."""
    dataset = noisier(study, seed)
    clean = di.fit(study.model, study.train, di.LeastSquares("none"))
    estimates = [("as recorded, least squares", clean)]
    for name, settings in (("authors' filter", dataset.filter), ("unfiltered", di.Filter())):
        data = replace(dataset, filter=settings)
        for method in (di.LeastSquares("none"), instruments(study)):
            kind = "instruments" if isinstance(method, di.IV) else method.name
            label = f"{name}, {kind}"
            estimates.append((label, di.fit(study.model, data, method)))
    rows = []
    for label, found in estimates:
        off = found.value(MASS) / clean.value(MASS) - 1.0
        values = [number(float(x), 5) for x in found.values]
        rows.append((label, *values, f"{100 * off:+.2f} %"))
    std = PUBLISHED["noise"]["position_std"]
    title = f"White noise of {std:g} m added to the position"
    heads = ("", "m, kg", "Fv, N s/m", "Fc, N", "offset, N", "mass off by")
    return Table(title, heads, tuple(rows))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    seed = parser.parse_args().seed
    study = load()
    print_tables(loop_table(study), noise_table(study, seed))


if __name__ == "__main__":
    main()
