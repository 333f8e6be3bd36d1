"""Effect modules that a file of settings names: imported if the user may be taken to want it."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import Literal

from dynident.effect_modules.trust import is_trusted
from dynident.effect_modules.user_module import UserModule
from dynident.effects import Effect
from dynident.effects.known_effects import KnownEffect
from dynident.effects.soundness import sample_block, unsound_columns, unsound_parameters
from dynident.errors import DynidentError, EffectError, StudyError, UntrustedError
from dynident.robot import Robot

Permission = Literal["trusted", "run"]
"""What may be run: contents that the user has said yes to before, or whatever is named."""


def import_effects(
    names: Sequence[str], settings: Path, modules: Permission
) -> tuple[KnownEffect, ...]:
    """Import the effect modules that a file of settings names, each content once.

    Parameters
    ----------
    names : of files, from the folder of the settings.
    settings : the file that names them, for messages too.
    modules : "trusted" imports those that the user has said yes to before, and those that have
        been imported in this process already; "run" all of them.

    Returns
    -------
    The effects that they brought.

    Raises
    ------
    UntrustedError
        If a module would have to be run that nobody has said yes to; none is run then.
    DynidentError
        If a file is unusable or fails: with its name, and the line.
    """
    paths = [settings.parent / name for name in dict.fromkeys(names)]
    return import_files(paths, f"{settings}: effect_modules", modules)


def import_files(paths: Sequence[Path], where: str, modules: Permission) -> tuple[KnownEffect, ...]:
    """Import effect modules, each content once.

    Parameters
    ----------
    paths : of the files.
    where : they are named, for messages.
    modules : as in `import_effects`.

    Returns
    -------
    The effects that they brought.

    Raises
    ------
    UntrustedError, DynidentError
        As `import_effects` does.
    """
    found = [UserModule.read(path) for path in paths]
    if modules not in ("trusted", "run"):
        raise StudyError(f"modules = {modules!r}", remedy="say 'trusted' or 'run'")
    if modules == "trusted":
        asked = [one for one in found if one.brought is None and not is_trusted(one.sha256)]
        if asked:
            raise UntrustedError(tuple((str(one.path), one.sha256) for one in asked), where)
    return tuple(effect for one in found for effect in one.run())


def require_sound(brought: Sequence[KnownEffect], robot: Robot) -> None:
    """Refuse effects whose columns are none: they raise, or have a wrong shape or no numbers.

    Parameters
    ----------
    brought : by effect modules.
    robot : at every place of which they are tried.

    Raises
    ------
    EffectError
        With the effect, its place and the file.
    """
    if not brought:
        return
    block = sample_block(robot)
    for one in brought:
        kind: type[Effect] = one.kind
        label = str(vars(kind)["name"])
        try:
            for effect in kind.candidates(robot):
                label = effect.label
                checked = effect.on(robot)
                said = unsound_parameters(checked, robot), unsound_columns(checked, block, robot)
                for complaint in chain(*said):
                    raise EffectError(complaint)
        except (Exception, SystemExit) as error:
            said, at = str(error), one.place
            if not isinstance(error, DynidentError):
                frames = traceback.extract_tb(error.__traceback__)
                own = [frame for frame in frames if frame.filename == one.file]
                at = f"{one.file}:{own[-1].lineno}" if own else one.place
                said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            remedy = "correct the class; dynident.check_effect tells more"
            raise EffectError(f"{label}: {said}", at, remedy) from None
