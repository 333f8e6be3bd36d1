"""The confusion matrix, and the rates with their intervals beside what is demanded."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from scipy import stats

from blind_study import record
from blind_study.judge import Judged, judge
from blind_study.rate import Rate
from blind_study.robots import MANY, TWO
from dynident.diagnosis.track_record import LARGE, track_record

LEAST = 0.7
"""Ratio below which an effect need not be found."""


def show(folder: Path) -> None:
    """Print what the answers in a folder are worth."""
    console = Console(width=None if Console().is_terminal else 140, highlight=False)
    judged, skipped = load(folder)
    for reason, count in Counter(skipped).most_common():
        console.print(f"skipped: {count} x {reason}")
    if not judged:
        console.print("no answers yet")
        return
    console.print(confusion(judged))
    console.print(_figures(judged))
    console.print(_effects(judged))
    console.print(_times(judged))
    console.print(_records(judged))
    console.print(wrong_answers(judged))


def load(folder: Path) -> tuple[list[Judged], list[str]]:
    """Read answers and truths; and why cases were skipped."""
    judged: dict[str, Judged] = {}
    skipped: dict[str, str] = {}
    path = folder / "answers.jsonl"
    for line in path.read_text().splitlines() if path.exists() else ():
        said = json.loads(line)
        name = said["name"]
        if "skipped" in said:
            skipped[name] = said["skipped"]
            continue
        skipped.pop(name, None)
        truth = json.loads((folder / "truth" / f"{said.get('case', name)}.json").read_text())
        judged[name] = judge(truth, said)
    return [judged[name] for name in sorted(judged)], list(skipped.values())


def confusion(judged: list[Judged]) -> Table:
    """Count what is suggested first for each hidden effect."""
    rows: dict[str, Counter[str]] = {}
    for one in judged:
        if one.kind in ("two", "absorbed"):
            continue
        hidden = one.truth[0][0] if one.truth else "nothing"
        rows.setdefault(hidden, Counter())[_answer(one)] += 1
    table = _table("Hidden, and what is suggested first (how often)", "hidden", "cases", "answers")
    for hidden in sorted(rows):
        counts = rows[hidden]
        answers = ", ".join(f"{answer} {count}" for answer, count in counts.most_common())
        table.add_row(hidden, str(counts.total()), answers)
    return table


def _answer(one: Judged) -> str:
    if one.first is None:
        return "none of these" if one.verdict == "unexplained" else one.verdict.replace("_", " ")
    elsewhere = bool(one.truth) and one.first[0] == one.truth[0][0] and not one.exact
    mark = " elsewhere" if elsewhere else ""
    return one.first[0] + mark + (" (in part)" if one.verdict == "unexplained" else "")


def figures(judged: list[Judged]) -> list[Rate]:
    """The rates of the study."""
    of = {k: [j for j in judged if j.kind == k] for k in {j.kind for j in judged}}
    known, healthy = of.get("known", []), of.get("healthy", [])
    shown = [j for j in known if j.ratio >= LEAST]
    two_link = [j for j in shown if j.joints == TWO]
    soft = [j for j in shown if j.truth[0][0] in ("joint_elasticity", "backlash")]
    many = [j for j in shown if j.joints in MANY and j.ratio > 2]
    right = [j for j in shown if j.right and j.over_floor is not None]
    both = [j for j in of.get("two", []) if j.ratio >= LEAST]
    foreign = [j for j in of.get("foreign", []) if j.ratio >= 2]
    weak = [j for j in of.get("foreign", []) if LEAST <= j.ratio < 2]
    near = [j for j in right if j.truth[0][0] not in ("joint_elasticity", "backlash")]
    soft_right = [j for j in soft if j.right and j.over_floor is not None]

    def first(cases: list[Judged], low: float, high: float) -> list[bool]:
        return [j.right for j in cases if low <= j.ratio < high]

    return [
        Rate("two joints: right first suggestion, ratio 0.7 to 2", first(two_link, LEAST, 2), 0.90),
        Rate("two joints: right first suggestion, ratio above 2", first(two_link, 2, np.inf), 0.95),
        Rate("all robots: right first suggestion, ratio 0.7 to 2", first(shown, LEAST, 2), 0.90),
        Rate("all robots: right first suggestion, ratio above 2", first(shown, 2, np.inf), 0.95),
        Rate("right effect in the first three", [j.in_three for j in shown], 0.97),
        Rate("truth in the indistinguishable set", [j.in_set for j in shown], 0.95),
        Rate("false alarms on healthy robots", [j.alarm for j in healthy], 0.05, at_most=True),
        Rate(
            "  of these, with the width of friction as stated",
            [j.alarm for j in healthy if not j.misstated],
            0.05,
            at_most=True,
        ),
        Rate(
            'outside the catalogue, "none of these", ratio above 2',
            [j.rejected for j in foreign],
            0.85,
        ),
        Rate('outside the catalogue, "none of these", 0.7 to 2', [j.rejected for j in weak], 0.85),
        Rate(
            'false "none of these" on known effects',
            [j.verdict == "unexplained" for j in known],
            0.05,
            at_most=True,
        ),
        Rate("right effect: held-out error within 1.15 of the floor", _within(near, 1.15), 0.95),
        Rate("elasticity, backlash: right first suggestion", [j.right for j in soft], 0.85),
        Rate("elasticity, backlash: held-out error within 1.2", _within(soft_right, 1.2), 0.95),
        Rate("both of two effects found", [j.both for j in both], 0.80),
        Rate(
            "effects that are not identifiable reported as such",
            [j.absorbed for j in of.get("absorbed", [])],
            1.0,
        ),
        Rate("six, seven joints: right first, ratio above 2", [j.right for j in many], 0.90),
        Rate("cases without an answer", [bool(j.broken) for j in judged], 0.0, at_most=True),
    ]


def _within(cases: list[Judged], most: float) -> list[bool]:
    return [(j.over_floor or np.inf) <= most for j in cases]


def _figures(judged: list[Judged]) -> Table:
    table = _table("Figures", "figure", "found", "95 % interval", "demanded", "met")
    for one in figures(judged):
        table.add_row(*one.row())
    shown = [j for j in judged if j.kind == "known" and j.ratio >= LEAST and j.size]
    if shown:
        size = float(np.mean([j.size for j in shown]))
        table.add_row(
            "mean size of that set", f"{size:.2f}", "", "at most 2", "yes" if size <= 2 else "NO"
        )
    if shown:
        more = sum(len(j.added) > 1 for j in shown)
        table.add_row("one hidden, more than one added", f"{more}/{len(shown)}", "", "", "")
    over = [j.over_floor for j in shown if j.right and j.over_floor is not None]
    if over:
        middle, high = np.quantile(over, [0.5, 0.95])
        table.add_row(
            "held-out error over the floor: median", f"{middle:.3f}", "", "at most 1.15", ""
        )
        table.add_row("  95 % of the cases lie below", f"{high:.3f}", "", "", "")
    return table


def _effects(judged: list[Judged]) -> Table:
    """Each effect by itself, at ratios at which it must be found."""
    table = _table(
        f"Known effects, ratio {LEAST:g} and above",
        "effect",
        "cases",
        "right",
        "in three",
        "mean set",
        "median error over floor",
        "none of these",
    )
    shown = [j for j in judged if j.kind == "known" and j.ratio >= LEAST]
    for name in sorted({j.truth[0][0] for j in shown}):
        own = [j for j in shown if j.truth[0][0] == name]
        over = [j.over_floor for j in own if j.over_floor is not None]
        sizes = [j.size for j in own if j.size]
        table.add_row(
            name,
            str(len(own)),
            str(sum(j.right for j in own)),
            str(sum(j.in_three for j in own)),
            f"{np.mean(sizes):.1f}" if sizes else "",
            f"{np.median(over):.3f}" if over else "",
            str(sum(j.verdict == "unexplained" for j in own)),
        )
    return table


def _times(judged: list[Judged]) -> Table:
    table = _table(
        "Processor time of explain, s", "robots", "cases", "median", "largest", "demanded"
    )
    for what, joints, demanded in (("two joints", (TWO,), 5), ("six or seven joints", MANY, 40)):
        times = [j.cpu_s for j in judged if j.joints in joints]
        if times:
            table.add_row(
                what, str(len(times)), f"{np.median(times):.1f}", f"{max(times):.1f}", str(demanded)
            )
    return table


def _records(judged: list[Judged]) -> Table:
    """How often answers of each kind were right, beside what the tool says of them."""
    table = _table(
        "Answers by kind, and how many were right",
        "answer",
        "error without it",
        "right here",
        "95 % interval",
        "what the tool says",
    )
    for (said, size), (right, cases) in record.counts(judged).items():
        over = LARGE + 0.1 if size == "large" else 1.0
        verdict = "unexplained" if said in ("in_part", "none_of_these") else said
        told = track_record(verdict, effects=int(said in ("in_part", "explained")), over_floor=over)
        interval = stats.binomtest(right, cases).proportion_ci(method="wilson")
        table.add_row(
            said.replace("_", " "),
            f"{'at least' if size == 'large' else 'below'} {LARGE:g} times the floor",
            f"{right}/{cases}",
            f"{interval.low:.3f} .. {interval.high:.3f}",
            f"{told.right}/{told.cases}" if told else "nothing",
        )
    return table


def wrong_answers(
    judged: list[Judged], besides: Callable[[Judged], bool] = lambda one: False
) -> Table:
    """List the answers that are wrong, and those of which `besides` holds."""
    table = _table("What went wrong", "case", "kind", "joints", "hidden", "ratio", "answer")
    for one in judged:
        if not _wrong(one) and not besides(one):
            continue
        hidden = ", ".join(map(_label, one.truth)) or "nothing"
        added = ", ".join(map(_label, one.added)) or "nothing"
        said = one.broken or f"{one.verdict.replace('_', ' ')}: {added}"
        hidden += f" ({_friction(one)})" if one.misstated else ""
        table.add_row(one.name, one.kind, str(one.joints), hidden, f"{one.ratio:.2f}", said)
    return table


def _friction(one: Judged) -> str:
    return "constraint friction" if one.friction == "constraint" else "width misstated"


def _wrong(one: Judged) -> bool:
    if one.broken:
        return True
    if one.kind == "healthy":
        return one.alarm
    if one.kind == "absorbed":
        return not one.absorbed
    if one.ratio < LEAST:
        return one.verdict == "unexplained" and one.kind == "known"
    if one.kind == "foreign":
        return not one.rejected
    return not (one.both if one.kind == "two" else one.right)


def _label(place) -> str:
    effect, joint, source = place
    return effect + (f"@{joint}" if joint else "") + (f":{source}" if source else "")


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, box=box.SIMPLE, title_justify="left")
    for column in columns:
        table.add_column(column, overflow="fold")
    return table
