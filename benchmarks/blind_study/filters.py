"""The table [filter] as users write it: six settings, each fitted to the sampling rate."""

from __future__ import annotations

from pathlib import Path

import tomlkit

FILTERS: dict[str, dict[str, float]] = {
    "none": {},
    "usual": {"cutoff_hz": 18.0, "rate_hz": 50.0},
    "both": {"position_cutoff_hz": 40.0, "cutoff_hz": 18.0, "rate_hz": 50.0},
    "slow": {"cutoff_hz": 10.0, "rate_hz": 40.0},
    "fast": {"cutoff_hz": 40.0, "rate_hz": 200.0},
    "position": {"position_cutoff_hz": 30.0},
}
"""Settings by name; "none" leaves the table out."""
_SHARE = 0.4
"""Of the sampling rate, the highest cut-off."""


def setting(name: str, rate_hz: float) -> dict[str, float]:
    """Return a setting for recordings of a sampling rate: no frequency above what it allows."""
    said = FILTERS[name]
    return {
        key: min(value, rate_hz if key == "rate_hz" else _SHARE * rate_hz)
        for key, value in said.items()
    }


def state(study: Path, name: str, rate_hz: float) -> None:
    """Write a setting into a study file in place of the table that it has, if any."""
    document = tomlkit.parse(study.read_text())
    document.pop("filter", None)
    said = setting(name, rate_hz)
    if said:
        table = tomlkit.table()
        table.update(said)
        document["filter"] = table
    study.write_text(tomlkit.dumps(document))
