"""Which contents of effect modules the user has said yes to, in a file that is theirs alone."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

from dynident import files
from dynident.errors import FileError

_SUM = re.compile(r"[0-9a-f]{64}")


def trust_file() -> Path:
    """Return the file of what is trusted, below `XDG_CONFIG_HOME` or `~/.config`.

    Raises
    ------
    FileError
        If there is no home folder.
    """
    given = os.environ.get("XDG_CONFIG_HOME", "")
    try:
        base = Path(given) if os.path.isabs(given) else Path("~/.config").expanduser()
    except RuntimeError:
        raise FileError("there is no home folder", "~/.config", "set XDG_CONFIG_HOME") from None
    return base / "dynident" / "trusted_effect_modules"


def is_trusted(sha256: str) -> bool:
    """Whether the user has said yes to a content; False where others could have said so."""
    try:
        return sha256 in _remembered(trust_file())
    except FileError:
        return False


def remember(sums: Iterable[str]) -> None:
    """Remember that the user has said yes to contents, by their SHA-256.

    Raises
    ------
    FileError
        If they cannot be written down, or the file or its folder is not the user's alone.
    """
    path = trust_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise FileError(f"cannot be made ({error.strerror or error})", str(path.parent)) from None
    kept = dict.fromkeys([*(_remembered(path) if path.exists() else ()), *sums])
    reason = files.others_may_write(path.parent)
    if reason:
        raise FileError(reason, str(path.parent), "make it yours alone")
    files.write_private(path, "".join(f"{one}\n" for one in kept).encode())


def _remembered(path: Path) -> list[str]:
    """What is in the file; nothing of it counts if another user may have written it."""
    if not path.exists():
        return []
    for one in (path.parent, path):
        reason = files.others_may_write(one)
        if reason:
            raise FileError(reason, str(one), "make it yours alone, or remove it")
    return [line for line in files.read_text(path).splitlines() if _SUM.fullmatch(line)]
