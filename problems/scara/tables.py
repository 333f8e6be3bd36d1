"""The paper's tables of this robot with ours beside them, entry by entry.

    python problems/scara/tables.py
    python problems/scara/tables.py 1 6

An entry agrees if it is within the paper's two standard deviations, or within 2 % (and the
rounding) where these are smaller than the rounding of what the paper prints.
"""

from __future__ import annotations

import argparse
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import dynident as di
from dynident.fitting.instrumental import SimulatedLoop
from dynident.tables import Table, number, percent, print_tables

HERE = Path(__file__).parent
PAPER = tomllib.loads((HERE / "published.toml").read_text())
NAMES: tuple[str, ...] = tuple(PAPER["parameters"])
REQUIRED = ("1", "2", "3", "6")
"""Tables that the virtual robot is to agree with; 5 is how wrong it gets, 7 a wrong bandwidth."""
SLACK = 0.02
FULL_HZ = np.array([1.0, 10.0])
"""Natural frequencies of the loop."""


@dataclass(frozen=True)
class Entry:
    """One parameter of one table.

    Attributes
    ----------
    name : as in the paper.
    paper, two_sigma, rounding : as printed.
    ours : the estimate.
    """

    name: str
    paper: float
    two_sigma: float
    rounding: float
    ours: float = np.nan

    @property
    def tolerance(self) -> float:
        """How far ours may be off."""
        if self.two_sigma >= self.rounding:
            return self.two_sigma
        return max(SLACK * abs(self.paper), self.rounding)

    @property
    def agrees(self) -> bool:
        """Whether ours is within the tolerance."""
        return abs(self.ours - self.paper) <= self.tolerance

    @property
    def interval(self) -> tuple[float, float]:
        """What the table allows."""
        return self.paper - self.tolerance, self.paper + self.tolerance

    @property
    def is_friction(self) -> bool:
        """Whether it is a friction parameter."""
        return self.name.startswith("F")


def paper_entries(table: str) -> tuple[Entry, ...]:
    """Entries of one of the paper's tables, ours unknown."""
    said = PAPER["tables"][table]
    cells = zip(NAMES, said["value"], said["two_sigma"], said["rounding"], strict=True)
    return tuple(Entry(*cell) for cell in cells)


def common_interval(name: str, tables: tuple[str, ...] = REQUIRED) -> tuple[float, float] | None:
    """Return the values of a parameter that all these tables allow; None if they exclude it."""
    rows = [e.interval for t in tables for e in paper_entries(t) if e.name == name]
    low, high = max(a for a, _ in rows), min(b for _, b in rows)
    return (low, high) if low <= high else None


def in_paper_terms(values: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Values of our parameters as the paper's eight, in its order."""
    ours = dict(zip(names, values, strict=True))
    length = PAPER["length"]
    return np.array(
        [
            ours["Izz.arm"],
            ours["Fv@shoulder"],
            ours["Fc@shoulder"],
            ours["Izz.forearm"],
            length * ours["mx.forearm"],
            length * ours["my.forearm"],
            ours["Fv@elbow"],
            ours["Fc@elbow"],
        ]
    )


def truth() -> np.ndarray:
    """The virtual robot's parameters in the paper's terms, (8,)."""
    study, experiment = (
        di.load(HERE / "study.toml"),
        di.closed_loop.load_experiment(HERE / "experiment.toml"),
    )
    model = study.model
    values = model.given_values()
    for one in experiment.effects:
        values[model.slices[one.effect.label]] = one.values
    return in_paper_terms(values, model.names)


def estimate(table: str) -> di.Estimate:
    """Identify the robot as one of the paper's tables does."""
    study = di.load(HERE / "study.toml")
    assert study.controller is not None
    unfiltered = replace(study.train, filter=di.Filter())
    half = SimulatedLoop(study.controller, natural_frequency_hz=tuple(FULL_HZ / 2))
    how: dict[str, tuple[di.Dataset, Any]] = {
        "1": (study.train, di.LeastSquares(errors="independent")),
        "2": (study.train, di.IV(study.controller, start="least_squares")),
        "3": (study.train, di.IV(study.controller, start="regular")),
        "5": (unfiltered, di.LeastSquares(errors="independent")),
        "6": (unfiltered, di.IV(study.controller, start="regular")),
        "7": (study.train, di.IV(half, start="regular")),
    }
    dataset, method = how[table]
    return di.fit(study.model, dataset, method)


def entries(table: str, found: di.Estimate) -> tuple[Entry, ...]:
    """Entries of one of the paper's tables with ours."""
    ours = in_paper_terms(found.values, found.names)
    rows = zip(paper_entries(table), ours, strict=True)
    return tuple(replace(entry, ours=float(value)) for entry, value in rows)


def judged(entry: Entry, table: str) -> str:
    """Return in words how an entry compares."""
    if entry.agrees:
        return "within 2 sigma" if entry.two_sigma >= entry.rounding else "within 2 %"
    if table not in REQUIRED:
        return f"{100 * (entry.ours / entry.paper - 1):+.0f} % from the paper's"
    off = f"{entry.ours - entry.paper:+.2g}"
    if abs(entry.ours - entry.paper) <= SLACK * abs(entry.paper):
        off += " (within 2 %)"
    if common_interval(entry.name) is None:
        return f"{off}: no robot can, the tables exclude each other"
    return f"{off}: bias of dry friction" if entry.is_friction else f"{off}: no"


def table_of(table: str, found: di.Estimate) -> Table:
    """One of the paper's tables with ours beside it."""
    said, history = PAPER["tables"][table], found.history
    rows = []
    two_sigma = 2 * in_paper_terms(found.sigma, found.names)
    for entry, true, sigma in zip(entries(table, found), truth(), two_sigma, strict=True):
        cells = (true, entry.paper, entry.two_sigma, entry.ours, sigma)
        rows.append((entry.name, *(number(x) for x in cells[:4]), number(cells[4], 2)))
        rows[-1] += (judged(entry, table),)
    error = found.error if history is None else history.errors_simulated[-1]
    rows.append(("relative error", "", number(said.get("error")), "", number(error, 2), "", ""))
    notes: tuple[str, ...] = ()
    if history is not None:
        rows.append(
            ("iterations", "", number(said.get("iterations")), "", str(len(history.rounds)), "", "")
        )
        notes = ("The relative error is that of the simulated regressor.",)
        notes += tuple(note for note in found.notes if "Expected bias" in note)
    title = f"Table {table}: {said['title']}"
    columns = ("", "truth", "paper", "2 sigma", "ours", "2 sigma", "agrees")
    return Table(title, columns, tuple(rows), notes)


def loop_errors(found: di.Estimate) -> dict[str, float]:
    """Relative errors of the simulated motion against the measured one, filtered alike."""
    study = di.load(HERE / "study.toml")
    assert study.controller is not None
    overall = di.validate(found, study.train, study.controller).errors.overall
    return dict(zip(("position", "velocity", "acceleration"), overall, strict=False))


def loop_table(found: di.Estimate) -> Table:
    """The simulated motion of an estimate beside the paper's."""
    rows = tuple(
        (name, percent(PAPER["limits"][f"loop_error_{name}"], 1), percent(float(error), 2))
        for name, error in loop_errors(found).items()
    )
    return Table("Simulated against measured motion", ("", "paper", "ours"), rows)


def missed_by_nominal() -> tuple[str, ...]:
    """Entries of the required tables that a perfect estimate of the nominal robot misses."""
    return tuple(
        f"{entry.name} (table {table})"
        for table in REQUIRED
        for entry, value in zip(paper_entries(table), PAPER["nominal"], strict=True)
        if not replace(entry, ours=value).agrees
    )


def choice_of_truth() -> Table:
    """What the paper's tables leave to a robot that agrees with all of them."""
    rows = []
    for name, nominal, true in zip(NAMES, PAPER["nominal"], truth(), strict=True):
        allowed = common_interval(name)
        text = "none: they exclude each other" if allowed is None else "{:.5g} to {:.5g}"
        cell = text if allowed is None else text.format(*allowed)
        rows.append((name, number(nominal), cell, number(true)))
    columns = ("", "paper, nominal", f"allowed by tables {', '.join(REQUIRED)}", "virtual robot")
    missed, entries = missed_by_nominal(), len(REQUIRED) * len(NAMES)
    note = f"The paper's own nominal values miss {len(missed)} of {entries}: {', '.join(missed)}."
    return Table("The robot", columns, tuple(rows), (note,))


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tables", nargs="*", default=list(PAPER["tables"]), metavar="TABLE")
    asked = parser.parse_args().tables
    unknown = [name for name in asked if name not in PAPER["tables"]]
    if unknown:
        parser.error(f"no table {unknown[0]}: choose of {', '.join(PAPER['tables'])}")
    estimates = {name: estimate(name) for name in asked}
    print_tables(choice_of_truth(), *(table_of(*each) for each in estimates.items()))
    if "3" in estimates:
        print_tables(loop_table(estimates["3"]))


if __name__ == "__main__":
    main()
