"""What logs do not say of themselves, and whoever recorded them knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from dynident.errors import RecordingError


@dataclass(frozen=True, kw_only=True)
class CarriedLoad:
    """A load that some of the files carry.

    Attributes
    ----------
    pattern : of their names, without folders, as "run_load_*".
    mass : kg; None where nobody knows it.

    Raises
    ------
    RecordingError
        If the mass is none.
    """

    pattern: str
    mass: float | None = None

    def __post_init__(self) -> None:
        if self.mass is not None and not 0 < self.mass <= 1e6:
            what = f"a load of {self.mass:g} kg"
            raise RecordingError(what, self.pattern, "give a mass above zero, or none")

    def is_in(self, name: str) -> bool:
        """Whether a file, or a record in it, carries the load."""
        return fnmatch(name, self.pattern)


@dataclass(frozen=True, kw_only=True)
class LogFacts:
    """What is known of the files of a draft.

    Attributes
    ----------
    joints : of the robot that were recorded, in order; None for all that move.
    gears : ratio of each joint's gear, where the files are of the motors' side; negative where the
        joint turns the other way.
    columns : ours -> a column of the files, or a linear expression of them, where matching would
        take another: `{"q.j6": "m6/32 - m5/45"}` of a joint that two motors turn.
    rate_hz : of the samples, where the files have no clock.
    topic : of bags that hold joint states on several.
    loads : that some files carry.
    """

    joints: Sequence[str] | None = None
    gears: Sequence[float] | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None
    topic: str = ""
    loads: tuple[CarriedLoad, ...] = ()

    @property
    def states_positions(self) -> bool:
        """Whether somebody has said what positions are made of."""
        return any(ours.startswith("q.") for ours in self.columns)

    def carried(self, names: Sequence[tuple[Path, str]]) -> dict[str, CarriedLoad]:
        """Return the loads by their names in the study, each one that is there.

        Parameters
        ----------
        names : of files, and of records in them.

        Raises
        ------
        RecordingError
            If no file carries one of them.
        """
        for load in self.loads:
            if not any(load.is_in(one) for pair in names for one in _names_of(pair)):
                shown = ", ".join(dict.fromkeys(path.name for path, _ in names))
                what = f"no file is called '{load.pattern}'"
                raise RecordingError(what, "load", f"files: {shown}")
        single = len(self.loads) == 1
        return {
            "load" if single else f"load{number}": load
            for number, load in enumerate(self.loads, start=1)
        }


def carried_by(pair: tuple[Path, str], loads: dict[str, CarriedLoad]) -> str:
    """Return the name of the load of a file and record; empty for none.

    Parameters
    ----------
    pair : the file, and the record in it.
    loads : by their names.

    Raises
    ------
    RecordingError
        If it is said to carry two.
    """
    found = [name for name, load in loads.items() if any(map(load.is_in, _names_of(pair)))]
    if len(found) > 1:
        what = f"carries {' and '.join(found)}"
        raise RecordingError(what, str(pair[0]), "let every file match one pattern")
    return found[0] if found else ""


def _names_of(pair: tuple[Path, str]) -> tuple[str, ...]:
    path, record = pair
    return tuple(name for name in (path.name, path.stem, record) if name)
