"""The findings of a check on one link, `LinkCheck`."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import Any

from dynident.consistency.remedy import Change
from dynident.consistency.rules import TITLES, RuleMargin
from dynident.tables import WIDTH, json_row


@dataclass(frozen=True, kw_only=True)
class LinkCheck:
    """The findings on one link, or on the links that move as one.

    Attributes
    ----------
    name : str
    kind : str
        "link" or "moving body".
    body : str
        The moving body that a link belongs to; empty where it is fixed to the world.
    parts : tuple of str
        The links that a moving body is made of.
    length : float
        Extent l, m, that margins are relative to.
    length_from : str
        "geometry", "joints" (distances between them), "robot" (its typical extent), or "inertia".
    rules : tuple of RuleMargin
        Worst first.
    not_checked : tuple of str
        What could not be judged, and why.
    hints : tuple of str
        What may have gone wrong.
    remedy : tuple of Change
        A small change after which every rule holds; empty where nothing is broken or no
        such change is known.
    """

    name: str
    kind: str
    body: str
    parts: tuple[str, ...]
    length: float
    length_from: str
    rules: tuple[RuleMargin, ...]
    not_checked: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()
    remedy: tuple[Change, ...] = ()

    @property
    def broken(self) -> tuple[RuleMargin, ...]:
        """The rules that are broken, worst first."""
        return tuple(rule for rule in self.rules if rule.broken)

    @property
    def worst(self) -> RuleMargin:
        """The rule with the smallest margin relative to the size of the body.

        The pseudo-inertia sums up mass, inertia and triangle: one of them is named before it.
        """
        plain = [one for one in self.rules if one.rule != "pseudo_inertia"]
        return (plain or list(self.rules))[0]

    @property
    def label(self) -> str:
        """Name, for tables."""
        return self.name if self.kind == "link" else f"{self.name} (moving body)"

    @property
    def title(self) -> str:
        """Kind and name, for sentences."""
        return f"{self.kind} '{self.name}'"

    def to_dict(self) -> dict[str, Any]:
        """The findings as JSON holds them."""
        return {
            "name": self.name,
            "kind": self.kind,
            "body": self.body or None,
            "parts": list(self.parts),
            "length": self.length,
            "length_from": self.length_from,
            "broken": bool(self.broken),
            "rules": [json_row(one) for one in self.rules],
            "not_checked": list(self.not_checked),
            "hints": list(self.hints),
            "mend": [json_row(one) for one in self.remedy],
        }

    @property
    def verdict(self) -> str:
        """The finding in a word or three."""
        return "BROKEN" if self.broken else "look at it" if self.hints else "holds"

    def details(self) -> str:
        """Return what is broken on it, why that may be, and what remedies it, in words."""
        lines = [f"{self.title}:"]
        for rule in sorted(self.broken, key=lambda rule: list(TITLES).index(rule.rule)):
            if rule.rule == "pseudo_inertia" and len(self.broken) > 1:
                continue
            lines.append(f"  {TITLES[rule.rule]}: {rule.words}")
        lines += [f"  {hint}" for hint in self.hints]
        if self.remedy:
            shown = [change for change in self.remedy if change.shows] or self.remedy
            changes = [str(change) for change in shown]
            lines.append("  a change that fixes it (moments about the centre of mass):")
            # Three to a line fit 110 columns.
            lines += [f"    {', '.join(changes[i : i + 3])}" for i in range(0, len(changes), 3)]
        elif not any(rule.rule == "finite" for rule in self.broken) and self.kind == "link":
            lines.append("  no small change fixes it: state its mass and inertia anew")
        return "\n".join(_wrapped(line) for line in lines)


def _wrapped(line: str) -> str:
    """A long line broken under its own indentation."""
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return fill(line, WIDTH - 1, subsequent_indent=indent, break_long_words=False)
