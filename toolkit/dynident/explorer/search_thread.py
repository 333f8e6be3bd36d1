"""The diagnosis of a study in the background, with what it is doing."""

from __future__ import annotations

from collections.abc import Callable
from threading import Event, Thread

from dynident.diagnosis import Diagnosis, diagnose
from dynident.errors import DynidentError
from dynident.study import Study

Diagnose = Callable[[Study, Callable[[str], None]], Diagnosis]


class _Stopped(Exception):
    """The page was closed while it was being made."""


def diagnose_study(study: Study, progress: Callable[[str], None]) -> Diagnosis:
    """Diagnose a study as `dynident explain` does."""
    return diagnose(
        study.model,
        study.train,
        study.test,
        controller=study.controller,
        criteria=study.criteria,
        progress=progress,
    )


class SearchThread:
    """A diagnosis that runs beside the page.

    Parameters
    ----------
    study : what is diagnosed.
    known : its diagnosis, where there is one already.
    diagnose : makes it.

    Attributes
    ----------
    doing : what is being done, in words.
    diagnosis : the answer; None until it is there.
    failure : why there is none; empty as long as there may be one.
    """

    def __init__(
        self, study: Study, known: Diagnosis | None = None, diagnose: Diagnose = diagnose_study
    ) -> None:
        self.doing, self.failure = "starting", ""
        self.diagnosis = known
        self._stop = Event()
        self._thread = Thread(target=self._run, args=(study, diagnose), daemon=True)
        if known is None:
            self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether an answer is still to come."""
        return self.diagnosis is None and not self.failure

    def stop(self) -> None:
        """End it where it next says what it is doing."""
        self._stop.set()

    def wait(self, seconds: float) -> None:
        """Wait for the end, this long at most."""
        if self._thread.ident is not None:
            self._thread.join(seconds)

    def _run(self, study: Study, diagnose: Diagnose) -> None:
        try:
            self.diagnosis = diagnose(study, self._progress)
        except _Stopped:
            self.failure = "stopped"
        except DynidentError as error:
            self.failure = str(error)
        except Exception as error:  # a thread has nobody else to tell
            self.failure = f"unexpected {type(error).__name__}: {error}"

    def _progress(self, doing: object = "", *_: object) -> None:
        if self._stop.is_set():
            raise _Stopped
        self.doing = str(doing)
