"""Matplotlib pictures of a diagnosis, for notebooks and papers; what all still pictures share."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dynident import files
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.result import Diagnosis
from dynident.errors import DynidentError
from dynident.evidence.maps import ResidualMap
from dynident.reporting.content import (
    AFTER_COLOUR,
    BAND,
    BEFORE_COLOUR,
    GIVEN,
    GREY,
    after_name,
    bars,
    is_spectrum,
    maps_of,
    x_title,
    y_title,
)


class Picture(Figure):
    """A figure that notebooks show without pyplot and its global state."""

    def _repr_png_(self) -> bytes:
        buffer = BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def waterfall(diagnosis: Diagnosis) -> Figure:
    """Held-out torque error as effects are added, down to the noise floor."""
    figure = Picture(figsize=(7.0, 1.1 + 0.55 * len(bars(diagnosis))), layout="constrained")
    draw_waterfall(figure.subplots(), diagnosis)
    return figure


def draw_waterfall(axes: Axes, diagnosis: Diagnosis) -> None:
    """`waterfall` on given axes."""
    rows = bars(diagnosis)
    floor = diagnosis.test_error.noise_floor
    line_at = 100 * (floor or 0.0)
    width = 1.24 * max(*(max(row.start, row.stop) for row in rows), line_at, 1e-9)
    for i, row in enumerate(rows):
        added = row.kind == "added"
        axes.barh(
            i,
            row.stop - row.start,
            left=row.start,
            height=0.7,
            color="white" if added else BEFORE_COLOUR if row.kind == "given" else AFTER_COLOUR,
            edgecolor=AFTER_COLOUR if added else "none",
            hatch="//" if added else None,
        )
        begin = row.text_from(line_at, width)
        axes.annotate(row.text, (begin, i), (4, 0), textcoords="offset points", va="center")
    if floor is None:
        axes.set_title("noise floor unknown", fontsize="medium", loc="left")
    else:
        axes.axvspan(0.0, line_at, color=GREY, alpha=0.25, zorder=0)
        axes.axvline(line_at, color=GREY, linestyle="--")
        axes.set_title(f"noise floor {100 * floor:.2f} %", fontsize="medium", loc="left")
    axes.set_yticks(range(len(rows)), ["\n".join(map(plain, row.lines)) for row in rows])
    axes.invert_yaxis()
    axes.set_xlabel("held-out torque error (%)")
    axes.set_xlim(0.0, width)
    axes.spines[["top", "right"]].set_visible(False)


def residual_maps(diagnosis: Diagnosis, joint: str, given: str = GIVEN) -> Figure:
    """All residual maps of a joint side by side.

    Parameters
    ----------
    diagnosis, joint : which maps.
    given : what the legend calls the model that was diagnosed.

    Returns
    -------
    Figure with three maps a row.

    Raises
    ------
    DynidentError
        If the diagnosis has no such joint, or no map of it.
    """
    maps = maps_of(diagnosis, joint)
    columns = min(len(maps), 3)
    rows = -(-len(maps) // columns)
    figure = Picture(figsize=(3.6 * columns, 0.5 + 2.6 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(maps) :]:
        axes.set_visible(False)
    for axes, one in zip(grid, maps, strict=False):
        draw_residual_map(axes, diagnosis, one, given)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=3, frameon=False)
    return figure


def law_picture(proposal: Proposal) -> Figure:
    """What the model leaves on held-out data, against what a proposed law says.

    Raises
    ------
    DynidentError
        If the proposal has no picture.
    """
    one = proposal.picture
    if one is None:
        raise DynidentError("has no picture", f"the proposal {proposal.torque}")
    figure = Picture(figsize=(4.6, 3.4), layout="constrained")
    axes = figure.subplots()
    if np.isfinite(one.band).all():
        limits = one.law - one.band, one.law + one.band
        axes.fill_between(one.law, *limits, color=GREY, alpha=0.25, label=BAND)
    axes.plot(one.law, one.law, color=AFTER_COLOUR, label="the law")
    axes.plot(
        one.law, one.residual, "o", mfc="none", color=BEFORE_COLOUR, label="left by the model"
    )
    axes.set_xlabel(f"torque of {plain(proposal.torque)} ({one.torque_unit})")
    axes.set_ylabel(f"mean residual ({one.torque_unit})")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_residual_map(
    axes: Axes, diagnosis: Diagnosis, one: ResidualMap, given: str = GIVEN
) -> None:
    """Mean residual against one quantity, before and after, with the noise band, on given axes.

    Parameters
    ----------
    axes : of matplotlib.
    diagnosis : for the name of its final model.
    one : one of `Diagnosis.maps`.
    given : what the legend calls the model that was diagnosed.
    """
    marks = ("", "") if is_spectrum(one) else ("o", "D")
    if np.isfinite(one.band).any():
        lower = np.zeros_like(one.band) if is_spectrum(one) else -one.band
        axes.fill_between(one.at, lower, one.band, color=GREY, alpha=0.3, lw=0, label=BAND)
    name = plain(given)
    axes.plot(
        one.at, one.before, color=BEFORE_COLOUR, marker=marks[0], mfc="white", ms=4, label=name
    )
    if diagnosis.steps:
        name = plain(after_name(diagnosis))
        axes.plot(one.at, one.after, color=AFTER_COLOUR, marker=marks[1], ms=4, label=name)
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_xlabel(plain(x_title(one)))
    axes.set_ylabel(plain(y_title(one)))
    axes.spines[["top", "right"]].set_visible(False)


def plain(text: str) -> str:
    """Words as matplotlib shows them: a dollar sign in a joint's name is not mathematics."""
    return text.replace("$", r"\$")


def save(figure: Figure, path: str | Path) -> Path:
    """Write a picture; the file's suffix is its format (.png, .svg, .pdf).

    Raises
    ------
    FileError
        If it cannot be written; an old file is then untouched.
    """
    buffer = BytesIO()
    figure.savefig(buffer, format=Path(path).suffix.lower().removeprefix("."))
    return files.write_bytes(path, buffer.getvalue())
