"""The findings of a check: `Check`, worst first."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np

from dynident.check.joints import JointCheck
from dynident.check.mend import Change
from dynident.check.rules import TITLES, RuleMargin
from dynident.errors import ConsistencyError
from dynident.tables import WIDTH, Table, number, percent, print_tables


@dataclass(frozen=True)
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
    mend : tuple of Change
        The smallest change after which every rule holds; empty where nothing is broken or no
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
    mend: tuple[Change, ...] = ()

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
            "rules": [
                {
                    "rule": one.rule,
                    "value": finite(one.value),
                    "unit": one.unit,
                    "relative": finite(one.relative),
                    "broken": one.broken,
                    "words": one.words,
                }
                for one in self.rules
            ],
            "not_checked": list(self.not_checked),
            "hints": list(self.hints),
            "mend": [
                {
                    "name": one.name,
                    "before": finite(one.before),
                    "after": finite(one.after),
                    "unit": one.unit,
                }
                for one in self.mend
            ],
        }


@dataclass(frozen=True)
class Check:
    """Which links of a robot are impossible, by which rule and by how much.

    Attributes
    ----------
    name : str
        The file, or the robot.
    source : str
        "urdf", "sdf", "mjcf", "estimate" or "robot".
    links : tuple of LinkCheck
        Every link with inertial parameters, worst first.
    bodies : tuple of LinkCheck
        Moving bodies made of several links, or without any mass to move; worst first.
    joints : tuple of JointCheck
        Friction, damping, rotor inertia, and the effects of an estimate; worst first.
    notes : tuple of str
    """

    name: str
    source: str
    links: tuple[LinkCheck, ...]
    bodies: tuple[LinkCheck, ...]
    joints: tuple[JointCheck, ...]
    notes: tuple[str, ...] = ()

    @property
    def consistent(self) -> bool:
        """Whether no rule is broken."""
        return not self.broken and not any(one.broken for one in self.joints)

    @property
    def broken(self) -> tuple[LinkCheck, ...]:
        """The links and moving bodies that break a rule, worst first."""
        return tuple(one for one in (*self.links, *self.bodies) if one.broken)

    def require(self) -> Check:
        """Return this check if nothing is broken.

        Raises
        ------
        ConsistencyError
            Naming the worst link or joint, its rule, and by how much it is broken.
        """
        if self.consistent:
            return self
        count = len(self.broken) + sum(one.broken for one in self.joints)
        more = f" (and {count - 1} more)" if count > 1 else ""
        mend = "see them all with `dynident check`, or Check.show()"
        if self.broken:
            worst = self.broken[0]
            rule = worst.worst
            what = f"{TITLES[rule.rule]} is broken: {rule.words}{more}"
            raise ConsistencyError(what, f"{self.name}: {worst.title}", mend)
        joint = next(one for one in self.joints if one.broken)
        raise ConsistencyError(f"{joint.words}{more}", f"{self.name}: {joint.name}", mend)

    # --- in words ------------------------------------------------------------------------------

    @property
    def sentence(self) -> str:
        """The finding in one sentence."""
        if self.consistent:
            odd = [f"'{one.name}'" for one in (*self.links, *self.bodies) if one.hints]
            but = f", but look at {', '.join(odd)}" if odd else ""
            return f"{self.name}: consistent: no rule is broken{but}."
        links = [f"'{one.name}'" for one in self.broken if one.kind == "link"]
        bodies = [f"'{one.name}'" for one in self.broken if one.kind != "link"]
        joints = sorted({f"'{one.name}'" for one in self.joints if one.broken})
        parts = [
            f"{one if len(names) == 1 else several} {', '.join(names)}"
            for one, several, names in (
                ("link", "links", links),
                ("moving body", "moving bodies", bodies),
                ("joint", "joints", joints),
            )
            if names
        ]
        return f"{self.name}: NOT consistent: {'; '.join(parts)}."

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        parts: list[Table | str] = [self.link_table()]
        if self.joints:
            parts.append(self.joint_table())
        parts += [details(one) for one in self.broken]
        hidden = self._hidden()
        suspects = [one for one in (*self.links, *self.bodies) if one.hints and not one.broken]
        parts += [f"{one.title}: {'; '.join(one.hints)}" for one in suspects]
        parts += [*hidden, *self.notes, self.sentence]
        return tuple(parts)

    def show(self) -> None:
        """Print the margins, worst first, and what is broken in words."""
        print_tables(*self.tables())

    def link_table(self) -> Table:
        """The worst rule of every link and moving body."""
        rows = []
        for one in (*self.links, *self.bodies):
            rule = one.worst
            shown = one.name if one.kind == "link" else f"{one.name} (moving body)"
            verdict = "BROKEN" if one.broken else "look at it" if one.hints else "holds"
            rows.append(
                (
                    shown,
                    TITLES[rule.rule],
                    number(rule.value, 3),
                    rule.unit,
                    percent(rule.relative, 1),
                    verdict,
                )
            )
        columns = ("link", "smallest margin", "margin", "unit", "relative", "verdict")
        notes = (
            "relative: a mass to the robot's typical mass, a length to the link's extent l, a "
            "moment to m l^2.",
        )
        return Table("Links, worst first", columns, tuple(rows), notes if rows else ())

    def joint_table(self) -> Table:
        """Friction, damping and rotor inertia of every joint that states them."""
        rows = tuple(
            (
                one.name,
                one.quantity,
                number(one.value, 4),
                one.unit,
                "BROKEN" if one.broken else "holds",
            )
            for one in self.joints
        )
        told = tuple(one.words + "." for one in self.joints if one.broken)
        columns = ("joint", "quantity", "value", "unit", "verdict")
        return Table("Friction and rotors (none may be negative)", columns, rows, told)

    def _hidden(self) -> list[str]:
        """Broken links that a consistent moving body hides, and the reverse."""
        found = []
        for body in self.bodies:
            broken = [one.name for one in self.links if one.name in body.parts and one.broken]
            if broken and not body.broken:
                found.append(
                    f"The moving body '{body.name}' as a whole ({', '.join(body.parts)}) is "
                    f"consistent all the same: its motion does not show that "
                    f"{', '.join(broken)} cannot be."
                )
        return found

    def to_dict(self) -> dict[str, Any]:
        """The findings as JSON holds them; numbers that are not finite are null."""
        return {
            "name": self.name,
            "source": self.source,
            "consistent": self.consistent,
            "links": [one.to_dict() for one in self.links],
            "bodies": [one.to_dict() for one in self.bodies],
            "joints": [
                {
                    "name": one.name,
                    "quantity": one.quantity,
                    "value": finite(one.value),
                    "unit": one.unit,
                    "relative": finite(one.relative),
                    "sigma": None if one.sigma is None else finite(one.sigma),
                    "broken": one.broken,
                    "words": one.words,
                }
                for one in self.joints
            ],
            "notes": [*self._hidden(), *self.notes],
        }


def details(one: LinkCheck) -> str:
    """Return what is broken on a link, why that may be, and what mends it, in words."""
    lines = [f"{one.title}:"]
    for rule in sorted(one.broken, key=lambda rule: list(TITLES).index(rule.rule)):
        if rule.rule == "pseudo_inertia" and len(one.broken) > 1:
            continue
        lines.append(f"  {TITLES[rule.rule]}: {rule.words}")
    lines += [f"  {hint}" for hint in one.hints]
    if one.mend:
        changes = [str(change) for change in one.mend if change.shows]
        lines.append("  smallest change that mends it (moments about the centre of mass):")
        # Three to a line fit 110 columns.
        lines += [f"    {', '.join(changes[i : i + 3])}" for i in range(0, len(changes), 3)]
    elif not any(rule.rule == "finite" for rule in one.broken) and one.kind == "link":
        lines.append("  no small change mends it: state its mass and inertia anew")
    return "\n".join(_wrapped(line) for line in lines)


def _wrapped(line: str) -> str:
    """A long line broken under its own indentation."""
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return fill(line, WIDTH - 1, subsequent_indent=indent, break_long_words=False)


def finite(value: float) -> float | None:
    """Return a number as JSON can hold it."""
    return float(value) if np.isfinite(value) else None
