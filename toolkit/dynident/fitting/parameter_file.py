"""Parameters from a CSV file whose header, or the caller, states their order.

Three layouts are read. *By name*: columns `name` and `value`, with "m.<link>", "mx.<link>", ...
(and parameters of effects, "Fv@<joint>"). *By link*: a column `link` and one for each of the ten
parameters. Both are in the link's own frame. *Without names*: numbers alone, ten for each joint's
moving body in its joint's frame, in the order of the joints; eleven where each is followed by the
joint's viscous friction, as in Ting et al. (RSS 2006). Inertias are about the origin of the frame.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dynident import files
from dynident.errors import FileError, warn
from dynident.inertia import LARGEST, PAPER_ORDER, PARAMETERS
from dynident.model import Model
from dynident.recording.formats.text.text_head import is_number
from dynident.robot import Robot
from dynident.robot.formats.xmltree import closest

ORDERS = {"dynident": PARAMETERS, "paper": PAPER_ORDER}
"""Orders of the ten parameters of a body: ours, and that of the papers (m, mcx, mcy, mcz, I11,
I12, I13, I22, I23, I33)."""

_ALIASES = {
    **{name: name for name in PARAMETERS},
    **{"mcx": "mx", "mcy": "my", "mcz": "mz"},
    **{"I11": "Ixx", "I12": "Ixy", "I13": "Ixz", "I22": "Iyy", "I23": "Iyz", "I33": "Izz"},
}
_VISCOUS = "viscous"
_LAYOUTS = (
    "columns name, value; or link, m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz; or numbers alone "
    f"with the order stated ({', '.join(ORDERS)})"
)


@dataclass(frozen=True, eq=False)
class GivenParameters:
    """Parameters that are given, not fitted.

    Attributes
    ----------
    robot : the description with the given inertial parameters.
    effects : value of each parameter of an effect that is given, by its name ("Fv@elbow").
    described : the description with its own parameters.
    """

    robot: Robot
    effects: dict[str, float]
    described: Robot


def read_parameters(
    path: str | Path, model: Model | Robot, order: str | None = None
) -> GivenParameters:
    """Read parameters from a CSV file; see the layouts above.

    Parameters
    ----------
    path : the file; commas, semicolons or tabs separate the columns.
    model : the robot whose parameters they are, and effects whose parameters may be among them.
    order : of numbers without names, one of `ORDERS`.

    Returns
    -------
    The description with these parameters, and the values of effects.

    Raises
    ------
    FileError
        If the file cannot be read, its order is not stated (or stated twice), a link or parameter
        is unknown, missing or there twice, or a value is not a finite number or beyond `LARGEST`.
    """
    if order is not None and order not in ORDERS:
        raise FileError(f"no order '{order}' of parameters", remedy=f"orders: {', '.join(ORDERS)}")
    model = Model(model) if isinstance(model, Robot) else model
    cells = _cells(files.read_text(path), str(path))
    reader = _ParameterReader(str(path), model)
    header = cells[0]
    named = {_ALIASES[name] for name in header if name in _ALIASES}
    if {"name", "value"} <= set(header):
        read = reader.by_name
    elif named and not all(map(is_number, header)):
        read = reader.by_link
    elif order is not None:
        body = cells if all(map(is_number, header)) else cells[1:]
        return reader.without_names(body, ORDERS[order])
    else:
        numbers = all(map(is_number, header))
        what = "the first line holds numbers, and no order" if numbers else "no layout is known"
        raise FileError(what, f"{path}, header", f"write {_LAYOUTS}")
    if order is not None:
        remedy = f"leave out the order '{order}'"
        raise FileError("the header names the parameters, and says their order", str(path), remedy)
    return read(header, cells[1:])


class _ParameterReader:
    def __init__(self, file: str, model: Model) -> None:
        self.file, self.model, self.robot = file, model, model.robot
        self.links = [link.name for link in self.robot.links]
        self.effect_names = model.names[len(model.base.independent) :]

    def by_name(self, header: list[str], rows: list[list[str]]) -> GivenParameters:
        """Columns `name` and `value`."""
        name_at, value_at = _column(header, "name", self.file), _column(header, "value", self.file)
        links: dict[str, dict[str, float]] = {}
        effects: dict[str, float] = {}
        for row in rows:
            name, where = row[name_at], f"{self.file}, name {row[name_at]}"
            value = _number(row[value_at], where)
            head, dot, link = name.partition(".")
            if name in self.effect_names:
                found, key = effects, name
            elif dot and head in _ALIASES and link in self.links:
                found, key = links.setdefault(link, {}), _ALIASES[head]
            else:
                raise FileError("no such parameter", where, self._known(name))
            if key in found:
                raise FileError("the parameter is there twice", where, "keep one")
            found[key] = value
        return self._by_links(links, effects)

    def by_link(self, header: list[str], rows: list[list[str]]) -> GivenParameters:
        """One row for each link; without the column `link`, for each joint in order."""
        names = [_ALIASES.get(name, name) for name in header]
        missing = [name for name in PARAMETERS if name not in names]
        if missing:
            remedy = f"a column is needed for each of {', '.join(PARAMETERS)}"
            raise FileError(f"no column {', '.join(missing)}", self.file, remedy)
        places = {name: _column(names, name, self.file) for name in PARAMETERS}
        if _VISCOUS in names:
            places[_VISCOUS] = _column(names, _VISCOUS, self.file)
        if "link" not in names:
            ordered = [[row[i] for i in places.values()] for row in rows]
            return self.without_names(ordered, PARAMETERS)
        at = _column(names, "link", self.file)
        links: dict[str, dict[str, float]] = {}
        viscous: dict[str, float] = {}
        driven = dict(zip(self.robot.bodies, self.robot.names, strict=True))
        for row in rows:
            link, where = row[at], f"{self.file}, link {row[at]}"
            if link not in self.links:
                raise FileError("the robot has no such link", where, closest(link, self.links))
            if link in links:
                raise FileError("the link is there twice", where, "keep one row")
            values = {name: _number(row[i], f"{where}, {name}") for name, i in places.items()}
            friction = values.pop(_VISCOUS, None)
            if friction is not None and link in driven:
                viscous[driven[link]] = friction
            links[link] = values
        return self._by_links(links, self._viscous(viscous))

    def without_names(self, rows: list[list[str]], order: Sequence[str]) -> GivenParameters:
        """Numbers alone, row after row."""
        where = f"{self.file}, number {{}}"
        cells = [cell for row in rows for cell in row]
        values = np.array([_number(c, where.format(i)) for i, c in enumerate(cells, start=1)])
        n, each = self.robot.n, len(values) // self.robot.n
        if len(values) not in (10 * n, 11 * n):
            what = f"{len(values)} numbers for {n} moving bodies ({', '.join(self.robot.bodies)})"
            remedy = f"{10 * n} are needed, or {11 * n} with the viscous friction of each joint"
            raise FileError(what, self.file, remedy)
        table = values.reshape(n, each)
        theta = table[:, [list(order).index(name) for name in PARAMETERS]]
        viscous = dict(zip(self.robot.names, table[:, 10:].ravel().tolist(), strict=False))
        return GivenParameters(
            self.robot.with_theta(theta.ravel()), self._viscous(viscous), self.robot
        )

    def _by_links(
        self, links: dict[str, dict[str, float]], effects: dict[str, float]
    ) -> GivenParameters:
        missing = [
            f"{parameter}.{link}"
            for link in dict.fromkeys((*self._needed(), *links))
            for parameter in PARAMETERS
            if parameter not in links.get(link, {})
        ]
        if missing:
            more = f" and {len(missing) - 5} more" if len(missing) > 5 else ""
            what = f"no value of {', '.join(missing[:5])}{more}"
            raise FileError(what, self.file, "give all ten of each link; zeros if it is massless")
        phis = {link: [values[p] for p in PARAMETERS] for link, values in links.items()}
        return GivenParameters(self.robot.with_links(phis), effects, self.robot)

    def _needed(self) -> list[str]:
        """Links that move, and that have or may have an inertia."""
        driven = {self.robot.links[i].name for i in self.robot.driven}
        return [
            link.name
            for link in self.robot.links
            if link.joint >= 0 and (link.source != "absent" or link.name in driven)
        ]

    def _viscous(self, values: dict[str, float]) -> dict[str, float]:
        named = {f"Fv@{joint}": value for joint, value in values.items()}
        found = {name: value for name, value in named.items() if name in self.effect_names}
        if len(found) < len(named):
            words = "viscous friction is not in the model, and is left out"
            lost = ", ".join(name for name in named if name not in found)
            warn(f"{self.file}: {words} ({lost})")
        return found

    def _known(self, name: str) -> str:
        _, dot, link = name.partition(".")
        if "@" in name:
            known = ", ".join(self.effect_names) or "none (a study states effects)"
            return f"parameters of effects: {known}"
        if dot and link not in self.links:
            return closest(link, self.links)
        listed = ", ".join(f"{parameter}.<link>" for parameter in PARAMETERS)
        return f"parameters: {listed}; links: {', '.join(self.links)}"


def _cells(text: str, file: str) -> list[list[str]]:
    """The cells of a file, stripped; lines that are empty or begin with # are skipped."""
    import pandas as pd

    if "\0" in text:
        raise FileError("is not text (it holds NUL bytes)", file, "is it the right file?")
    first = next((x for x in text.splitlines() if x.strip() and x.strip()[0] != "#"), "")
    separator = max(",;\t", key=first.count)
    try:
        frame = pd.read_csv(
            io.StringIO(text),
            sep=separator,
            header=None,
            dtype=str,
            keep_default_na=False,
            skipinitialspace=True,
            comment="#",
        )
    except pd.errors.EmptyDataError:
        raise FileError("is empty", file, f"write {_LAYOUTS}") from None
    except pd.errors.ParserError as error:
        reason = str(error).strip().splitlines()[0].removeprefix("Error tokenizing data. C error: ")
        raise FileError(
            f"is not a table ({reason})", file, "give each line as many cells"
        ) from None
    # A line with fewer cells than the first gets NaN: no text.
    rows = [[c.strip() if isinstance(c, str) else "" for c in row] for row in frame.to_numpy()]
    return [row for row in rows if any(row)]


def _column(names: list[str], name: str, file: str) -> int:
    if names.count(name) > 1:
        raise FileError(f"has two columns for {name}", file, "keep one")
    return names.index(name)


def _number(text: str, where: str) -> float:
    if not text:
        raise FileError("the cell is empty", where, "every cell holds a number")
    if not is_number(text):
        shown = text if len(text) <= 30 else text[:27] + "..."
        raise FileError(f"'{shown}' is not a number", where, "every cell holds a number")
    if not np.isfinite(value := float(text)):
        raise FileError(f"'{text}' is not a finite number", where, "every cell holds a number")
    if not abs(value) < LARGEST:
        what = f"'{text[:30]}' is no property of a robot"
        raise FileError(what, where, "state it in SI units")
    return value
