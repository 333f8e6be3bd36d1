"""Pictures and the HTML report: the only room that imports plotting libraries.

`html.report` writes the page, `pictures` draws with plotly (notebooks, the page), `plots` with
matplotlib (static pictures).
"""

from __future__ import annotations

from dynident.reporting.html import report

__all__ = ["report"]
