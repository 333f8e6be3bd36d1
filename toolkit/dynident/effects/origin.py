"""Where an effect of one's own came from, so that a file which needs it can say what is missing."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.metadata import packages_distributions
from pathlib import Path

from dynident.effects.effect import Effect
from dynident.effects.known_effects import known_effects

_OWN = __name__.partition(".")[0]


@dataclass(frozen=True)
class Origin:
    """Where a class of effects was defined.

    Attributes
    ----------
    module : by which it was imported.
    file : its name without its folder; empty for a notebook's cell and a console.
    package : that was installed and brings it; empty for none.
    """

    module: str
    file: str
    package: str

    def missing(self, name: str) -> str:
        """Return the sentence that says where an effect is to be had from."""
        if self.package:
            return f"effect '{name}' came from the package {self.package}: install it"
        if self.file:
            remedy = "import it, or name it in effect_modules (--effects)"
            return f"effect '{name}' came from {self.file}: {remedy}"
        return f"effect '{name}' came from a notebook or a console: define it again before"


def origin_of(kind: type[Effect]) -> Origin | None:
    """Return where a class came from; None for the package's own and those of no catalogue."""
    found = next((one for one in known_effects().values() if one.kind is kind), None)
    top = kind.__module__.partition(".")[0]
    if found is None or top == _OWN:
        return None
    file = Path(found.file)
    module = sys.modules.get(kind.__module__)
    has_file = file.suffix == ".py" and getattr(module, "__file__", None) is not None
    package = packages_distributions().get(top, [""])[0] if top != "__main__" else ""
    return Origin(kind.__module__, file.name if has_file else "", package)
