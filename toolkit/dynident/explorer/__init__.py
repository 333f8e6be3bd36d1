"""The loop by hand, on a local page: compare, see what is missing, switch it on, write it down.

In: a study. Out: a page on the loopback address, under a token, that writes nothing but effects
into that study, and these on a click only. `dynident open STUDY` serves it from the command line,
`explore` in a notebook. It needs Dash: `pip install "dynident[app]"`.

- `switched_fit`: the model with the effects that are switched on, fitted and judged at once.
- `effect_choices`: what a diagnosis offers to switch on; `search_thread` runs it meanwhile.
- `opened_study`: a study as it was read, and written to while it is still that.
- `tab_state`: what one tab of the browser has chosen.
- `page`, of `page_parts`, `page_figures` and `page_answers`: what a tab shows.
- `next_recording`: designed recordings beside the study, with what each settles.
- `local_access`, `local_server`: who may see it, and from where.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

from dynident.errors import DynidentError

if TYPE_CHECKING:
    from dynident.diagnosis import Diagnosis
    from dynident.explorer.local_server import LocalServer
    from dynident.study import Study

__all__ = ["explore", "require_app"]


def require_app() -> None:
    """Refuse to go on without the libraries of the page.

    Raises
    ------
    DynidentError
        If they are not installed.
    """
    if not all(map(importlib.util.find_spec, ("dash", "dash_bootstrap_components"))):
        raise DynidentError("the page needs Dash", remedy="pip install 'dynident[app]'")


def explore(study: Study, diagnosis: Diagnosis | None = None) -> LocalServer:
    """Show a study's page in a notebook; the last line of a cell displays what is returned.

    Parameters
    ----------
    study : as `load` reads it; effects that are switched on are written to its file, on a click.
    diagnosis : of that study, where there is one; else it is made beside the page.

    Returns
    -------
    The page; `stop()` ends it.

    Raises
    ------
    DynidentError
        If Dash is not installed, the study's file has changed since it was loaded, or the file has
        other effects than the model.

    Examples
    --------
    >>> study = di.load("study.toml")
    >>> d = di.diagnose(study.model, study.train, study.test)
    >>> di.explorer.explore(study, d)
    """
    require_app()
    from dynident.explorer.local_server import LocalServer
    from dynident.explorer.opened_study import OpenedStudy, StudyVersions
    from dynident.study import load, study_digest

    if study_digest(study.path) != study.digest:
        raise DynidentError("has changed since it was loaded", str(study.path), "load it again")

    def read() -> Study:
        return load(study.path, modules=study.modules)

    labels = [[effect.label for effect in one.model.effects] for one in (read(), study)]
    if labels[0] != labels[1]:
        what = "has other effects than the model that is shown"
        raise DynidentError(what, str(study.path), "add them, or load it again")
    versions = StudyVersions(study.path, read, OpenedStudy(study, diagnosis))
    server = LocalServer(versions, "in a notebook")
    server.start()
    return server
