"""How often answers like this one were right, on simulated robots whose truth was known.

The counts are those of the blind study (`benchmarks/blind_study`), whose robots of 2, 6 and 7
joints have nothing hidden in them, one effect or two, or a law that the catalogue does not have.
They hold for robots like these, of two to seven joints, whose recorded motion repeats, so that the
noise floor is measured, and for answers that add no more than those counted did. Of others nothing
is known, and nothing is said.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from scipy.special import ndtri

from dynident.tables import percent

Said = Literal["nothing_missing", "explained", "in_part", "none_of_these"]
Size = Literal["small", "large"]

LARGE = 1.5
"""Held-out error of the model as given over the noise floor, from which what it lacks is large."""

JOINTS = (2, 7)
"""Least and most joints of the robots that were counted."""

LEAST_CASES = 8
"""Answers below which nothing is said."""

MOST_EFFECTS = 2
"""Effects that answers which were counted have added at most, one at several joints counting once.
What is said of one or two effects says nothing of a dozen."""

_IN_PART, _NONE_OF_THESE = (4 + 0, 9 + 1), (11 + 10, 15 + 12)

_COUNTS: MappingProxyType[tuple[Said, Size], tuple[int, int]] = MappingProxyType(
    {
        ("explained", "large"): (101 + 55, 101 + 55),
        ("explained", "small"): (76 + 38, 76 + 39),
        ("nothing_missing", "small"): (112 + 52, 113 + 53),
        # Too few of these to count them by size.
        ("in_part", "large"): _IN_PART,
        ("in_part", "small"): _IN_PART,
        ("none_of_these", "large"): _NONE_OF_THESE,
        ("none_of_these", "small"): _NONE_OF_THESE,
    }
)
"""Right answers, and answers of which the tool says this: of MuJoCo's robots (635 of seed 94000, of
which those count that have a measured noise and are of such a kind) and of this package's simulator
(162 of seed 94400), as `blind_study` judges them. Answers all of whose additions were withdrawn are
of none."""

_CLAIMS: dict[Said, str] = {
    "nothing_missing": "nothing that is seen above the noise was missing",
    "explained": "the effect named first (or one that it cannot be told from) was truly missing",
    "in_part": "the effect named first (or one that it cannot be told from) was truly missing",
    "none_of_these": "what was missing was truly outside the catalogue",
}


@dataclass(frozen=True)
class TrackRecord:
    """A count of right answers, with what it means.

    Attributes
    ----------
    said : what these answers said.
    right, cases : how many of how many were right.
    """

    said: Said
    right: int
    cases: int

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the probability of being right (Wilson, 1927)."""
        weight = float(ndtri(0.975)) ** 2
        share, total = self.right / self.cases, self.cases + weight
        middle = (self.right + weight / 2) / total
        half = math.sqrt(weight * (self.cases * share * (1 - share) + weight / 4)) / total
        return max(0.0, middle - half), min(1.0, middle + half)

    def __str__(self) -> str:
        low, high = (percent(x, 0) for x in self.interval)
        return (
            f"Of {self.cases} answers like this on simulated robots of {JOINTS[0]} to {JOINTS[1]} "
            "joints, whose recorded motion repeats and whose truth was known, "
            f"{self.right} were right (95 % interval {low} to {high}): {_CLAIMS[self.said]}."
        )


def kind_of(verdict: str, *, effects: int, over_floor: float) -> tuple[Said, Size]:
    """Return the kind of an answer.

    Parameters
    ----------
    verdict : of the diagnosis.
    effects : that it adds, one at several joints counting once.
    over_floor : held-out error of the model as given, over the noise floor.

    Returns
    -------
    What the answer says, and whether what the given model lacks is large or small.
    """
    size: Size = "large" if over_floor >= LARGE else "small"
    if verdict == "unexplained":
        return ("in_part" if effects else "none_of_these"), size
    return ("explained" if verdict == "explained" else "nothing_missing"), size


def track_record(verdict: str, *, effects: int, over_floor: float) -> TrackRecord | None:
    """Return the record of answers like this; None where there are too few.

    Parameters
    ----------
    verdict, effects, over_floor : see `kind_of`.
    """
    kind = kind_of(verdict, effects=effects, over_floor=over_floor)
    if effects > MOST_EFFECTS or kind not in _COUNTS:
        return None
    return TrackRecord(kind[0], *_COUNTS[kind])
