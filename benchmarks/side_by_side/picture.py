"""The picture of the page: how figures grow with the work."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from side_by_side.line import OURS, from_json

ACROSS = 3


def draw(found: Mapping[str, Any], to: Path) -> None:
    """A panel for every benchmark with an axis; two of ours or a peer are a curve each."""
    panels = [one for one in found["sections"].values() if one["axis"]]
    rows = max(1, math.ceil(len(panels) / ACROSS))
    figure = Figure(figsize=(4.2 * ACROSS, 3.4 * rows), layout="constrained")
    axes = figure.subplots(rows, ACROSS, squeeze=False).ravel()
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    for axis, one in zip(axes, panels, strict=False):
        for who, points in _curves(one).items():
            style = "o-" if who.startswith(OURS) else "s--"
            width = 2.0 if who.startswith(OURS) else 1.2
            axis.plot(*zip(*sorted(points), strict=True), style, ms=4, lw=width, label=who)
        axis.set_xscale("log")
        axis.set_yscale("log")
        _plain_marks(axis)
        axis.set_xlabel(one["axis"])
        axis.set_ylabel(one["compared"])
        axis.set_title(one["title"], loc="left", fontsize=8, weight="bold")
        axis.grid(alpha=0.3, which="both", lw=0.4)
        if axis.lines:
            axis.legend(frameon=False, fontsize=7)
    figure.savefig(to, dpi=110)


def _plain_marks(axis: Any) -> None:
    """Marks where the points are, and at least a decade of height."""
    places = sorted({x for line in axis.lines for x in line.get_xdata()})
    if max(places, default=0.0) < 1e3:
        axis.set_xticks(places, [f"{place:g}" for place in places])
    axis.xaxis.set_minor_formatter(NullFormatter())
    low, high = axis.get_ylim()
    if high < 10 * low:
        middle = math.sqrt(low * high)
        axis.set_ylim(middle / 4, 4 * middle)


def _curves(one: Mapping[str, Any]) -> dict[str, list[tuple[float, float]]]:
    curves: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for line in map(from_json, one["lines"]):
        value = line.figures.get(one["compared"])
        if line.at is not None and value:
            curves[line.who].append((line.at, value))
    return curves
