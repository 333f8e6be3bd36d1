"""What the residual at each joint depends on, in words, as a table and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.dependence.explained_shares import (
    INPUTS,
    ORDER,
    ExplainedShares,
    Share,
    explained_shares,
)
from dynident.diagnosis.dependence.joint_inputs import joint_inputs
from dynident.diagnosis.dependence.motion_blocks import motion_blocks
from dynident.diagnosis.dependence.position_errors import position_error_columns
from dynident.diagnosis.dependence.residual_record import ResidualRecord
from dynident.evidence.held_out import HeldOut
from dynident.tables import Table, listed, percent

ROWS = 600
"""Rows of a joint in its regressions, at most: time grows with their cube."""
FEWEST_ROWS = 150
"""Rows below which nothing is said."""
FEWEST_UNITS = 8
"""Held-out units below which nothing is said: their spread would be no standard error."""

Whole = Literal["systematic", "all"]
"""What shares are of: the systematic residual, or all of it, noise included."""

MOTION = (("position and velocity",), ("speeds of other joints",), ("position errors",))
"""What noise does not come again at, in the order in which it is asked. Functions of accelerations
are not among them: these hold noise of encoders, which columns have too, and a controller makes
torque of past noise. What position errors do to the torque goes with accelerations in a few ways
alone, that differ from place to place."""
MOTION_FIRST = (*MOTION, *(turn for turn in ORDER if turn not in MOTION))
"""Turns of a regression by which, without a noise floor, the verdict goes."""

_WORDS = {
    "position and velocity": "position and velocity of this joint",
    "speeds of other joints": "the speeds of other joints",
    "position errors": "errors of the measured positions that depend on the position",
    "acceleration and load": "its acceleration and load",
    "past": "its past",
    "other joints": "the other joints",
    "time": "time",
}
_ONE = {"past", "time"}
"""Inputs that are a singular."""


@dataclass(frozen=True, kw_only=True)
class JointDependence:
    """What a flexible regression explains of the residual at a joint, on held-out blocks.

    Attributes
    ----------
    joint : its name.
    whole : what shares are of.
    shares : None where nothing can be said.
    why : the reason; empty otherwise.
    """

    joint: str
    whole: Whole
    shares: ExplainedShares | None
    why: str = ""

    @property
    def told(self) -> dict[str, Share]:
        """Shares that can be told from nothing."""
        return {} if self.shares is None else {k: s for k, s in self.shares.by.items() if s.told}

    def of_the_motion(self, c: VerdictCriteria) -> dict[str, Share]:
        """Shares that the inputs of `MOTION` explain, so large that no noise has them.

        At least so large that, were the rest noise that is known, something would be missing.
        """
        least = c.within_noise**2 / (1.0 + c.within_noise**2)
        found = {name: self.told[name] for turn in MOTION for name in turn if name in self.told}
        return {k: one for k, one in found.items() if one.value - one.needed * one.error > least}

    @property
    def sentence(self) -> str:
        """What it depends on, in plain words."""
        return self.said_of(self.joint)

    def said_of(self, joints: str) -> str:
        """Return the sentence with names of all joints of which the same is to be said."""
        if self.shares is None:
            return f"What is left at {joints} is not asked what it depends on: {self.why}."
        noise = "noise included" if self.whole == "all" else "beyond the noise"
        what, told = f"What is left at {joints}, {noise}", self.told
        if not told:
            return f"{what}: no share that the regression explains can be told from nothing."
        (first, share), *more = told.items()
        explain = "explains" if first in _ONE else "explain"
        parts = [
            f"{_WORDS[first]} {explain} {_rounded(share.value)} of it (standard error "
            f"{_rounded(share.error)})",
            *(f"{_WORDS[k]} {_rounded(s.value)} ({_rounded(s.error)}) more" for k, s in more),
        ]
        rest = f"{_rounded(self.shares.rest.value)} ({_rounded(self.shares.rest.error)})"
        left = f"; the regression leaves {rest} unexplained"
        return f"{what}: {listed(parts)}{left if self.shares.rest.told else ''}."

    def to_dict(self) -> dict[str, Any]:
        """As `--json` has it."""
        found: dict[str, Any] = {"joint": self.joint, "of": self.whole}
        if self.shares is None:
            return {**found, "blocks": None, "inputs": [], "rest": None, "why": self.why}
        inputs = [
            {"name": name, **one.to_dict(), "distinguishable": one.told}
            for name, one in self.shares.by.items()
        ]
        rest = self.shares.rest.to_dict()
        return {**found, "blocks": self.shares.units, "inputs": inputs, "rest": rest, "why": None}


def dependence_sentences(found: Sequence[JointDependence]) -> tuple[str, ...]:
    """What they depend on, in plain words; joints that are alike in it share a sentence."""
    alike: dict[str, list[JointDependence]] = {}
    for one in found:
        alike.setdefault(one.said_of(""), []).append(one)
    return tuple(some[0].said_of(listed([one.joint for one in some])) for some in alike.values())


def residual_dependence(
    judged: HeldOut,
    records: Sequence[ResidualRecord],
    names: Sequence[str],
    c: VerdictCriteria,
    order: Sequence[tuple[str, ...]] = ORDER,
) -> tuple[JointDependence, ...]:
    """Ask what is left at each joint what it depends on.

    Parameters
    ----------
    judged : what the final model misses on held-out data: which joints have something left.
    records : that residual in each recording; with more recordings more can be learnt.
    names : of the joints.
    c : when something is left.
    order : which sets of inputs may be added in each turn.

    Returns
    -------
    One for each joint at which something is left.
    """
    joints = _joints_with_a_residual(judged, c)
    if not joints:
        return ()
    records = tuple(one for one in records if len(one.t) > 1)
    blocks = motion_blocks(records, joints)
    found = []
    for j in joints:
        power = np.concatenate([one.noise_power[:, j] for one in records])
        known = bool(np.isfinite(power).all())
        rows = _evenly([one.certain[:, j] for one in records])
        units = blocks.units(rows)
        shares, why = None, _too_little(len(rows), len(units))
        if not why:
            errors = position_error_columns(records, rows, j)
            x = replace(joint_inputs(records, j).rows(rows), position_errors=errors)
            residual = np.concatenate([one.residual[:, j] for one in records])[rows]
            noise = power[rows] if known else np.zeros(len(rows))
            shares = explained_shares(x, residual, noise, units, order)
            if shares is None:
                continue  # over all recordings there is no more than noise
        whole: Whole = "systematic" if known else "all"
        found.append(JointDependence(joint=names[j], whole=whole, shares=shares, why=why))
    return tuple(found)


def _joints_with_a_residual(judged: HeldOut, c: VerdictCriteria) -> list[int]:
    """Joints with more than noise, or than what nothing resolves, where noise is unknown."""
    left = judged.residual_rms
    if judged.ratio is not None and judged.noise_std is not None:
        left = np.where(judged.ratio > c.within_noise, judged.ratio * judged.noise_std, 0.0)
    return np.flatnonzero(left > c.resolution * judged.torque_rms).tolist()


def _evenly(certain: Sequence[np.ndarray]) -> np.ndarray:
    """Rows (N,) among all of several records, (T,) masks: as many of each as it has, evenly."""
    share = min(ROWS / max(sum(int(one.sum()) for one in certain), 1), 1.0)
    found, first = [], 0
    for one in certain:
        rows = np.flatnonzero(one)
        kept = np.linspace(0, len(rows) - 1, round(share * len(rows))).round().astype(int)
        found.append(first + rows[kept])
        first += len(one)
    return np.concatenate(found)


def _too_little(rows: int, units: int) -> str:
    """Why nothing can be said; empty where something can."""
    if rows < FEWEST_ROWS:
        return f"{rows} rows are too few"
    if units < FEWEST_UNITS:
        return (
            f"the motion comes again and again, and leaves {units} parts to hold out one after "
            f"another, where {FEWEST_UNITS} are needed; record motions that differ"
        )
    return ""


def dependence_table(found: Sequence[JointDependence]) -> Table:
    """Shares at each joint, in %, with their standard errors."""
    asked = [name for name in INPUTS if any(one.shares and name in one.shares.by for one in found)]
    rows = tuple(
        (
            one.joint,
            *(_cell(one.shares.by.get(name) if one.shares else None) for name in asked),
            _rest(one),
        )
        for one in found
    )
    noise = (
        "Shares are of the systematic residual: the noise is taken off."
        if all(one.whole == "systematic" for one in found)
        else "Shares are of all that is left, noise included: nothing tells it from the rest. The "
        "verdict calls it no noise where such a share is large beyond its standard error, also "
        "behind lower cut-offs of the filter where nothing is simulated."
    )
    return Table(
        "Percent of what is left that a flexible regression explains on held-out blocks of time",
        ("joint", *asked, "none of these"),
        rows,
        (
            f"{noise} Each with its standard error over the blocks. In brackets: what cannot be "
            "told from nothing, at the level of 5 % over all sets of inputs, or is below 1 %. "
            "Such shares count under \u201cnone of these\u201d, which is 100 % where all are in "
            "brackets.",
            "Each share is what inputs add to those before them that are told: what two sets "
            "explain alike counts for the earlier. The past (elasticity, hysteresis) comes before "
            "acceleration and load where it explains more. Negative shares are shown as 0.",
            "An estimate of what laws in these quantities could explain. A regression on more data "
            "may explain more; that it explains something does not say that the cause is there.",
        ),
    )


def _cell(share: Share | None) -> str:
    if share is None:
        return "-"
    both = f"{100 * max(share.value, 0.0):.0f} \u00b1 {100 * share.error:.0f}"
    return both if share.told else f"({both})"


def _rest(one: JointDependence) -> str:
    """What none of the inputs explains: all of it where none is told, which is no measurement."""
    if one.shares is None:
        return "-"
    return _cell(one.shares.rest) if one.told else "all"


def _rounded(value: float) -> str:
    return percent(round(value, 2) + 0.0, 0)
