"""A line of a benchmark: who did which work, and the figures that came out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Size = Literal["tiny", "quick", "full"]
"""How much work: "full" is what is quoted; "tiny" is for tests and says nothing about times."""
SIZES: tuple[Size, ...] = ("tiny", "quick", "full")
OURS = "dynident"
"""How the name of whoever is ours begins."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """What one did with a piece of work.

    Attributes
    ----------
    case : the work; lines of one case are alike in all but who does it.
    who : begins with `OURS` where it is the package.
    figures : by name with the unit, as "CPU, ms".
    missing : why there are no figures; empty where there are.
    at : place of the case on the axis of a scaling.
    """

    case: str
    who: str
    figures: Mapping[str, float] = field(default_factory=dict)
    missing: str = ""
    at: float | None = None

    @property
    def is_ours(self) -> bool:
        return self.who.startswith(OURS)


@dataclass(frozen=True, kw_only=True)
class Benchmark:
    """Work that the package and what a user would pick instead do in one run.

    Attributes
    ----------
    title, work : for the page; `work` says what is done and what the figures are.
    compared : the figure of which the page gives the ratio to ours; empty for none.
    lines : does the work of a size; yields each line once it is known.
    axis : what a scaling runs over, for the picture; empty where it is none.
    """

    title: str
    work: str
    compared: str
    lines: Callable[[Size], Iterable[Line]]
    axis: str = ""


def ratios(lines: Iterable[Line], compared: str) -> list[float | None]:
    """Each line's figure over that of the first of ours in its case; None where one is missing."""
    lines = list(lines)
    ours: dict[str, float] = {}
    for line in lines:
        if line.is_ours and compared in line.figures:
            ours.setdefault(line.case, line.figures[compared])
    return [
        line.figures[compared] / ours[line.case]
        if compared in line.figures and ours.get(line.case)
        else None
        for line in lines
    ]


def as_json(line: Line) -> dict[str, Any]:
    return asdict(line)


def from_json(said: Mapping[str, Any]) -> Line:
    return Line(**said)
