"""Where the data of a study lies: one file, or all that a pattern stands for."""

from __future__ import annotations

import glob
import os
import re
from pathlib import Path

from dynident.errors import FileError

VARIABLE = "DYNIDENT_DATA"
"""Environment variable that names a folder of measured data."""
MOST_FILES = 1000
"""Files that one pattern may stand for."""
_MOST_LEVELS = 3


def find_data(file: str, folder: Path) -> Path:
    """Find a data file that a study names.

    It is looked for beside the study, in the folder that `DYNIDENT_DATA` names, in `shared/data`
    beside the project, and for the EMPS benchmark through the optional package
    `nonlinear-benchmarks`, which downloads it.

    Parameters
    ----------
    file : as the study names it.
    folder : the folder of the study.

    Returns
    -------
    Path of the file, or of a folder.

    Raises
    ------
    FileError
        If it is nowhere: the message lists the places.
    """
    if "\0" in file:
        raise FileError("its name holds a NUL character", ascii(file))
    tried = [place / file for place in _places(folder)]
    for path in tried:
        # Whatever is no file and no folder is refused, with the reason, by who opens it.
        if _is_there(path):
            return path
    downloaded = _download(Path(file).name)
    if downloaded is not None:
        return downloaded
    remedy = f"put it there, or name the data folder in the variable {VARIABLE}"
    if "EMPS" in file:
        remedy += "; or `pip install nonlinear-benchmarks`, which downloads this benchmark"
    raise FileError("no such data file", str(tried[0]), remedy)


def _is_there(path: Path) -> bool:
    """Whether a path leads to anything; a name that no system takes leads nowhere."""
    try:
        return path.exists()
    except OSError:
        return False


def find_all(pattern: str, folder: Path) -> dict[str, Path]:
    """Find the data files that a pattern stands for, in the first place where there are any.

    Parameters
    ----------
    pattern : name of one file, or with `*`, `?` and `[...]` of several; `**` is no more than `*`,
        and a file that has the very name of the pattern is meant itself.
    folder : the folder of the study; the places are those of `find_data`.

    Returns
    -------
    Name, as the pattern would have it -> path; numbers in names put them in order.

    Raises
    ------
    FileError
        If there is none, more than `MOST_FILES`, or too many folders would have to be looked into.
    """
    if "\0" in pattern:
        raise FileError("its name holds a NUL character", ascii(pattern))
    if sum(map(glob.has_magic, Path(pattern).parts)) > _MOST_LEVELS:
        what = f"more than {_MOST_LEVELS} folders of the pattern have wildcards in their names"
        raise FileError(what, pattern, "name the upper ones")
    places = _places(folder)
    if not glob.has_magic(pattern) or any(_is_there(place / pattern) for place in places):
        return {pattern: find_data(pattern, folder)}
    for place in places:
        found: list[str] = []
        for name in glob.iglob(pattern, root_dir=place):
            found.append(name)
            if len(found) > MOST_FILES:
                what = f"more than {MOST_FILES} files match"
                raise FileError(what, str(place / pattern), "name fewer of them")
        if found:
            return {name: place / name for name in sorted(sorted(found), key=natural_order)}
    remedy = f"check the pattern, or name the data folder in the variable {VARIABLE}"
    raise FileError("no file matches", str(places[0] / pattern), remedy)


def natural_order(name: str) -> list[tuple[str, int, str]]:
    """Return a key that sorts names with numbers in them by the numbers: run_2 before run_10."""
    parts = ((text, digits.lstrip("0")) for text, digits in re.findall(r"(\D*)(\d*)", name))
    return [(text, len(digits), digits) for text, digits in parts]


def _places(folder: Path) -> list[Path]:
    """Folders in which a study's data may be, best first."""
    folder = folder.resolve()
    named = [Path(os.environ[VARIABLE])] if os.environ.get(VARIABLE) else []
    return [folder, *named, *(parent / "shared" / "data" for parent in folder.parents)]


def _download(name: str) -> Path | None:
    if name not in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
        return None
    try:
        from nonlinear_benchmarks import EMPS  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    try:
        locations = EMPS(data_file_locations=True)
    except Exception as error:  # its downloads fail in many ways; all mean: not to be had
        remedy = f"name the data folder in the variable {VARIABLE}"
        raise FileError(f"the download failed ({error})", name, remedy) from None
    for location in locations:
        if Path(location).name == name:
            return Path(location)
    return None
