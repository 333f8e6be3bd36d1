"""Large packages that are loaded when they are first used.

`lazy_loader.load` leaves a module in `sys.modules` that is loaded whenever somebody looks through
them, as `inspect` does for every class of settings that pydantic documents.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any


@dataclass(frozen=True)
class LateModule:
    """A package by its name, imported when something of it is asked for."""

    name: str

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._module, attribute)

    @cached_property
    def _module(self) -> Any:
        # Kept: to write out a function of a robot asks 1e4 times and more.
        return importlib.import_module(self.name)
