"""A study file written back with effects or a recording more, all else in it untouched."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import tomlkit
from tomlkit.items import AoT

from dynident import files
from dynident.effects import Effect, Law, laws_table
from dynident.errors import StudyError
from dynident.recording import Recording


def study_digest(path: str | Path) -> str:
    """Return the SHA-256 of a study file's text, by which it is known again.

    Raises
    ------
    FileError
        If it cannot be read.
    """
    return _digest(files.read_text(path))


def add_effects(
    path: str | Path,
    effects: tuple[Effect, ...],
    laws: tuple[Law, ...] = (),
    *,
    digest: str | None = None,
) -> str:
    """Write effects into a study file, comments and order untouched.

    Parameters
    ----------
    path : the study file.
    effects : to add to its list.
    laws : of theirs that it does not have, to be written as tables at its end.
    digest : `study_digest` of the file that is meant; None for whatever it is by now.

    Returns
    -------
    `study_digest` of the file as it was written here, whoever writes to it next.

    Raises
    ------
    StudyError
        If there is no way to do so that leaves all else in the file as it is, it has one of them
        already, or it is another file by now.
    """
    path = Path(path)
    with files.held(path):  # somebody else may add to it at the same time
        text = files.read_text(path)
        if digest is not None and _digest(text) != digest:
            raise StudyError("has changed since it was read", str(path), "nothing was written")
        return _digest(_add(path, text, [effect.label for effect in effects], laws))


def add_recording(path: str | Path, recording: Recording) -> None:
    """Write a recording into a study file, as the last of its list.

    Parameters
    ----------
    path : the study file.
    recording : its name is that of its file, in the folder of the study.

    Raises
    ------
    StudyError
        If the study names that file already, or its recordings are no list of tables.
    """
    path = Path(path)
    with files.held(path):  # as above
        document = tomlkit.parse(files.read_text(path))
        entries = document.get("recordings")
        if not isinstance(entries, AoT):
            remedy = 'write [[recordings]] and file = "..." below it'
            raise StudyError("has no list of recordings", str(path), remedy)
        if any(one.get("file") == recording.name for one in entries):
            raise StudyError(f"has {recording.name} already", str(path), "nothing was changed")
        entry = tomlkit.table()
        entry["file"] = recording.name
        entry["use"] = recording.use
        if recording.period is not None:
            entry["period"] = recording.period
        if recording.start:
            entry["start"] = recording.start
        entry.add(tomlkit.nl())  # before the table that may follow
        entries.append(entry)
        files.write_text(path, tomlkit.dumps(document))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _add(path: Path, text: str, labels: list[str], laws: tuple[Law, ...]) -> str:
    """Write labels of effects into a file of this text that nobody else writes; its new text."""
    wanted = tomllib.loads(text)
    twice = [one for one in labels if one in wanted.get("effects", [])]
    if twice:
        raise StudyError(f"has {', '.join(twice)} by now", str(path), "nothing was changed")
    wanted["effects"] = sorted([*wanted.get("effects", []), *labels])
    end = _tables(laws) if laws else ""
    if laws:
        held = wanted.get("laws", {})
        if not isinstance(held, dict):
            remedy = 'write it as a table, [laws] and lab = "..." below it'
            raise StudyError("names files of laws, beside which no law fits", str(path), remedy)
        wanted["laws"] = {**held, **laws_table(laws)}
    for candidate in (one + end for one in _with_effects(text, labels)):
        try:
            said = tomllib.loads(candidate)
        except tomllib.TOMLDecodeError:
            continue
        if {**said, "effects": sorted(said.get("effects", []))} == wanted:
            files.write_text(path, candidate)
            return candidate
    remedy = f"write them into it: {', '.join(labels)}"
    raise StudyError("the effects cannot be added to this file", str(path), remedy)


def _tables(laws: tuple[Law, ...]) -> str:
    """The tables of laws, as they follow a file."""
    return "\n" + tomlkit.dumps({"laws": laws_table(laws)})


def _with_effects(text: str, labels: list[str]) -> Iterator[str]:
    """Yield texts of a study with more effects, nicest first; not every one need be valid."""
    document = tomlkit.parse(text)
    if "effects" not in document:
        # A top-level key comes before the first table; `robot` is always there.
        line = f"effects = {json.dumps(labels)}"
        newline = "\r\n" if "\r\n" in text else "\n"
        yield re.sub(
            r"^[ \t]*robot[ \t]*=[^\r\n]*",
            lambda found: found[0] + newline + line,
            text,
            count=1,
            flags=re.MULTILINE,
        )
        yield line + newline + text
        return
    document["effects"].extend(labels)  # type: ignore[union-attr]
    yield tomlkit.dumps(document)
    # tomlkit 0.15 forgets the comma after a last item with a comment behind it.
    document = tomlkit.parse(text)
    for label in reversed(labels):
        document["effects"].insert(0, label)  # type: ignore[union-attr]
    yield tomlkit.dumps(document)
