"""Draw the pictures of the README: python docs/make_pictures.py."""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

import dynident as di
from dynident.report.content import AFTER_COLOUR, BEFORE_COLOUR, GREY, bars
from dynident.report.ellipsoids import inertia_ellipsoids

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
    impossible_links()


def impossible_links() -> None:
    """The inertias of an estimate that no robot can have, and of the nearest possible robot."""
    study = di.load(HERE.parent / "problems" / "inconsistent_estimate" / "study.toml")
    fit = di.fit(study.model, study.train)
    robots = {"least squares": fit.robot, "projected": di.project(fit).robot}
    posture = [0.3, 0.5, 0.0, 0.9, 0.0, 0.6, 0.0]
    picture = inertia_ellipsoids(robots, posture)
    picture.savefig(HERE / "impossible_links.png", facecolor="white")


def residual(axes: Axes, diagnosis: di.Diagnosis) -> None:
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


def waterfall(axes: Axes, diagnosis: di.Diagnosis) -> None:
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


def found(diagnosis: di.Diagnosis) -> str:
    """Name the effects that were added."""
    return proper(" and ".join(s.effect.name.replace("_", " ") for s in diagnosis.steps))


def proper(words: str) -> str:
    """Write a person's name with a capital letter."""
    return words.replace("stribeck", "Stribeck")


if __name__ == "__main__":
    main()
