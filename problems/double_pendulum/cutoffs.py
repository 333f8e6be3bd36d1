"""Inertial parameters of the pendulum as the filter is opened: least squares and instruments.

    python problems/double_pendulum/cutoffs.py [--instruments 5] [HZ ...]

A consistent estimator gives the same inertia at every cut-off. Least squares does not: the wider
the filter, the more noise there is in the accelerations, and the smaller the inertias become.
"""

from __future__ import annotations

import argparse
import tomllib
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

import dynident as di
from dynident.fitting.instrumental import Filtered
from dynident.recording import uniform
from dynident.tables import Table, number, print_tables

HERE = Path(__file__).parent
PUBLISHED = tomllib.loads((HERE / "published.toml").read_text())
CUTOFFS: tuple[float, ...] = tuple(PUBLISHED["cutoffs"]["hz"])
INSTRUMENTS_HZ: float = PUBLISHED["cutoffs"]["instruments_hz"]
UPPER = 0.2
"""m, length of the upper link."""
INERTIAL = ("J1", "J2", "m2r2", "g1")
LUMPED = (*INERTIAL, "Fv1", "Fv2", "Fc1", "Fc2")
"""The authors' parameters. J1 is less the rotor: that at the elbow, for the motors are alike."""


def load() -> di.Study:
    """Return the study with its records on uniform clocks, which all fits then share."""
    with warnings.catch_warnings():
        # The stamps are jittered: it would be said nine times.
        warnings.simplefilter("ignore", di.DynidentWarning)
        study = di.load(HERE / "study.toml")
        recordings = tuple(uniform(one) for one in study.train.recordings)
    return replace(study, train=replace(study.train, recordings=recordings))


def estimate(study: di.Study, cutoff_hz: float, method: di.LeastSquares | di.IV) -> di.Estimate:
    """Identify the pendulum from positions below a cut-off."""
    settings = study.train.filter
    assert settings is not None
    settings = replace(settings, position_cutoff_hz=cutoff_hz)
    return di.fit(study.model, replace(study.train, filter=settings), method)


def lumped(found: di.Estimate) -> dict[str, float]:
    """Return an estimate in the authors' parameters."""
    by_name = dict(zip(found.names, (float(x) for x in found.values), strict=True))
    return {
        "J1": by_name["Iyy.upper"] - by_name["Ia@elbow"],
        "J2": by_name["Iyy.lower"],
        "m2r2": -by_name["mz.lower"],
        "g1": -by_name["mz.upper"],
        "Fv1": by_name["Fv@shoulder"],
        "Fv2": by_name["Fv@elbow"],
        "Fc1": by_name["Fc@shoulder"],
        "Fc2": by_name["Fc@elbow"],
    }


def sweep(
    study: di.Study, method: di.LeastSquares | di.IV, cutoffs: tuple[float, ...] = CUTOFFS
) -> dict[str, np.ndarray]:
    """Return each of the authors' parameters at every cut-off."""
    rows = [lumped(estimate(study, hz, method)) for hz in cutoffs]
    return {name: np.array([row[name] for row in rows]) for name in LUMPED}


def table_of(title: str, found: dict[str, np.ndarray], cutoffs: tuple[float, ...]) -> Table:
    """The parameters, a column for each cut-off, beside those of the authors."""
    rows = []
    for name, values in found.items():
        cells = [number(float(x), 3) for x in values]
        ratio = f"{100 * (values[-1] / values[0] - 1):+.1f} %" if len(values) > 1 else ""
        authors = ", ".join(number(x, 3) for x in PUBLISHED["authors"].get(name, ()))
        rows.append((name, *cells, ratio, authors))
    heads = tuple(f"{hz:g} Hz" for hz in cutoffs)
    return Table(title, ("", *heads, "last to first", "authors"), tuple(rows))


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cutoffs", nargs="*", type=float, metavar="HZ", default=list(CUTOFFS))
    parser.add_argument("--instruments", type=float, default=INSTRUMENTS_HZ, metavar="HZ")
    asked = parser.parse_args()
    cutoffs = tuple(asked.cutoffs)
    study = load()
    least_squares = sweep(study, di.LeastSquares(), cutoffs)
    instruments = sweep(study, di.IV(Filtered(asked.instruments)), cutoffs)
    title = f"Instruments: the measured positions below {asked.instruments:g} Hz"
    print_tables(
        table_of("Least squares", least_squares, cutoffs), table_of(title, instruments, cutoffs)
    )


if __name__ == "__main__":
    main()
