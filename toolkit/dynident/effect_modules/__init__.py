"""Effects of one's own in files that a study names: `effect_modules = ["my_effects.py"]`.

To import a file is to run it. In: names of files, and what may be run. Out: effects that have
joined the catalogue, or one line that says why not. What a user has once said yes to is remembered
by its content (`trust`).
"""

from dynident.effect_modules.import_effects import (
    Permission,
    import_effects,
    import_files,
    require_sound,
)
from dynident.effect_modules.trust import remember
from dynident.effect_modules.user_module import line_of_a_module, module_file

__all__ = [
    "Permission",
    "import_effects",
    "import_files",
    "line_of_a_module",
    "module_file",
    "remember",
    "require_sound",
]
