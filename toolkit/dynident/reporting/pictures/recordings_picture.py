"""Positions and torques over time, joint by joint: what fits, what judges, what is not used."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from dynident.recording import Recording
from dynident.study import Study

_POINTS = 3000  # of a line; more are no sharper
_USED = {"train": "#1f7fc4", "test": "#c8501e"}
_FAINT = 0.16
_APART = 0.02  # of the whole time, between files


@dataclass(frozen=True, eq=False, kw_only=True)
class _Stretch:
    """A file's record on the common axis of time, with the entries that use it."""

    recording: Recording
    entries: tuple[Recording, ...]
    shift: float  # s, from its clock to the axis


def recordings_figure(study: Study, form: str) -> bytes:
    """Draw all recordings of a study, one after the other.

    Parameters
    ----------
    study : as it was loaded.
    form : of the picture: "png", "svg" or "pdf".

    Returns
    -------
    The file's bytes.
    """
    robot = study.robot
    stretches = _stretches(study)
    figure = Figure(figsize=(12.0, 1.2 + 1.35 * robot.n), layout="constrained")
    axes = figure.subplots(robot.n, 2, sharex=True, squeeze=False)
    for j, joint in enumerate(robot.names):
        for column, unit in enumerate((robot.units[j], robot.torque_units[j])):
            own: Axes = axes[j, column]
            for one in stretches:
                _draw(own, one, j, column)
            own.set_ylabel(f"{joint}\n{unit}" if column == 0 else unit, fontsize=9)
            own.tick_params(labelsize=8)
            own.margins(x=0.01)
            own.grid(alpha=0.25)
    for column, title in enumerate(("position", "torque")):
        axes[0, column].set_title(title, fontsize=10)
        axes[-1, column].set_xlabel("time, s; recordings one after the other", fontsize=9)
    marks = [
        Patch(color=_USED["train"], alpha=2 * _FAINT, label="fitted"),
        Patch(color=_USED["test"], alpha=2 * _FAINT, label="held out, to judge by"),
        Patch(facecolor="none", edgecolor="grey", label="not used"),
    ]
    figure.legend(handles=marks, loc="outside upper right", ncols=3, fontsize=9, frameon=False)
    stream = io.BytesIO()
    figure.savefig(stream, format=form, dpi=120)
    return stream.getvalue()


def by_record(study: Study) -> tuple[tuple[Recording, ...], ...]:
    """Return the recordings of a study, those together that are of one record of a file."""
    found: dict[tuple[str, str], list[Recording]] = {}
    for one in sorted((*study.train.recordings, *study.test.recordings), key=lambda r: r.number):
        source = one.provenance
        found.setdefault((source.file or one.name, source.record), []).append(one)
    return tuple(tuple(some) for some in found.values())


def _stretches(study: Study) -> list[_Stretch]:
    """Each record once, in the order of the study, though several entries may use parts of it."""
    records = by_record(study)
    total = sum(some[0].duration for some in records)
    found, start = [], 0.0
    for some in records:
        shift = start - float(some[0].t[0])
        found.append(_Stretch(recording=some[0], entries=some, shift=shift))
        start += some[0].duration + _APART * total
    return found


def _draw(axes: Axes, stretch: _Stretch, joint: int, column: int) -> None:
    """A joint's position or torque, on the tints of what its rows are used for."""
    one, shift = stretch.recording, stretch.shift
    for entry in stretch.entries:
        low, high = entry.window or (-np.inf, np.inf)
        low, high = max(low, float(one.t[0])), min(high, float(one.t[-1]))
        axes.axvspan(low + shift, high + shift, color=_USED[entry.use], alpha=_FAINT, lw=0)
        if entry.period:
            repeats = np.arange(low, high, entry.period)[1:]
            for t in repeats:
                axes.axvline(t + shift, color="grey", lw=0.6, ls=":")
    every = max(1, one.samples // _POINTS)
    x = (one.q if column == 0 else one.tau)[::every, joint]
    axes.plot(one.t[::every] + shift, x, color="black", lw=0.7)
