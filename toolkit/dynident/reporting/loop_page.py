"""The section of the report on the simulated loop: its words, tables and plotly pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from dynident.reporting.content import AFTER_COLOUR, GREY
from dynident.reporting.loop_content import (
    MEASURED,
    REFERENCE_COLOUR,
    SIMULATED,
    LoopTrace,
    loop_trace,
)
from dynident.reporting.pictures.look import FAINT, look, plain, single_precision
from dynident.tables import Table
from dynident.validation.loop_errors import QUANTITIES, Quantity
from dynident.validation.validation_result import Unsimulated, Validation

_BYTES = 450_000
"""What all pictures together may take in the page."""
_BYTES_PER_POINT = 32
"""Five lines over one time, in single precision and base 64."""
_MOST_PICTURED = 8
"""Joints times recordings that have pictures."""
_NOISE = "noise (2 rms)"


@dataclass(frozen=True, kw_only=True)
class LoopSection:
    """What the section shows.

    Attributes
    ----------
    failure : why there is nothing to show; empty where there is.
    opening, sentence : what was done, and what came of it, in words.
    first, rest : tables before the pictures, tables and sentences after them.
    pictures : joint and recording of each set of pictures.
    left_out : recordings without pictures.
    figures : by name.
    """

    failure: str = ""
    opening: str = ""
    sentence: str = ""
    first: tuple[Table, ...] = ()
    rest: tuple[Table | str, ...] = ()
    pictures: tuple[tuple[str, str], ...] = ()
    left_out: int = 0
    figures: tuple[tuple[str, go.Figure], ...] = ()
    quantities: tuple[Quantity, ...] = QUANTITIES


def loop_section(found: Validation | Unsimulated | None) -> LoopSection | None:
    """Return what the section on the simulated loop shows; None where there is no controller."""
    if found is None:
        return None
    if isinstance(found, Unsimulated):
        return LoopSection(failure=found.reason)
    opening = (
        "The identified robot follows each recording's reference once more, under the stated "
        "controller, and is compared with what was measured."
    )
    if not found.runs:
        rest = (found.recording_table(), *found.notes[1:])
        return LoopSection(opening=opening, sentence=found.sentence, rest=rest)
    n = len(found.joints)
    most = max(1, _MOST_PICTURED // n)
    runs = found.runs[:most]
    points = max(16, min(2500, _BYTES // _BYTES_PER_POINT // (len(QUANTITIES) * n * len(runs))))
    worst = np.argsort(-np.nan_to_num(found.errors.joints[QUANTITIES.index("torque")]))
    pairs = [(int(j), run) for run in runs for j in worst]
    figures = [
        (f"loop-{i}-{quantity}", loop_quantity(loop_trace(found, run, j, quantity).thinned(points)))
        for i, (j, run) in enumerate(pairs)
        for quantity in QUANTITIES
    ]
    tables = found.tables()
    sentence, *notes = found.notes
    return LoopSection(
        opening=opening,
        first=(found.error_table(),),
        rest=(*(part for part in tables[1:] if isinstance(part, Table)), *notes),
        sentence=sentence,
        pictures=tuple((found.joints[j], run.name) for j, run in pairs),
        left_out=len(found.runs) - len(runs),
        figures=tuple(figures),
    )


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
    ends = single_precision(trace.t[[0, -1, -1, 0]])
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
        "x": single_precision(trace.t),
        "y": single_precision(values),
        "mode": "lines",
        "name": plain(name),
        "legendgroup": name,
        "line": {"width": 1.5, **line},
        "hovertemplate": "%{x:.4g} s: %{y:.5g}",
    }
