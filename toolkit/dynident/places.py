"""Where the data of a study lies."""

from __future__ import annotations

import os
from pathlib import Path

from dynident.errors import FileError

VARIABLE = "DYNIDENT_DATA"
"""Environment variable that names a folder of measured data."""


def find_data(file: str, folder: Path) -> Path:
    """Find a data file that a study names.

    It is looked for beside the study, in the folder that `DYNIDENT_DATA` names, in `shared/data`
    beside the project, and for the EMPS benchmark through the optional package
    `nonlinear-benchmarks`, which downloads it.

    Parameters
    ----------
    file : as the study names it.
    folder : the folder of the study.

    Raises
    ------
    FileError
        If it is nowhere: the message lists the places.
    """
    folder = folder.resolve()
    tried = [folder / file]
    if os.environ.get(VARIABLE):
        tried.append(Path(os.environ[VARIABLE]) / file)
    tried += [parent / "shared" / "data" / file for parent in folder.parents]
    for path in tried:
        if path.is_file():
            return path
    downloaded = _download(Path(file).name)
    if downloaded is not None:
        return downloaded
    remedy = f"put it beside the study, or name the data folder in the variable {VARIABLE}"
    if "EMPS" in file:
        remedy += "; or `pip install nonlinear-benchmarks`, which downloads this benchmark"
    raise FileError("no such data file", str(tried[0]), remedy)


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
