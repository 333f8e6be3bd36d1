"""Plotly pictures of a simulated loop, for the report and for notebooks."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from dynident.reporting.content import AFTER_COLOUR, GREY
from dynident.reporting.loop_content import (
    MEASURED,
    REFERENCE_COLOUR,
    SIMULATED,
    LoopTrace,
    joint_of,
    loop_trace,
    run_of,
)
from dynident.reporting.pictures.look import FAINT, dressed, look, plain
from dynident.validation.loop_run import QUANTITIES, Quantity
from dynident.validation.loop_validation import Validation

_NOISE = "noise (2 rms)"


def simulated_loop(
    validation: Validation,
    joint: str,
    recording: str | None = None,
    quantities: tuple[Quantity, ...] = QUANTITIES,
    points: int = 4000,
) -> go.Figure:
    """Quantities of a joint, measured, simulated and as the reference has them; differences beside.

    Parameters
    ----------
    validation : as `validate` returns it.
    joint : name.
    recording : name; by default the first.
    quantities : "position", "velocity", "acceleration", "torque".
    points : about how many samples are drawn of each; the extremes are kept.

    Raises
    ------
    DynidentError
        If there is no such joint, or the recording's loop was not simulated.
    """
    run, j = run_of(validation, recording), joint_of(validation, joint)
    count = len(quantities)
    figure = make_subplots(
        rows=count, cols=2, shared_xaxes=True, vertical_spacing=0.05, horizontal_spacing=0.1
    )
    for row, quantity in enumerate(quantities, 1):
        trace = loop_trace(validation, run, j, quantity).thinned(points)
        for line in _signals(trace):
            # One legend for all rows; the torque's yardstick is another one.
            shown = row == 1 or line["name"] not in (MEASURED, SIMULATED, "reference")
            figure.add_trace({**line, "showlegend": shown}, row=row, col=1)
        for line in _differences(trace):
            figure.add_trace({**line, "showlegend": False}, row=row, col=2)
        figure.update_yaxes(title=f"{quantity} ({trace.unit})", row=row, col=1)
        figure.update_yaxes(title=f"difference ({trace.unit})", row=row, col=2)
    figure.update_xaxes(title="time (s)", row=count)
    return dressed(figure, 90 + 190 * count, top=40)


def loop_quantity(trace: LoopTrace) -> go.Figure:
    """One quantity of one joint: the signals, and below them the differences."""
    below = [
        {**line, "yaxis": "y2", "showlegend": line["name"] == _NOISE}
        for line in _differences(trace)
    ]
    # Made at once, not subplot by subplot: a page has many of them.
    layout = {
        "xaxis": {"anchor": "y2", "title": {"text": "time (s)"}},
        "yaxis": {"domain": [0.45, 1.0], "title": {"text": f"{trace.quantity} ({trace.unit})"}},
        "yaxis2": {"domain": [0.0, 0.38], "title": {"text": f"difference ({trace.unit})"}},
        "legend": {"y": -0.16, "yanchor": "top"},
        **look(430, top=34),
    }
    return go.Figure([*_signals(trace), *below], layout)


def _signals(trace: LoopTrace) -> list[dict]:
    drawn = (
        (MEASURED, trace.measured, {"color": GREY, "width": 3}),
        (trace.yardstick_name, trace.yardstick, {"color": REFERENCE_COLOUR, "dash": "dash"}),
        (SIMULATED, trace.simulated, {"color": AFTER_COLOUR, "width": 1.6}),
    )
    return [_line(trace, name, values, line) for name, values, line in drawn]


def _differences(trace: LoopTrace) -> list[dict]:
    drawn = (
        (trace.yardstick_name, trace.yardstick, {"color": REFERENCE_COLOUR, "dash": "dash"}),
        (SIMULATED, trace.simulated, {"color": AFTER_COLOUR, "width": 1.3}),
    )
    found = [_line(trace, name, trace.measured - values, line) for name, values, line in drawn]
    if trace.noise is None:
        return found
    ends = _small(trace.t[[0, -1, -1, 0]])
    edge = 2 * trace.noise * np.array([1, 1, -1, -1])
    band = {
        "type": "scatter",
        "x": ends,
        "y": edge,
        "fill": "toself",
        "fillcolor": FAINT,
        "mode": "lines",
        "line": {"width": 0},
        "hoverinfo": "skip",
        "name": _NOISE,
    }
    return [band, *found]


def _line(trace: LoopTrace, name: str, values: np.ndarray, line: dict) -> dict:
    return {
        "type": "scatter",
        "x": _small(trace.t),
        "y": _small(values),
        "mode": "lines",
        "name": plain(name),
        "legendgroup": name,
        "line": {"width": 1.5, **line},
        "hovertemplate": "%{x:.4g} s: %{y:.5g}",
    }


def _small(values: np.ndarray) -> np.ndarray:
    # Single precision is finer than any screen, and halves the page.
    return np.asarray(values, dtype=np.float32)
