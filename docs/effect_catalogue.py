"""The catalogue of effects and the symbols of their parameters, as Markdown from the classes."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

from dynident.effects import Effect, Parameter, ShapeParameter, catalogue
from dynident.inertia import MEANINGS, PARAMETERS, UNITS
from dynident.robot import Robot
from key_tables import escaped

ARM = Path(__file__).resolve().parents[1] / "problems" / "hidden_effect" / "arm.urdf"
_PLACES = {
    "joint": "at a joint: `{name}@elbow`",
    "pair": "between two joints: `{name}@elbow:shoulder`, the joint whose torque changes first",
    "robot": "of the whole robot: `{name}`",
    "joint or robot": "at a joint, `{name}@elbow`, or common to all: `{name}`",
}


def effect_table() -> str:
    """Return a line for each effect: its name, its torque, and what is seen of it."""
    rows = ((f"[`{e.name}`](#{e.name})", f"`{e.law}`", e.sign_of) for e in _effects())
    return _table(("effect", "torque", "seen as"), rows)


def effects() -> str:
    """Return a section for each effect."""
    return "\n".join(_section(one) for one in _effects())


def inertial_symbols() -> str:
    """Return the ten parameters of a body."""
    names = (f"`{name}`" for name in PARAMETERS)
    return _table(("symbol", "meaning", "unit"), zip(names, MEANINGS, UNITS, strict=True))


def effect_symbols() -> str:
    """Return the parameters of all effects, in alphabetical order."""
    rows = sorted(
        (p.name.lower(), f"`{p.name}`", p.means, p.unit, f"[`{e.name}`](effects.md#{e.name})")
        for e in _effects()
        if e.name != "payload"  # it has the symbols of a body
        for p in _parameters(e)
    )
    return _table(("symbol", "meaning", "unit", "effect"), (row[1:] for row in rows))


def _section(effect: Effect) -> str:
    lines = [f"## {effect.name}", "", f"{_sentence(effect.meaning)}", ""]
    lines += [f"<!-- picture of {effect.name} -->", ""]
    lines.append(f"- Torque: `{effect.law}`")
    lines.append(f"- Seen as {effect.sign_of}")
    lines += [f"- `{p.name}`: {p.means}{_unit(p)}" for p in _parameters(effect)]
    lines.append(f"- Sits {_PLACES[effect.place].format(name=effect.name)}")
    if effect.confounded_with:
        others = ", ".join(f"[{name}](#{name})" for name in effect.confounded_with)
        lines.append(f"- May be taken for: {others}")
    advice = effect.experiment.format(joint="the joint", source="the other joint")
    lines.append(f"- What shows it: {escaped(advice)}")
    return "\n".join([*lines, ""])


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _unit(parameter: Parameter | ShapeParameter) -> str:
    return "" if parameter.unit == "1" else f", in {parameter.unit}"


def _parameters(effect: Effect) -> tuple[Parameter | ShapeParameter, ...]:
    robot = _arm()
    return (*effect.parameters(robot), *effect.shape_parameters(robot))


def _effects() -> Iterable[Effect]:
    """Every effect of the package, at the elbow of an arm."""
    for kind in catalogue().values():
        if kind.__module__.startswith("dynident."):
            yield kind(
                None if kind.place == "robot" else "elbow",
                "shoulder" if kind.place == "pair" else None,
            )


@cache
def _arm() -> Robot:
    return Robot.from_file(ARM)


def _table(head: tuple[str, ...], rows: Iterable[Iterable[str]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "".join(
        "| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines
    )
