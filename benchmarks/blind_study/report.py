"""What is right, and what is claimed without reason, beside what is demanded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from blind_study.filters import FILTERS
from blind_study.judge import Judged
from blind_study.rate import Rate
from blind_study.table import LEAST, load, wrong_answers

NEVER_THERE = ("contact", "payload")
"""Effects that come with a recording: on a healthy robot there is none."""
STANDING_OUT = 2.0
"""Ratio from which an effect stands out of the noise."""


def print_report(folder: Path) -> None:
    """Print what the answers in a folder are worth, all together and apart."""
    console = Console(width=None if Console().is_terminal else 140, highlight=False)
    judged, skipped = load(folder)
    for reason, count in Counter(skipped).most_common():
        console.print(f"skipped: {count} x {reason}")
    if not judged:
        console.print("no answers yet")
        return
    console.print(_figures("All answers", judged))
    console.print(_apart(judged))
    console.print(wrong_answers(judged, lambda one: one.worse))


def groups(judged: list[Judged]) -> dict[str, list[Judged]]:
    """Return the answers by setting of [filter], by friction in MuJoCo, by repetition."""
    found = {f"filter {name}": [o for o in judged if o.filter == name] for name in FILTERS}
    mujoco = [one for one in judged if one.plant == "mujoco"]
    for what, is_own in _KINDS_OF_CASES.items():
        found[what] = [one for one in mujoco if is_own(one)]
    return {what: own for what, own in found.items() if own and len(own) < len(judged)}


_KINDS_OF_CASES: dict[str, Callable[[Judged], bool]] = {
    "constraint friction": lambda one: one.friction == "constraint",
    "tanh, width as stated": lambda one: one.friction == "tanh" and not one.misstated,
    "tanh, width misstated": lambda one: one.friction == "tanh" and one.misstated,
    "two joints": lambda one: one.joints == 2,
    "three to seven joints": lambda one: one.joints > 2,
}


def _apart(judged: list[Judged]) -> Table:
    """Every group of answers in a row, its figures in the order of `summary`."""
    table = Table(title="Apart", box=box.SIMPLE, title_justify="left")
    table.add_column("answers")
    for one in summary(judged):
        table.add_column(one.what, overflow="fold")
    for what, own in groups(judged).items():
        counts = [f"{sum(map(bool, o.held))}/{len(o.held)}" for o in summary(own)]
        table.add_row(f"{what} ({len(own)})", *counts)
    return table


def summary(judged: list[Judged]) -> list[Rate]:
    """Return the rates of any set of answers."""
    known = [one for one in judged if one.kind == "known" and one.ratio >= LEAST]
    clear = [one for one in known if one.ratio > STANDING_OUT]
    strange = [one for one in judged if one.kind == "foreign" and one.ratio >= LEAST]
    nothing = [one for one in judged if one.kind == "healthy"]
    both = [one for one in judged if one.kind == "two" and one.ratio >= LEAST]
    invented = {
        name: [any(name == place[0] for place in one.added) for one in nothing]
        for name in NEVER_THERE
    }
    return [
        Rate(f"first suggestion right, ratio above {LEAST:g}", [o.right for o in known], 0.93),
        Rate(
            f"first suggestion right, ratio above {STANDING_OUT:g}", [o.right for o in clear], 0.97
        ),
        Rate("truth in the set", [o.in_set for o in known], 0.96),
        Rate("both of two effects found", [o.both for o in both], 0.8),
        Rate('outside the catalogue: "none of these"', [o.rejected for o in strange], 0.9),
        Rate("false alarms on healthy robots", [o.alarm for o in nothing], 0.03, at_most=True),
        *(
            Rate(f"{name} named on healthy robots", said, 0.0, at_most=True)
            for name, said in invented.items()
        ),
        Rate("held-out error after above before", [o.worse for o in judged], 0.0, at_most=True),
        Rate("cases without an answer", [bool(o.broken) for o in judged], 0.0, at_most=True),
    ]


def _figures(title: str, judged: list[Judged]) -> Table:
    table = Table(title=f"{title} ({len(judged)})", box=box.SIMPLE, title_justify="left")
    for column in ("figure", "found", "95 % interval", "demanded", "met"):
        table.add_column(column, overflow="fold")
    for one in summary(judged):
        table.add_row(*one.row())
    table.add_row("processor time, median", f"{np.median([o.cpu_s for o in judged]):.1f} s")
    return table
