"""One look for all plotly pictures, on light and dark pages."""

from __future__ import annotations

from html import escape

import numpy as np
import plotly.graph_objects as go

from dynident.reporting.content import AFTER_COLOUR, GREY

FAINT = "rgba(128,128,128,0.25)"
_AXIS = {
    "gridcolor": FAINT,
    "zerolinecolor": "rgba(128,128,128,0.7)",
    "title": {"standoff": 8, "font": {"size": 13}},
}
_LOOK = go.layout.Template(
    layout={
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        "font": {"size": 13},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": GREY, "activecolor": AFTER_COLOUR},
    }
)


def plain(words: str) -> str:
    """Words that plotly shows as they are: it reads tags, and mathematics between dollar signs."""
    return escape(words).replace("$", "&#36;")


def mark(colour: str, symbol: str) -> dict:
    """A mark for one value; the outline has its colour, so that open and full ones match."""
    return {"color": colour, "symbol": symbol, "size": 11, "line": {"width": 2, "color": colour}}


def look(height: int, top: int = 10, right: int = 16) -> dict:
    """The package's look, as settings of a layout.

    Parameters
    ----------
    height, top, right : of the picture and of its margins, pixels; the width is the screen's.

    Returns
    -------
    Settings for `plotly.graph_objects.Layout`.
    """
    margin = {"l": 62, "r": right, "t": top, "b": 46}
    return {"template": _LOOK, "height": height, "margin": margin}


def named_rows(names: list[str]) -> dict:
    """Settings of a vertical axis with a name for each row, the first one on top."""
    return {
        "tickvals": list(range(len(names))),
        "ticktext": names,
        "range": [len(names) - 0.4, -0.6],
        "automargin": True,
        "fixedrange": True,
        "showgrid": False,
        "zeroline": False,
        "ticklabelstandoff": 6,
    }


def dressed(figure: go.Figure, height: int, top: int = 10, right: int = 16) -> go.Figure:
    """Give a figure the package's `look`, and return it.

    Parameters
    ----------
    figure : is changed.
    height, top, right : as in `look`.

    Returns
    -------
    The figure.
    """
    return figure.update_layout(**look(height, top, right))


def single_precision(values: np.ndarray) -> np.ndarray:
    """Values as a page has them: single precision is finer than any screen, and half the bytes."""
    return np.asarray(values, dtype=np.float32)
