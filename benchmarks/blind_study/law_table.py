"""The figures of the study of laws, with their intervals beside what is demanded."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from blind_study.drawn_laws import DrawnLaw
from blind_study.law_cases import RATIOS
from blind_study.law_marks import AGREES
from blind_study.rate import Rate


@dataclass(frozen=True, kw_only=True)
class JudgedLaws:
    """One case of the study of laws.

    Attributes
    ----------
    name, joints : of the case.
    family, words : of the hidden law; empty where nothing is hidden.
    ratio : what the law leaves, over the noise.
    broken : the message, where there was no answer.
    verdict, added : of the catalogue's part of the answer.
    proposals : as the answer tells them.
    first : whether the first one is the true law.
    in_set : whether it or one of its rivals is.
    within : whether each of its parameters is within 3 sigma; None where its form is another.
    over_floor : held-out error with all proposals over the noise floor; None without one.
    cpu_s : of `explain`.
    """

    name: str
    joints: int
    family: str
    words: str
    ratio: float
    broken: str
    verdict: str
    added: tuple[str, ...]
    proposals: tuple[dict[str, Any], ...]
    first: bool
    in_set: bool
    within: bool | None
    over_floor: float | None
    cpu_s: float


def judge_laws(truth: dict[str, Any], said: dict[str, Any]) -> JudgedLaws:
    """Compare an answer with the truth."""
    answer, laws = said.get("answer", {}), said.get("laws", {})
    marks = laws.get("marks", [])
    proposals = tuple(answer.get("proposals", ()))
    first = bool(marks) and marks[0]["joint"] and is_true(marks[0])
    errors = marks[0]["errors"] if marks and marks[0]["same_form"] else []
    floor = answer.get("test_error", {}).get("noise_floor")
    after = proposals[-1]["test_error_after"] if proposals else None
    law = truth["law"]
    drawn = DrawnLaw.of(law["drawn"]) if law else None
    return JudgedLaws(
        name=said["name"],
        joints=truth["case"]["joints"],
        family=drawn.family if drawn else "",
        words=f"{drawn.words()} at joint{drawn.joint + 1}" if drawn else "",
        ratio=truth["hidden"][0]["ratio"] if drawn else 0.0,
        broken=said.get("error", ""),
        verdict=answer.get("verdict", "no answer"),
        added=tuple(f"{s['effect']}@{s['joint']}" for s in answer.get("steps", ())),
        proposals=proposals,
        first=first,
        in_set=first or any(laws.get("rivals", ())),
        within=bool(np.all(np.abs(errors) < 3.0)) if errors else None,
        over_floor=after / floor if floor and after is not None else None,
        cpu_s=said["cpu_s"],
    )


def is_true(mark: dict[str, Any]) -> bool:
    """Whether a proposal is the true law: as a torque, or as a formula."""
    return mark["differs"] <= AGREES or mark["same_form"]


def load_laws(folder: Path) -> list[JudgedLaws]:
    """Read answers and truths of the study of laws."""
    found: dict[str, JudgedLaws] = {}
    path = folder / "answers.jsonl"
    for line in path.read_text().splitlines() if path.exists() else ():
        said = json.loads(line)
        if "skipped" not in said:
            case = said.get("case", said["name"])  # a case may be asked with several filters
            truth = json.loads((folder / "truth" / f"{case}.json").read_text())
            found[said["name"]] = judge_laws(truth, said)
    return [found[name] for name in sorted(found)]


def law_figures(judged: list[JudgedLaws]) -> list[Rate]:
    """The rates of the study of laws."""
    loud = [one for one in judged if one.ratio >= RATIOS[0]]
    known = [one for one in loud if one.family == "library"]
    others = [one for one in loud if one.family not in ("", "library")]
    healthy = [one for one in judged if not one.family]
    return [
        Rate("library: true law first", [one.first for one in known], 0.90),
        Rate(
            "library: true law first and called an explanation",
            [one.first and one.proposals[0]["is_explanation"] for one in known],
            0.0,
        ),
        Rate("library: true law in the set", [one.in_set for one in known], 0.95),
        Rate(
            "library: coefficients within 3 sigma, of those of its form",
            [one.within for one in known if one.within is not None],
            0.90,
        ),
        Rate("healthy: laws proposed", [bool(o.proposals) for o in healthy], 0.01, at_most=True),
        Rate("others: never called an explanation", [not _wrongly(o) for o in others], 0.95),
        Rate("others: a law that is the same torque", [one.first for one in others], 0.0),
        Rate(
            "two joints: at most 10 s", [one.cpu_s <= 10 for one in judged if one.joints == 2], 1.0
        ),
        Rate(
            "three joints and more: at most 60 s",
            [one.cpu_s <= 60 for one in judged if one.joints > 2],
            1.0,
        ),
    ]


def _wrongly(one: JudgedLaws) -> bool:
    """Whether a law is called an explanation that is not the true one."""
    return any(p["is_explanation"] for p in one.proposals) and not one.first


def show_laws(folder: Path) -> None:
    """Print what the answers in a folder are worth."""
    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    judged = load_laws(folder)
    table = Table("figure", "found", "95 % interval", "asked", "met", box=box.SIMPLE)
    for one in law_figures(judged):
        table.add_row(*one.row())
    floors = [o.over_floor for o in judged if o.family == "library" and o.over_floor is not None]
    if floors:
        value = f"{np.median(floors):.3f} of {len(floors)}"
        met = "yes" if np.median(floors) <= 1.15 else "NO"
        table.add_row("library: held-out error over the floor, median", value, "", "1.15", met)
    for what, many in (("two joints", [2]), ("six and seven joints", [6, 7])):
        seconds = [one.cpu_s for one in judged if one.joints in many]
        if seconds:
            value = f"{np.median(seconds):.1f}, at most {max(seconds):.1f}"
            table.add_row(f"{what}: CPU s, median", value, "", "", "")
    console.print(table)
    console.print(_misses(judged))


def _misses(judged: list[JudgedLaws]) -> Table:
    table = Table("case", "hidden", "ratio", "catalogue", "proposed", box=box.SIMPLE)
    for one in judged:
        if one.first if one.family == "library" else not (one.broken or _bad(one)):
            continue
        proposed = "; ".join(
            f"{p['torque']} at {p['joint']} ({100 * p['explains']:.0f} %)" for p in one.proposals
        )
        hidden = f"{one.family}: {one.words}" if one.family else "nothing"
        catalogue = ", ".join((one.verdict.replace("_", " "), *one.added))
        said = one.broken or proposed or "nothing"
        table.add_row(one.name, hidden, f"{one.ratio:.2f}", catalogue, said)
    return table


def _bad(one: JudgedLaws) -> bool:
    return _wrongly(one) if one.family else bool(one.proposals)
