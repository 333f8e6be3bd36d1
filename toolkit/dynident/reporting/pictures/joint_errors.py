"""The torque error of each joint, before and after, over the noise floor."""

from __future__ import annotations

import plotly.graph_objects as go

from dynident.diagnosis.result import Diagnosis
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GIVEN, GREY, after_name
from dynident.reporting.pictures.look import dressed, mark, named_rows, plain


def joint_errors(diagnosis: Diagnosis) -> go.Figure:
    """Torque error of each joint, as given and with the effects added, over the noise floor."""
    joints = diagnosis.joints
    rows = list(range(len(joints)))
    figure = go.Figure()
    if any(joint.noise_share is not None for joint in joints):
        figure.add_trace(
            go.Bar(
                orientation="h",
                y=rows,
                x=[None if j.noise_share is None else 100 * j.noise_share for j in joints],
                width=0.7,
                name="noise",
                marker={"color": "rgba(128,128,128,0.4)"},
                hovertemplate="noise %{x:.3f} %<extra></extra>",
            )
        )
    drawn = [(GIVEN, [100 * j.error_before for j in joints], BEFORE_COLOUR, "circle-open")]
    if diagnosis.steps:
        after = [100 * j.error_after for j in joints]
        drawn.append((after_name(diagnosis), after, AFTER_COLOUR, "diamond"))
        for row, start, stop in zip(rows, drawn[0][1], after, strict=True):
            way = {"color": GREY, "width": 1, "dash": "dot"}
            figure.add_shape(
                type="line", x0=start, x1=stop, y0=row, y1=row, line=way, layer="below"
            )
    for name, errors, colour, symbol in drawn:
        figure.add_trace(
            go.Scatter(
                x=errors,
                y=rows,
                mode="markers",
                name=plain(name),
                marker=mark(colour, symbol),
                hovertemplate="%{x:.3f} %<extra></extra>",
                showlegend=True,
            )
        )
    figure.update_xaxes(title="held-out torque error (%)", rangemode="tozero", fixedrange=True)
    figure.update_yaxes(named_rows([plain(joint.name) for joint in joints]))
    # The page has one legend for this picture and for the maps.
    return dressed(figure, 76 + 34 * len(rows)).update_layout(showlegend=False)
