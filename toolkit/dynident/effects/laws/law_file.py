"""Laws in settings files: tables of a study, or files of their own that are shared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from dynident.effects.laws.law import PREFIX, Law
from dynident.errors import EffectError, StudyError
from dynident.settings import SettingsTable, read_toml

MOST = 200
"""Laws that a study may have, its files' included."""


class LawEntry(SettingsTable):
    """A law, in a table [laws.NAME]; or a file of laws."""

    torque: str | None = None
    """The formula, as `"c*v*sin(k*q + p)"`; see `dynident.formulas.parse_formula`."""
    shape: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Range of each parameter inside the formula, as `{ k = [1, 6], p = [-3.2, 3.2] }`."""
    file: str | None = None
    """A file of settings whose [laws.NAME] tables are meant instead, from the folder of this
    one."""

    def law(self, name: str) -> Law:
        """Return it under a name."""
        if self.torque is None:
            raise EffectError("has no torque", f"{PREFIX}{name}", 'add torque = "c*v"')
        ranges = tuple((key, *limits) for key, limits in self.shape.items())
        return Law(name=name, torque=self.torque, shape=ranges)


def _tables(said: Any) -> Any:
    """Names of files, alone, in a list or in place of a table, as tables."""
    if isinstance(said, str):
        said = [said]
    if isinstance(said, list):
        said = {str(one): one for one in said}
    if isinstance(said, dict):
        return {k: {"file": one} if isinstance(one, str) else one for k, one in said.items()}
    return said


_Said = str | list[str] | dict[str, str | LawEntry]
LawsEntry = Annotated[dict[str, LawEntry], BeforeValidator(_tables, json_schema_input_type=_Said)]
"""`laws` of a study: tables `[laws.NAME]`; or a file of laws, a list of such files, or a file in
place of a table."""


class _LawsFile(SettingsTable):
    """A file of laws."""

    laws: LawsEntry


def laws_of(said: Mapping[str, LawEntry], path: Path) -> tuple[Law, ...]:
    """Return the laws of a settings file.

    Parameters
    ----------
    said : its key `laws`.
    path : of the settings file; names of files are relative to its folder.

    Raises
    ------
    StudyError
        If a law cannot be read, two have one name, there are more than 200, or a file of laws
        names another.
    FileError
        If a file of laws cannot be read.
    """
    found: dict[str, tuple[Law, Path]] = {}
    for name, file, entry in _entries(said, path):
        try:
            law = entry.law(name)
        except EffectError as error:
            raise StudyError(error.what, f"{file}: laws.{name}", error.remedy) from None
        before = found.setdefault(name, (law, file))
        if before[0] != law:
            what = f"'{name}' is another law in {before[1]}"
            raise StudyError(what, f"{file}: laws", "rename one of them")
        if len(found) > MOST:
            raise StudyError(f"more than {MOST} laws", f"{file}: laws", "leave some out")
    return tuple(law for law, _ in found.values())


def _entries(said: Mapping[str, LawEntry], path: Path) -> Iterator[tuple[str, Path, LawEntry]]:
    """Yield the name of each law, the file in which it stands, and what it says."""
    for name, entry in said.items():
        if entry.file is None:
            yield name, path, entry
            continue
        where = f"{path}: laws.{name}"
        if entry.torque is not None:
            raise StudyError("has a torque and a file", where, "state one of them")
        file = path.parent / entry.file
        for inner, one in read_toml(file, _LawsFile).laws.items():
            if one.file is not None:
                raise StudyError("a file of laws names another", f"{file}: laws.{inner}")
            yield inner, file, one


def laws_table(laws: Iterable[Law]) -> dict[str, Any]:
    """Return laws as a settings file holds them, name -> table."""
    return {
        law.name: {
            "torque": law.torque,
            **({"shape": {n: [low, high] for n, low, high in law.shape}} if law.shape else {}),
        }
        for law in laws
    }
