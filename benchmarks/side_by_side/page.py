"""The page of results, in Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from side_by_side.line import Line, from_json, ratios

HEAD = """# Benchmarks

Made by `make bench`; a part of it anew by `python benchmarks/run.py NAME`. Each line is the package
or what one would use instead, on the same work in the same run: one thread, seconds of the
processor (user and system) unless it says otherwise. *Times ours* is a line's figure over the first
line of the package in the same case: above 1 the package needs less.

![Times and memory against the size of the work](benchmarks.png)
"""


def page(found: Mapping[str, Any]) -> str:
    """The whole page, from what `running` keeps."""
    machine = found["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    parts = [
        HEAD,
        f"{machine['processor']}, {machine['processors']} processors; {machine['system']}.\n"
        f"{versions}.\n",
    ]
    parts += [_section(name, one) for name, one in found["sections"].items()]
    return "\n".join(parts)


def _section(name: str, one: Mapping[str, Any]) -> str:
    run = one["run"]
    words = f"{run['date']}, {run['seconds']} s, load before it {run['load']:g}"
    size = "" if run["size"] == "full" else f", {run['size']} size: not to be quoted"
    lines = [from_json(line) for line in one["lines"]]
    return "\n".join(
        [
            f"## {one['title']}\n",
            f"{one['work']} (`{name}`; {words}{size}.)\n",
            _table(lines, one["compared"]),
        ]
    )


def _table(lines: list[Line], compared: str) -> str:
    columns = list(dict.fromkeys(name for line in lines for name in line.figures))
    head = ["work", "by", *columns]
    if compared:
        place = head.index(compared) + 1 if compared in head else len(head)
        head.insert(place, "times ours")
    rows, before = [], None
    for line, ratio in zip(lines, ratios(lines, compared), strict=True):
        cells = {name: number(value) for name, value in line.figures.items()}
        cells["times ours"] = "" if ratio is None else number(ratio)
        who = f"**{line.who}**" if line.is_ours else line.who
        if line.missing:
            who += f": {_plain(line.missing)}"
        case = "" if line.case == before else _plain(line.case)
        rows.append([case, who, *(cells.get(name, "") for name in head[2:])])
        before = line.case
    marks = ["---", "---", *["---:"] * (len(head) - 2)]
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, marks, *rows]) + "\n"


def number(value: float) -> str:
    """Three digits, as one writes them."""
    if not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e6:
        digits = max(0, 2 - math.floor(math.log10(abs(value))))
        return f"{value:.{digits}f}" if digits else f"{float(f'{value:.3g}'):.0f}"
    return f"{value:.1e}"


def _plain(text: str) -> str:
    return " ".join(text.replace("|", "/").split())
