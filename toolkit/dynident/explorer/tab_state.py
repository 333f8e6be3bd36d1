"""What one tab of the browser has chosen. It is kept in the tab, so it is checked when it comes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from secrets import token_hex
from typing import Any, Self


@dataclass(frozen=True, kw_only=True)
class TabState:
    """What a tab shows, and what it would write to.

    Attributes
    ----------
    opened : digest of the version of the study that the tab shows.
    file : digest that the file must have for the tab to write to it: after a write another one.
    on : labels of effects that are switched on.
    written : those of them that are in the file by now.
    name : of the tab, which no other has.
    """

    opened: str
    file: str
    on: tuple[str, ...] = ()
    written: tuple[str, ...] = ()
    name: str = ""

    @classmethod
    def of(cls, digest: str) -> Self:
        """Return the state of a tab that has just been opened."""
        return cls(opened=digest, file=digest, name=token_hex(8))

    @classmethod
    def read(cls, sent: object) -> Self:
        """Return a state as a tab sends it; whatever is no state is one that shows nothing."""
        said: Mapping[str, Any] = sent if isinstance(sent, Mapping) else {}
        return cls(
            opened=str(said.get("opened", "")),
            file=str(said.get("file", "")),
            on=_labels(said.get("on")),
            written=_labels(said.get("written")),
            name=str(said.get("name", "")),
        )

    def to_dict(self) -> dict[str, Any]:
        """The state as JSON has it."""
        return asdict(self)

    @property
    def fresh(self) -> tuple[str, ...]:
        """Labels that a write would add."""
        return tuple(one for one in self.on if one not in self.written)

    def switched(self, labels: Iterable[str]) -> Self:
        """Return the state with these effects on; what is written stays on."""
        return replace(self, on=tuple(dict.fromkeys((*self.written, *labels))))

    def after_write(self, labels: Iterable[str], digest: str) -> Self:
        """Return the state after a write.

        Parameters
        ----------
        labels : that were added to the file.
        digest : of the file since.
        """
        written = tuple(dict.fromkeys((*self.written, *labels)))
        return replace(self, file=digest, written=written)


def _labels(sent: object) -> tuple[str, ...]:
    return tuple(one for one in sent if isinstance(one, str)) if isinstance(sent, list) else ()
