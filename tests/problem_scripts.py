"""Scripts of problems as modules."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

PROBLEMS = Path(__file__).parents[1] / "problems"


def script(problem: str, name: str) -> ModuleType:
    """Import `problems/<problem>/<name>.py`; nothing runs but its definitions."""
    key = f"{problem}_{name}"
    if key not in sys.modules:
        spec = importlib.util.spec_from_file_location(key, PROBLEMS / problem / f"{name}.py")
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[key] = module
        spec.loader.exec_module(module)
    return sys.modules[key]
