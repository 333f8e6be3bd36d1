"""Large packages that are loaded when they are first used.

`lazy_loader.load` leaves a module in `sys.modules` that is loaded whenever somebody looks through
them, as `inspect` does for every class of settings that pydantic documents.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class LateModule:
    """A package by its name, imported when something of it is asked for."""

    name: str

    def __getattr__(self, attribute: str) -> Any:
        # Kept: to write out a function of a robot asks 1e4 times and more.
        module = self.__dict__.get("_module")
        if module is None:
            module = self.__dict__["_module"] = importlib.import_module(self.name)
        return getattr(module, attribute)
