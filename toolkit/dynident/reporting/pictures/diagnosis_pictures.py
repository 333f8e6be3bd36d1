"""Plotly pictures of a diagnosis, for the page."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from dynident.diagnosis.details import Trace
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.result import Diagnosis
from dynident.evidence.maps import ResidualMap
from dynident.reporting.content import (
    AFTER_COLOUR,
    BAND,
    BEFORE_COLOUR,
    GIVEN,
    GREY,
    LABEL,
    Bar,
    after_name,
    bars,
    first_set,
    is_spectrum,
    noise_of,
    ranked,
    thinned,
    wrapped,
    x_title,
    y_title,
)
from dynident.reporting.pictures.look import (
    FAINT,
    dressed,
    mark,
    named_rows,
    plain,
    single_precision,
)

_LONG = 0.58
"""Share of the width from which on a bar has its number inside."""


def waterfall(diagnosis: Diagnosis) -> go.Figure:
    """Held-out torque error as effects are added, down to the noise floor."""
    rows = bars(diagnosis)
    floor = diagnosis.test_error.noise_floor
    line_at = 100 * (floor or 0.0)
    top = max(*(max(row.start, row.stop) for row in rows), line_at, 1e-9)
    width = 1.3 * top
    colours = {"given": BEFORE_COLOUR, "added": "rgba(31,127,196,0.45)", "final": AFTER_COLOUR}
    figure = go.Figure(
        go.Bar(
            orientation="h",
            y=list(range(len(rows))),
            base=[row.start for row in rows],
            x=[row.stop - row.start for row in rows],
            marker={
                "color": [colours[row.kind] for row in rows],
                "line": {"color": AFTER_COLOUR, "width": [row.kind == "added" for row in rows]},
                "pattern": {"shape": ["/" if row.kind == "added" else "" for row in rows]},
            },
            text=[f"\u2002{row.text}\u2002" for row in rows],
            textposition=[_text_place(row, line_at, width) for row in rows],
            insidetextanchor="end",
            insidetextfont={"color": "#000"},
            textangle=0,
            cliponaxis=False,
            customdata=[[row.start, row.stop] for row in rows],
            hovertemplate="%{customdata[0]:.3f} % to %{customdata[1]:.3f} %<extra></extra>",
            showlegend=False,
        )
    )
    for i in range(len(rows) - 1):
        level = rows[i].stop if rows[i].kind == "given" else rows[i].start
        line = {"color": GREY, "width": 1, "dash": "dot"}
        figure.add_shape(type="line", x0=level, x1=level, y0=i, y1=i + 1, line=line, layer="below")
    for i, row in enumerate(rows):
        if row.text_from(line_at, width) == line_at:
            place = {"x": line_at, "xanchor": "left", "xshift": 6}
            figure.add_annotation(text=row.text, y=i, showarrow=False, **place)
    if floor is None:
        head = "noise floor unknown"
        place = {"x": 0, "xanchor": "left"}
    else:
        head = f"noise floor {100 * floor:.2f} %"
        # Where there is room beside the line.
        side, shift = ("right", -4) if 2 * floor > diagnosis.test_error.before else ("left", 4)
        place = {"x": line_at, "xanchor": side, "xshift": shift}
        figure.add_vrect(x0=0, x1=line_at, fillcolor=FAINT, line_width=0, layer="below").add_vline(
            x=line_at, line={"color": GREY, "width": 2, "dash": "dash"}
        )
    figure.add_annotation(text=head, y=1, yref="paper", yanchor="bottom", showarrow=False, **place)
    ticks = ["<br>".join(plain(line) for line in row.lines) for row in rows]
    figure.update_xaxes(title="held-out torque error (%)", range=[0, width], fixedrange=True)
    figure.update_yaxes(named_rows(ticks))
    height = 86 + sum(18 + 15 * len(row.lines) for row in rows)
    return dressed(figure, height, top=28)


def _text_place(row: Bar, floor: float, width: float) -> str:
    """Inside a bar that is long, where no line of the floor crosses it there: a phone is narrow."""
    if row.text_from(floor, width) == floor:
        return "none"  # written behind the line
    inside = row.kind != "added" and row.stop > _LONG * width
    return "inside" if inside and not row.stop - LABEL * width < floor else "outside"


def ranking(diagnosis: Diagnosis, most: int = 10) -> go.Figure:
    """Candidates by how far each alone brings the held-out error down, in the search's order.

    Those that were not tried so are not drawn. Those that the data cannot tell apart from the first
    effect added are bracketed.
    """
    drawn = [(c, 100 * c.test_gain) for c in ranked(diagnosis, most) if c.test_gain is not None]
    shown, gains = [c for c, _ in drawn], [gain for _, gain in drawn]
    figure = go.Figure()
    for status, name, symbol in (
        ("material", "significant and relevant", "circle"),
        ("not_material", "not significant or not relevant", "circle-open"),
    ):
        rows = [i for i, c in enumerate(shown) if c.status == status]
        colour = AFTER_COLOUR if status == "material" else GREY
        figure.add_trace(
            go.Scatter(
                x=[gains[i] for i in rows],
                y=rows,
                mode="markers",
                name=name,
                marker=mark(colour, symbol),
                hovertemplate="%{x:.3f} points<extra></extra>",
                showlegend=bool(rows),
            )
        )
        for i in rows:
            stem = {"color": colour, "width": 2}
            figure.add_shape(type="line", x0=0, x1=gains[i], y0=i, y1=i, line=stem, layer="below")
    members = [i for i, c in enumerate(shown) if c.effect.label in first_set(diagnosis)]
    if len(members) > 1:
        _bracket(figure, members)
    title = "gain alone (points)"
    figure.update_xaxes(title=title, zeroline=True, fixedrange=True)
    figure.update_yaxes(
        tickvals=list(range(len(shown))),
        ticktext=["<br>".join(plain(line) for line in wrapped(c.effect.title)) for c in shown],
        range=[len(shown) - 0.4, -0.6],
        automargin=True,
        fixedrange=True,
        zeroline=False,
        ticklabelstandoff=6,
    )
    return dressed(figure, 110 + 36 * max(len(shown), 1), right=60 if len(members) > 1 else 16)


def residual_map(diagnosis: Diagnosis, one: ResidualMap) -> go.Figure:
    """Mean residual against one quantity, before and after, with the noise band."""
    y = {"title": {"text": y_title(one)}, **_map_zero(one)}
    layout = {"xaxis": {"title": {"text": x_title(one)}}, "yaxis": y, "dragmode": False}
    return dressed(go.Figure(_map_traces(diagnosis, one), layout), 300, top=22)


def law_picture(proposal: Proposal) -> go.Figure:
    """What the model leaves against what a proposed law says, with the noise band.

    Parameters
    ----------
    proposal : with its picture.
    """
    one = proposal.picture
    assert one is not None
    x, unit = single_precision(one.law), one.torque_unit
    figure = go.Figure()
    if np.isfinite(one.band).all():
        edge = np.concatenate([one.law + one.band, (one.law - one.band)[::-1]])
        figure.add_trace(noise_band(np.concatenate([one.law, one.law[::-1]]), edge, BAND))
    line = {"color": AFTER_COLOUR, "width": 2}
    figure.add_trace(go.Scatter(x=x, y=x, mode="lines", line=line, name=plain("the law")))
    figure.add_trace(
        go.Scatter(
            x=x,
            y=single_precision(one.residual),
            mode="markers",
            name="left by the model",
            marker=mark(BEFORE_COLOUR, "circle-open"),
            hovertemplate="%{x:.4g}: %{y:.4g}<extra></extra>",
        )
    )
    figure.update_xaxes(title=f"torque of the law ({unit})", fixedrange=True)
    figure.update_yaxes(title=f"mean residual ({unit})", zeroline=True, fixedrange=True)
    return dressed(figure, 340, top=22)


def measured_and_predicted(diagnosis: Diagnosis, trace: Trace, points: int = 4000) -> go.Figure:
    """Torque of a joint in a test recording, measured and predicted, and the residuals below.

    Parameters
    ----------
    diagnosis : for the names of its models and the noise.
    trace : one of `Diagnosis.traces`.
    points : about how many samples are drawn; the extremes are kept.

    Returns
    -------
    Figure of two rows.
    """
    kept = thinned(trace, points)
    t, measured = single_precision(trace.t[kept]), trace.measured[kept]
    models = [(GIVEN, trace.before[kept], BEFORE_COLOUR, "dash")]
    if diagnosis.steps:
        models.append((after_name(diagnosis), trace.after[kept], AFTER_COLOUR, "solid"))
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.6, 0.4], vertical_spacing=0.06
    )
    line = {"color": GREY, "width": 3}
    figure.add_trace(
        go.Scatter(x=t, y=single_precision(measured), name="measured", line=line), row=1, col=1
    )
    noise = noise_of(diagnosis, trace.joint)
    if noise is not None:
        ends = np.array([t[0], t[-1], t[-1], t[0]])
        edge = 2 * noise * np.array([1, 1, -1, -1])
        figure.add_trace(noise_band(ends, edge, f"{BAND} (2 rms)"), row=2, col=1)
    for name, predicted, colour, dash in models:
        line = {"color": colour, "width": 1.8, "dash": dash}
        group = {"name": plain(name), "legendgroup": name}
        figure.add_trace(
            go.Scatter(x=t, y=single_precision(predicted), line=line, **group), row=1, col=1
        )
        line = {"color": colour, "width": 1.2}
        left = single_precision(measured - predicted)
        figure.add_trace(
            go.Scatter(x=t, y=left, line=line, showlegend=False, **group), row=2, col=1
        )
    figure.update_traces(selector={"type": "scatter", "fill": None}, mode="lines")
    figure.update_xaxes(title="time (s)", row=2, col=1)
    figure.update_yaxes(title=f"torque ({trace.torque_unit})", row=1, col=1)
    figure.update_yaxes(title=f"residual ({trace.torque_unit})", row=2, col=1)
    # Below, where the buttons do not cover it.
    return dressed(figure, 580, top=34).update_layout(legend={"y": -0.13, "yanchor": "top"})


def _map_traces(diagnosis: Diagnosis, one: ResidualMap) -> list[go.Scatter]:
    at = np.asarray(one.at, dtype=float)
    mode = "lines" if is_spectrum(one) else "lines+markers"
    traces = []
    known = np.isfinite(one.band)
    if known.any():
        edge = np.asarray(one.band, dtype=float)[known]
        lower = np.zeros_like(edge) if is_spectrum(one) else -edge
        x = np.concatenate([at[known], at[known][::-1]])
        traces.append(noise_band(x, np.concatenate([edge, lower[::-1]]), BAND))
    drawn = [(GIVEN, one.before, BEFORE_COLOUR, "circle-open")]
    if diagnosis.steps:
        drawn.append((after_name(diagnosis), one.after, AFTER_COLOUR, "diamond"))
    for name, values, colour, symbol in drawn:
        traces.append(
            go.Scatter(
                x=at,
                y=np.asarray(values, dtype=float),
                mode=mode,
                name=plain(name),
                line={"color": colour, "width": 2},
                marker={"symbol": symbol, "size": 6},
                hovertemplate="%{x:.4g}: %{y:.4g}<extra></extra>",
            )
        )
    return traces


def _map_zero(one: ResidualMap) -> dict:
    return {"rangemode": "tozero"} if is_spectrum(one) else {"zeroline": True}


def noise_band(x: np.ndarray, y: np.ndarray, name: str) -> go.Scatter:
    """Return the band in which noise alone would lie, as a filled outline.

    Parameters
    ----------
    x, y : (k,) of the outline.
    name : in the legend.

    Returns
    -------
    A trace without a line.
    """
    return go.Scatter(
        x=x,
        y=y,
        fill="toself",
        fillcolor=FAINT,
        mode="lines",
        line={"width": 0},
        hoverinfo="skip",
        name=name,
    )


def _bracket(figure: go.Figure, members: list[int]) -> None:
    # In pixels from the right edge of the plot, so that it is the same on any screen.
    pixels = {
        "type": "line",
        "xref": "paper",
        "xanchor": 1,
        "xsizemode": "pixel",
        "line": {"color": GREY, "width": 2},
    }
    figure.add_shape(x0=14, x1=14, y0=members[0], y1=members[-1], **pixels)
    for i in members:
        figure.add_shape(x0=6, x1=14, y0=i, y1=i, **pixels)
    figure.add_annotation(
        text="cannot be<br>told apart",
        textangle=90,
        x=1,
        xref="paper",
        xanchor="left",
        xshift=16,
        y=(members[0] + members[-1]) / 2,
        showarrow=False,
    )
