"""The one root of every error that dynident raises on purpose.

A message says what is wrong, where (file, joint, row), and the remedy.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class DynidentError(Exception):
    """Something the user can put right.

    Parameters
    ----------
    what : str
        What is wrong, in one clause.
    where : str, optional
        File, joint, row or key at which it is wrong.
    remedy : str, optional
        What to do about it.
    """

    def __init__(self, what: str, where: str | None = None, remedy: str | None = None) -> None:
        self.what, self.where, self.remedy = what, where, remedy
        message = f"{where}: {what}" if where else what
        super().__init__(f"{message}. {remedy}" if remedy else message)


class ArgumentError(DynidentError, TypeError):
    """A function or class of the package is called with what it does not take."""


class FileError(DynidentError):
    """A file cannot be read or written."""


class RecordingError(DynidentError):
    """A recording is unusable."""


class RobotError(DynidentError):
    """A robot description is unusable."""


class UnsupportedError(RobotError):
    """A robot description says something that is sound, but not supported."""


class ConsistencyError(DynidentError):
    """A robot has inertial parameters, or friction, that nothing physical can have."""


class EffectError(DynidentError):
    """An effect is unknown, or does not fit the robot."""


class StudyError(DynidentError):
    """A study or experiment file is unusable."""


class UntrustedError(StudyError):
    """A study names files that are code, and nobody has said yet that they may be run.

    Parameters
    ----------
    modules : path and SHA-256 of each.
    where : the key that names them.
    """

    def __init__(self, modules: tuple[tuple[str, str], ...], where: str) -> None:
        self.modules = modules
        paths = ", ".join(path for path, _ in modules)
        remedy = 'read what they do, then say --trust (in Python: load(..., modules="run"))'
        super().__init__(f"would run code that is not trusted yet: {paths}", where, remedy)


class CriteriaError(DynidentError):
    """A criterion of the diagnosis is unknown, of the wrong kind or out of its range."""


class FitError(DynidentError):
    """An estimate cannot be computed from this data."""


class SettingError(DynidentError):
    """An environment variable says what it cannot."""


class ProgramError(DynidentError):
    """A nonlinear program is posed wrongly, or started from an impossible point."""


class DesignError(DynidentError):
    """No recording can be designed: limits leave no motion, or none shows what is asked for."""


class SimulationError(DynidentError):
    """A closed loop cannot be simulated.

    Parameters
    ----------
    what, where, remedy : see `DynidentError`.
    reason : str
        In one word, for programs that go on without it: "setting", "reference" (none, or unfit),
        "clock", "inertia" (M(q) is not positive definite), "massless" (a first moment without
        mass), "unstable" (the loop diverges or oscillates).
    """

    def __init__(
        self,
        what: str,
        where: str | None = None,
        remedy: str | None = None,
        *,
        reason: str = "setting",
    ) -> None:
        super().__init__(what, where, remedy)
        self.reason = reason


class DynidentWarning(UserWarning):
    """The result stands, with a caveat that the user should read."""


_quiet: ContextVar[bool] = ContextVar("quiet", default=False)


@contextmanager
def without_warnings() -> Iterator[None]:
    """Warn of nothing in what is only tried: whoever uses the outcome is the one to warn of it.

    Python's own filters of warnings would forget what was said before, and belong to the user.
    """
    before = _quiet.set(True)
    try:
        yield
    finally:
        _quiet.reset(before)


def warn(text: str) -> bool:
    """Warn of something, at the line outside this package that led to it.

    Parameters
    ----------
    text : what, where and the remedy.

    Returns
    -------
    Whether it was said; False inside `without_warnings`.

    Warns
    -----
    DynidentWarning
    """
    if _quiet.get():
        return False
    package = __name__.partition(".")[0]
    outside = level = 1  # 1 is this function
    frame = inspect.currentframe()
    while frame is not None:
        level += 1
        if frame.f_globals.get("__name__", "").partition(".")[0] == package:
            outside = level
        frame = frame.f_back
    warnings.warn(text, DynidentWarning, stacklevel=min(outside, level - 1))
    return True
