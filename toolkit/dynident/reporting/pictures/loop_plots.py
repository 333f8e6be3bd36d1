"""Matplotlib pictures of a simulated loop, for `--plot`, notebooks and papers."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dynident.errors import DynidentError
from dynident.reporting.content import AFTER_COLOUR, GREY
from dynident.reporting.loop_content import (
    MEASURED,
    REFERENCE_COLOUR,
    SIMULATED,
    LoopTrace,
    loop_trace,
)
from dynident.reporting.pictures.plots import Picture, plain
from dynident.tables import percent
from dynident.validation.loop_errors import QUANTITIES, LoopRun
from dynident.validation.validation_result import Validation
from dynident.words import nearest


def simulated_loop(
    validation: Validation, recording: str | None = None, joints: tuple[str, ...] | None = None
) -> Figure:
    """Return a figure of a recording's simulated loop: two rows a joint, a column a quantity.

    Above, what was measured, simulated, and the reference (of the torque: what the control law
    gives for the recorded positions); below, what each leaves of the measurement, with the band of
    the noise (2 rms) where it is known.

    Parameters
    ----------
    validation : as `validate` returns it.
    recording : name; by default the first.
    joints : names; by default all.

    Raises
    ------
    DynidentError
        If there is no such joint, or the recording's loop was not simulated.
    """
    run = _run_of(validation, recording)
    shown = [_joint_of(validation, joint) for joint in joints or validation.joints]
    # A fixed grid: laying out the text of a seven-joint arm would take longer than drawing it.
    width, height = 14.0, 1.2 + 3.6 * len(shown)
    figure = Picture(figsize=(width, height))
    figure.subplots_adjust(
        left=0.85 / width,
        right=1 - 0.15 / width,
        bottom=0.5 / height,
        top=1 - 0.8 / height,
        wspace=0.38,
        hspace=0.28,
    )
    grid = figure.subplots(2 * len(shown), len(QUANTITIES), sharex=True, squeeze=False)
    errors = validation.error_of(run)
    for row, j in enumerate(shown):
        for column, quantity in enumerate(QUANTITIES):
            trace = loop_trace(validation, run, j, quantity)
            signals, left = grid[2 * row, column], grid[2 * row + 1, column]
            _draw_signals(signals, trace)
            _draw_differences(left, trace)
            error = percent(float(errors.joints[column, j]), 3 if column == 0 else 2)
            name = plain(validation.joints[j])
            signals.set_title(f"{name}: {quantity}, {error} off", fontsize="medium", loc="left")
            signals.set_ylabel(trace.unit)
            left.set_ylabel(f"difference ({trace.unit})")
            for axes in (signals, left):
                axes.spines[["top", "right"]].set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("time (s)")
    found = {}
    for axes in (*grid[0], *grid[1]):
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    figure.legend(found.values(), found.keys(), loc="upper right", ncols=len(found), frameon=False)
    title = f"{plain(run.name)}: {validation.controller}"
    figure.suptitle(title, fontsize="medium", ha="left", x=0.01, y=1 - 0.18 / height)
    return figure


def _draw_signals(axes: Axes, trace: LoopTrace) -> None:
    axes.plot(trace.t, trace.measured, color=GREY, linewidth=2.6, label=MEASURED)
    _yardstick(axes, trace, trace.yardstick)
    axes.plot(trace.t, trace.simulated, color=AFTER_COLOUR, linewidth=1.2, label=SIMULATED)


def _draw_differences(axes: Axes, trace: LoopTrace) -> None:
    if trace.noise is not None:
        band = 2 * trace.noise
        axes.axhspan(-band, band, color=GREY, alpha=0.3, lw=0, label="noise (2 rms)")
    _yardstick(axes, trace, trace.measured - trace.yardstick)
    left = trace.measured - trace.simulated
    axes.plot(trace.t, left, color=AFTER_COLOUR, linewidth=1.0, label=SIMULATED)
    axes.axhline(0.0, color=GREY, linewidth=0.8)


def _yardstick(axes: Axes, trace: LoopTrace, values) -> None:
    dash = {"color": REFERENCE_COLOUR, "linewidth": 1.0, "linestyle": "--"}
    axes.plot(trace.t, values, label=trace.yardstick_name, **dash)


def _run_of(validation: Validation, recording: str | None = None) -> LoopRun:
    """Return the run of a recording; the first without its name."""
    if not validation.runs:
        raise DynidentError("no loop was simulated, so that there is nothing to draw")
    for run in validation.runs:
        if recording in (None, run.name):
            return run
    valid = ", ".join(run.name for run in validation.runs)
    raise DynidentError("was not simulated", f"recording '{recording}'", f"recordings: {valid}")


def _joint_of(validation: Validation, joint: str) -> int:
    """Return the place of a joint."""
    if joint not in validation.joints:
        remedy = nearest(joint, validation.joints, "joints")
        raise DynidentError(f"no joint '{joint}'", remedy=remedy)
    return validation.joints.index(joint)
