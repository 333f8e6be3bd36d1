"""Draw the pictures of the README: python docs/make_pictures.py."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

import dynident as di
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GREY, bars
from dynident.reporting.pictures.ellipsoids import inertia_ellipsoids

HERE = Path(__file__).resolve().parent
STUDY = HERE.parent / "problems" / "hidden_effect" / "study.toml"
JOINT = "elbow"


def main() -> None:
    """Run the loop on the study and draw what it found."""
    study = di.load(STUDY)
    diagnosis = di.diagnose(study.model, study.train, study.test)
    figure = Figure(figsize=(10.0, 3.6), layout=ConstrainedLayoutEngine(wspace=0.06))
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    residual(left, diagnosis)
    waterfall(right, diagnosis)
    figure.savefig(HERE / "hidden_effect.png", dpi=150, facecolor="white")
    report_page(diagnosis)
    impossible_links()
    noisy_positions()


def noisy_positions() -> None:
    """Least squares and instruments on one recording, while its filter is opened."""
    study = di.load(HERE.parent / "problems" / "scara" / "study.toml")
    assert study.controller is not None
    raw = replace(study.train, filter=di.Filter())
    loop = di.IV(study.controller)
    found = di.fit(study.model, raw, method=loop)
    figure = Figure(figsize=(10.0, 3.6), layout=ConstrainedLayoutEngine(wspace=0.06))
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    (run,) = di.validate(found, raw, study.controller).runs
    rows = (run.t >= 20.0) & (run.t <= 26.0)
    measured, simulated = run.measured.acceleration, run.simulated.acceleration
    left.plot(run.t[rows] - 20.0, measured[rows, 0], ".", color=GREY, ms=2, label="measured")
    name = "simulated in the same loop"
    left.plot(run.t[rows] - 20.0, simulated[rows, 0], color=AFTER_COLOUR, lw=2, label=name)
    left.set_xlabel("time (s)")
    left.set_ylabel("acceleration of the shoulder (rad/s²)")
    left.set_ylim(-4.5, 5.5)
    left.set_title("Positions, differentiated twice", loc="left", weight="bold")
    left.legend(loc="upper right", ncols=2, frameon=False)
    openings = {c: di.Filter(position_cutoff_hz=c) for c in (20.0, 30.0, 40.0, 60.0, 80.0)}
    names, truth = ("Izz.arm", "mx.forearm"), study.model.given_values()
    methods = (
        ("least squares", di.LeastSquares(), BEFORE_COLOUR, "o"),
        ("instruments", loop, AFTER_COLOUR, "D"),
    )
    for title, method, colour, marker in methods:
        fits = [di.fit(study.model, replace(raw, filter=f), method) for f in openings.values()]
        for name, line in zip(names, ("-", "--"), strict=True):
            i = study.model.names.index(name)
            shares = [100 * fit.values[i] / truth[i] for fit in fits]
            label = f"{title}: {name}"
            style = {"color": colour, "ls": line, "marker": marker, "ms": 4}
            right.plot(list(openings), shares, label=label, **style)
    right.axhline(100.0, color=GREY, lw=0.8)
    right.set_ylim(0.0, 145.0)
    right.set_yticks(np.arange(0, 101, 25))
    right.set_xlabel("cut-off of the positions' filter (Hz)")
    right.set_ylabel("estimate over truth (%)")
    right.set_title("What is estimated", loc="left", weight="bold")
    right.legend(loc="upper right", ncols=2, frameon=False, fontsize="small")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(HERE / "noisy_positions.png", dpi=150, facecolor="white")


def report_page(diagnosis: di.diagnosis.Diagnosis) -> None:
    """The top of the report as a browser shows it; left as it is where there is no chromium."""
    browser = which("chromium")
    if browser is None:
        print("no chromium: report.png is not drawn again")
        return
    from playwright.sync_api import sync_playwright

    with TemporaryDirectory() as folder, sync_playwright() as play:
        page = di.report(diagnosis, to=Path(folder) / "report.html")
        chromium = play.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        tab = chromium.new_page(viewport={"width": 1000, "height": 1000})
        tab.goto(page.as_uri())
        tab.wait_for_timeout(2000)  # until plotly has drawn
        tab.screenshot(path=HERE / "report.png")
        chromium.close()


def impossible_links() -> None:
    """The inertias of an estimate that no robot can have, and of the nearest possible robot."""
    study = di.load(HERE.parent / "problems" / "inconsistent_estimate" / "study.toml")
    fit = di.fit(study.model, study.train)
    robots = {"least squares": fit.robot, "projected": di.project(fit).robot}
    posture = [0.3, 0.5, 0.0, 0.9, 0.0, 0.6, 0.0]
    picture = inertia_ellipsoids(robots, posture)
    picture.savefig(HERE / "impossible_links.png", facecolor="white")


def residual(axes: Axes, diagnosis: di.diagnosis.Diagnosis) -> None:
    """Mean residual against velocity, before and after, with the band of the noise."""
    (one,) = (m for m in diagnosis.maps if (m.joint, m.against) == (JOINT, "velocity"))
    axes.fill_between(one.at, -one.band, one.band, color=GREY, alpha=0.35, lw=0, label="noise")
    axes.axhline(0.0, color=GREY, lw=0.8)
    before = {"color": BEFORE_COLOUR, "marker": "o", "mfc": "white", "ms": 4}
    axes.plot(one.at, one.before, **before, label="model as given")
    name = f"with {found(diagnosis)} added"
    axes.plot(one.at, one.after, color=AFTER_COLOUR, marker="D", ms=3.5, label=name)
    axes.set_xlabel(f"velocity of the {JOINT} ({one.unit})")
    axes.set_ylabel(f"mean torque residual ({one.torque_unit})")
    axes.set_title("Where the model fails", loc="left", weight="bold")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
    axes.legend(loc="upper left", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


def waterfall(axes: Axes, diagnosis: di.diagnosis.Diagnosis) -> None:
    """Held-out error as effects are added, down to the noise floor."""
    rows = bars(diagnosis)
    colours = {"given": BEFORE_COLOUR, "added": "white", "final": AFTER_COLOUR}
    for i, row in enumerate(rows):
        added = row.kind == "added"
        axes.barh(
            i,
            row.stop - row.start,
            left=row.start,
            height=0.62,
            color=colours[row.kind],
            edgecolor=AFTER_COLOUR if added else "none",
            hatch="//" if added else None,
        )
        end = max(row.start, row.stop)
        axes.annotate(row.text, (end, i), (5, 0), textcoords="offset points", va="center")
    floor = diagnosis.test_error.noise_floor
    if floor is not None:
        axes.axvline(100 * floor, color="black", linestyle="--", lw=1)
        axes.annotate(
            f"noise floor {100 * floor:.2f} %",
            (100 * floor, -0.52),
            (4, 0),
            textcoords="offset points",
            va="center",
        )
    axes.set_yticks(range(len(rows)), ["\n".join(map(proper, row.lines)) for row in rows])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(rows) - 0.5, -0.75)
    axes.set_xlim(0.0, 1.25 * max(row.stop for row in rows))
    axes.set_xlabel("held-out torque error of the arm (%)")
    axes.set_title("What is missing", loc="left", weight="bold")
    axes.spines[["top", "right", "left"]].set_visible(False)


def found(diagnosis: di.diagnosis.Diagnosis) -> str:
    """Name the effects that were added."""
    return proper(" and ".join(s.effect.name.replace("_", " ") for s in diagnosis.steps))


def proper(words: str) -> str:
    """Write a person's name with a capital letter."""
    return words.replace("stribeck", "Stribeck")


if __name__ == "__main__":
    main()
