"""Draw the pictures of the README: python docs/make_pictures.py."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

import dynident as di
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GREY
from dynident.reporting.pictures.ellipsoids import inertia_ellipsoids
from dynident.reporting.pictures.plots import draw_residual_map, draw_waterfall

HERE = Path(__file__).resolve().parent
STUDY = HERE.parent / "problems" / "hidden_effect" / "study.toml"
JOINT = "elbow"


def main() -> None:
    """Run the loop on the study and draw what it found."""
    study = di.load(STUDY)
    diagnosis = di.diagnose(study.model, study.train, study.test, switches="all")
    missing_effect(diagnosis)
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
    browser = which("chromium-headless-shell") or which("chromium")
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


def missing_effect(diagnosis: di.diagnosis.Diagnosis) -> None:
    """Where the model of a two-link arm fails, and which effect it lacks."""
    figure = Figure(figsize=(10.0, 3.6), layout=ConstrainedLayoutEngine(wspace=0.06))
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    (one,) = (m for m in diagnosis.maps if (m.joint, m.against) == (JOINT, "velocity"))
    draw_residual_map(left, diagnosis, one)
    left.set_title("Where the model fails", loc="left", weight="bold")
    left.set_xlabel(f"velocity of the {JOINT} ({one.unit})")
    low, high = left.get_ylim()
    left.set_ylim(low, high + 0.4 * (high - low))  # room for the legend
    left.legend(loc="upper left", frameon=False)
    draw_waterfall(right, diagnosis)
    right.set_title(f"What is missing ({right.get_title(loc='left')})", loc="left", weight="bold")
    figure.savefig(HERE / "hidden_effect.png", dpi=150, facecolor="white")


if __name__ == "__main__":
    main()
