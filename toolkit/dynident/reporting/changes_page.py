"""Two estimates of one robot as a page: what has changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from dynident import files
from dynident.fitting.comparing.changed_parameters import LEVEL, EstimateChanges
from dynident.reporting.content import AFTER_COLOUR, GREY
from dynident.reporting.diagnosis_tables import versions
from dynident.reporting.html import rendered
from dynident.reporting.packing import packed
from dynident.reporting.pictures.look import FAINT, dressed, mark, plain
from dynident.tables import Table

_MOST = 20
"""Parameters that are drawn, the surest changes first; the table has all of them."""


def changes_report(
    changes: EstimateChanges,
    to: str | Path,
    *,
    robot: str,
    errors: Sequence[Table | str] = (),
    command: str = "",
) -> Path:
    """Write what has changed between two estimates as one self-contained HTML file.

    Parameters
    ----------
    changes : between them.
    to : the file to write.
    robot : its name.
    errors : what held-out data say of both; may be empty.
    command : the command line, for the provenance.

    Returns
    -------
    Path of the file.

    Raises
    ------
    FileError
        If the folder is missing or may not be written.
    """
    mark_, colour = (
        ("!", "unexplained") if changes.p_value < LEVEL else ("\u2713", "nothing_missing")
    )
    text = rendered(
        "changes.html",
        changes=changes,
        robot=robot,
        mark=mark_,
        colour=colour,
        errors=errors,
        drawn=min(_MOST, len(changes.parameters)),
        made=versions(command),
        packed=packed({"changes": changes_figure(changes)}),
        data="",
    )
    return files.write_text(to, text)


def changes_figure(changes: EstimateChanges) -> go.Figure:
    """Each change over its standard deviation; those beyond the joint uncertainty are filled."""
    shown = changes.parameters[:_MOST]
    figure = go.Figure()
    for changed, name, symbol, colour in (
        (True, "changed", "circle", AFTER_COLOUR),
        (False, "within the uncertainty", "circle-open", GREY),
    ):
        rows = [i for i, one in enumerate(shown) if one.has_changed == changed]
        figure.add_trace(
            go.Scatter(
                x=[shown[i].z for i in rows],
                y=rows,
                mode="markers",
                name=name,
                marker=mark(colour, symbol),
                hovertemplate="%{x:.3g} standard deviations<extra></extra>",
                showlegend=bool(rows),
            )
        )
    figure.add_vrect(x0=-1.96, x1=1.96, fillcolor=FAINT, line_width=0, layer="below")
    reach = 1.15 * max([3.0, *(abs(float(np.nan_to_num(one.z))) for one in shown)])
    figure.update_xaxes(
        title="change (standard deviations)", range=[-reach, reach], fixedrange=True
    )
    figure.update_yaxes(
        tickvals=list(range(len(shown))),
        ticktext=[plain(one.parameter) for one in shown],
        range=[len(shown) - 0.4, -0.6],
        automargin=True,
        fixedrange=True,
        zeroline=False,
    )
    return dressed(figure, 110 + 26 * max(len(shown), 1), top=34)
