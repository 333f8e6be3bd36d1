"""Plotly pictures of a simulated loop, for the page."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from dynident.reporting.content import AFTER_COLOUR, GREY
from dynident.reporting.loop_content import (
    MEASURED,
    REFERENCE_COLOUR,
    SIMULATED,
    LoopTrace,
)
from dynident.reporting.pictures.look import FAINT, look, plain

_NOISE = "noise (2 rms)"


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
