"""Loads as a study file states them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import Field

from dynident.errors import StudyError
from dynident.fitting.loads.load import Load
from dynident.settings import SettingsTable, in_unit
from dynident.words import nearest

_LARGEST = 1e6
_Place = Annotated[float, Field(ge=-1e3, le=1e3, json_schema_extra=in_unit("m"))]
_Moment = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST, json_schema_extra=in_unit("kg m^2"))]
UNKNOWN = "unknown"
"""What `payload` says of a recording of which nobody knows whether it carries the load."""


class LoadEntry(SettingsTable):
    """A load that some recordings carry; what is left out is unknown, and is identified."""

    mass: float | None = Field(default=None, gt=0, le=_LARGEST, json_schema_extra=in_unit("kg"))
    """What it weighs."""
    centre: tuple[_Place, _Place, _Place] | None = None
    """[x, y, z] of its centre of mass, in the frame of `link`."""
    inertia: tuple[_Moment, _Moment, _Moment, _Moment, _Moment, _Moment] | None = None
    """[Ixx, Ixy, Ixz, Iyy, Iyz, Izz] about its centre of mass, in the axes of `link`; goes with a
    centre."""
    link: str = ""
    """A link that the last joint moves, as `"tool0"`; by default the one that it drives, or that
    of the wrench sensor that weighs the load."""

    def load(self, name: str) -> Load:
        """Return the load by its name."""
        return Load(name=name, **self.model_dump())


PayloadEntry = bool | str | LoadEntry | None
"""Of a recording: on board or not, "unknown", a load's name, or what is known of it."""


def loads_of(
    payloads: Iterable[PayloadEntry], named: dict[str, LoadEntry], where: str
) -> tuple[tuple[str, ...], tuple[Load, ...]]:
    """Tell which loads there are, and which recording carries which.

    Parameters
    ----------
    payloads : what each recording says.
    named : loads by their names.
    where : the study file, for messages.

    Returns
    -------
    the name of the load of each recording, empty for none, and the loads in use

    Raises
    ------
    StudyError
        If a recording names no load that there is, a load has the name of something else, or some
        recordings name their load and others say only that there is one.
    """
    if UNKNOWN in named:
        what = f"no load can be called '{UNKNOWN}', which payload has a meaning for"
        raise StudyError(what, f"{where}: loads", "choose another name")
    names: list[str] = []
    used: dict[str, Load] = {}
    plain = False
    for place, one in enumerate(payloads):
        name = ""
        if isinstance(one, LoadEntry):
            found = [name for name, load in used.items() if load == one.load(name)]
            name = found[0] if found else f"of recordings.{place}"
            used[name] = one.load(name)
        elif isinstance(one, str) and one != UNKNOWN:
            if one not in named:
                remedy = nearest(one, list(named), "loads") if named else "describe it in [loads]"
                what = f"payload = {one!r} names no load"
                raise StudyError(what, f"{where}: recordings.{place}", remedy)
            name = one
            used[name] = named[name].load(name)
        plain = plain or one is True or one == UNKNOWN
        names.append(name)
    if used and plain:
        what = "some recordings name their load, and others say only that there is one"
        raise StudyError(what, f"{where}: recordings", "name every load in [loads]")
    return tuple(names), tuple(used.values())
