"""Matplotlib pictures of the iterations of an instrumental variable estimate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dynident.errors import DynidentError
from dynident.fitting.history import Convergence
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GREY
from dynident.reporting.pictures.plots import Picture, plain
from dynident.tables import number

_WIDE = 4
_INTERVAL = 1.96
_COLOURS = (AFTER_COLOUR, BEFORE_COLOUR, "#2e8b57", "#7b4fa3")
_MARKS = ("o", "D", "s", "^")


def convergence(
    history: Convergence | Mapping[str, Convergence], truth: Mapping[str, float] | None = None
) -> Figure:
    """Every parameter over the iterations, and last both relative errors.

    The band is the final estimate's 95 % interval, of the first history; the estimate to the left
    of all is the start.

    Parameters
    ----------
    history : of an estimate (`Estimate.history`), or several by name, of the same parameters.
    truth : values by the names of the parameters, where they are known: a dotted line.

    Raises
    ------
    DynidentError
        If there is no history, or the histories are of different parameters.
    """
    shown = {"": history} if isinstance(history, Convergence) else dict(history)
    if not shown:
        raise DynidentError("there are no iterations to draw")
    first = next(iter(shown.values()))
    if any(one.names != first.names for one in shown.values()):
        remedy = "draw each in a picture of its own"
        raise DynidentError("the estimates have different parameters", remedy=remedy)
    panels = len(first.names) + 1
    columns = min(panels, _WIDE)
    rows = -(-panels // columns)
    figure = Picture(figsize=(3.1 * columns, 0.6 + 2.1 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[panels:]:
        axes.set_visible(False)
    for i, axes in enumerate(grid[: panels - 1]):
        _parameter(axes, shown, i, (truth or {}).get(first.names[i]))
    _errors(grid[panels - 1], shown)
    handles, labels = [], []
    for axes in grid[:panels]:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            if label not in labels:
                handles.append(handle)
                labels.append(label)
    figure.legend(handles, labels, loc="outside upper left", ncols=4, frameon=False)
    return figure


def _parameter(axes: Axes, shown: Mapping[str, Convergence], i: int, truth: float | None) -> None:
    first = next(iter(shown.values()))
    final, half = first.values[-1, i], _INTERVAL * first.sigma[i]
    if np.isfinite(half):
        axes.axhspan(final - half, final + half, color=GREY, alpha=0.3, lw=0, label="95 % interval")
    if truth is not None:
        axes.axhline(truth, color="black", linestyle=":", linewidth=1.2, label="true value")
    for k, (name, one) in enumerate(shown.items()):
        axes.plot(
            one.values[:, i],
            color=_COLOURS[k % len(_COLOURS)],
            marker=_MARKS[k % len(_MARKS)],
            ms=4,
            label=plain(name) or "estimate",
        )
    said = f"{number(float(final), 4)} \u00b1 {number(float(half), 2)} {first.units[i]}"
    axes.set_title(plain(f"{first.names[i]}\n{said}"), fontsize="medium", loc="left")
    _dressed(axes, shown)


def _errors(axes: Axes, shown: Mapping[str, Convergence]) -> None:
    for k, one in enumerate(shown.values()):
        colour = _COLOURS[k % len(_COLOURS)]
        at = np.arange(1, len(one.rounds) + 1)
        styles = (
            ("regressor measured", one.errors_measured, "--"),
            ("regressor simulated", one.errors_simulated, "-"),
        )
        for label, errors, line in styles:
            axes.plot(
                at, 100 * errors, color=colour, linestyle=line, marker=".", label=f"error, {label}"
            )
    axes.set_title("relative error (%)", fontsize="medium", loc="left")
    every = np.concatenate([one.errors_simulated for one in shown.values()])
    if len(every) and every.max() > 20 * every.min() > 0:
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=0.0)
    _dressed(axes, shown)


def _dressed(axes: Axes, shown: Mapping[str, Convergence]) -> None:
    most = max(len(one.rounds) for one in shown.values())
    axes.set_xlim(-0.2, most + 0.2)
    axes.set_xticks(np.unique(np.linspace(0, most, min(most, 6) + 1).astype(int)))
    axes.set_xlabel("iteration", fontsize="small")
    axes.spines[["top", "right"]].set_visible(False)
