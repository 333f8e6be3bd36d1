"""The findings of a check: `Check`, worst first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dynident.consistency.joint_parameters import JointCheck
from dynident.consistency.link import LinkCheck
from dynident.consistency.rules import TITLES, RuleMargin
from dynident.consistency.spread import IMPOSSIBLE_SPREAD
from dynident.errors import ConsistencyError
from dynident.tables import Shown, Table, json_row, number, percent

_RELATIVE = (
    "relative: a mass to the robot's typical mass, a length to the link's extent l, a "
    "moment to m l^2."
)


@dataclass(frozen=True, kw_only=True, repr=False)
class Check(Shown):
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
        remedy = "see them all with `dynident check`, or Check.show()"
        if self.broken:
            worst = self.broken[0]
            rule = worst.worst
            what = f"{TITLES[rule.rule]} is broken: {rule.words}{more}"
            raise ConsistencyError(what, f"{self.name}: {worst.title}", remedy)
        joint = next(one for one in self.joints if one.broken)
        raise ConsistencyError(f"{joint.words}{more}", f"{self.name}: {joint.name}", remedy)

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
        parts += [one.details() for one in self.broken]
        hidden = self._hidden()
        suspects = [one for one in (*self.links, *self.bodies) if one.hints and not one.broken]
        parts += [f"{one.title}: {'; '.join(one.hints)}" for one in suspects]
        parts += [*hidden, *self.notes, self.sentence]
        return tuple(parts)

    def link_table(self) -> Table:
        """The worst rule of every link and moving body."""
        rows = [(one.label, *_cells(one.worst), one.verdict) for one in (*self.links, *self.bodies)]
        columns = ("link", "smallest margin", "margin", "unit", "relative", "verdict")
        notes = (
            _RELATIVE,
            "The margins of all rules: `dynident check --all`, or Check.margin_table().",
        )
        return Table("Links, worst first", columns, tuple(rows), notes if rows else ())

    def margin_table(self) -> Table:
        """Every rule that was judged, of every link and moving body, in SI and relative."""
        order = list(TITLES)
        rows = tuple(
            (
                one.label,
                *_cells(rule),
                "BROKEN" if rule.broken else "look at it" if rule.doubtful else "holds",
            )
            for one in (*self.links, *self.bodies)
            for rule in sorted(one.rules, key=lambda rule: order.index(rule.rule))
        )
        columns = ("link", "rule", "margin", "unit", "relative", "verdict")
        notes = (
            _RELATIVE,
            "The spread of mass is broken where it is more than "
            f"{IMPOSSIBLE_SPREAD:g} times too large; below that the shapes may be simplified.",
        )
        return Table("Every rule, worst link first", columns, rows, notes if rows else ())

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
        notes = tuple(f"{one.name}: {one.words}." for one in self.joints if one.broken)
        columns = ("joint", "quantity", "value", "unit", "verdict")
        return Table("Friction and rotors (none may be negative)", columns, rows, notes)

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
            "joints": [json_row(one) for one in self.joints],
            "notes": [*self._hidden(), *self.notes],
        }


def _cells(rule: RuleMargin) -> tuple[str, str, str, str]:
    """A rule, its margin with its unit, and relative to the body."""
    if rule.rule == "finite":  # it has no margin: numbers are finite, or they are not
        return TITLES[rule.rule], "-", "", "-"
    return TITLES[rule.rule], number(rule.value, 3), rule.unit, percent(rule.relative, 1)
