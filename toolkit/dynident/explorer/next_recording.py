"""What to record next: designed recordings beside the study, else how one is designed."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any
from urllib.parse import quote

from dash import dcc, html
from flask import Flask, Response, abort

from dynident.errors import DynidentError
from dynident.experiment_design import DesignTask
from dynident.experiment_design.open_questions import open_task
from dynident.experiment_design.written_design import (
    MOTION_PAGE,
    DesignFile,
    folders_with_designs,
    motion_page,
    read_design,
)
from dynident.explorer.opened_study import OpenedStudy
from dynident.explorer.page_figures import MOTION_HEIGHT, motion_picture

_MOST = 3  # designs that are shown, the newest; and effects that are named
_CHANGED = (
    "The study has changed since this was designed: what it says of the recordings so far may hold "
    "no more."
)
_OTHER_MOTION = (
    f"{MOTION_PAGE} is not the one that was written with this design, and is not shown: design "
    "the recording anew."
)
# A page that lies beside the study may be anybody's: it runs in an origin of its own, in which it
# can ask nothing of this server, and its address holds a token that opens motions alone.
_SANDBOX = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'unsafe-inline'; img-src data: blob:; connect-src data: blob:; font-src data:; "
    "worker-src blob:"
)


def next_recording(opened: OpenedStudy, motions: str) -> list[Any]:
    """Return the recordings to make next, each with what it settles and its motion.

    Parameters
    ----------
    opened : the study; designs are in folders beside its file.
    motions : token under which they are shown in 3D.

    Returns
    -------
    A section, or nothing where no recording is designed and the diagnosis leaves nothing open.
    """
    folder = opened.study.path.parent
    shown = _folders(folder)[:_MOST]
    parts = [part for one in shown for part in _designed(one, opened, motions)] or _advice(opened)
    head = html.H2("What to record next")
    return [html.Section([head, *parts], className="card")] if parts else []


def _folders(beside: Path) -> tuple[Path, ...]:
    """The folders with designs whose names can be written on a page and in an address."""
    return tuple(one for one in folders_with_designs(beside) if _is_text(one.name))


def _is_text(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:  # bytes that are no UTF-8
        return False
    return True


def _designed(folder: Path, opened: OpenedStudy, motions: str) -> list[Any]:
    robot = opened.study.robot
    try:
        design = read_design(folder, robot.names)
    except DynidentError as error:
        return [html.H3(f"{folder.name}/"), html.P(f"Not shown: {error}")]
    reference = f"{folder.name}/reference.csv is the motion to follow: {_length(design)}."
    found = [
        html.H3(f"{folder.name}/"),
        html.P(design.sentence, className="said"),
        html.P(reference, className="quiet"),
    ]
    if design.study != opened.digest:
        found.append(html.P(_CHANGED, className="quiet"))
    if motion_page(folder) is None:
        if (folder / MOTION_PAGE).exists():
            found.append(html.P(_OTHER_MOTION, className="quiet"))
    else:
        address, words = (
            f"/{motions}/{quote(folder.name)}",
            f"See the motion of {folder.name} in 3D",
        )
        found.append(html.P(html.A(words, href=address, target="_blank", rel="noopener")))
    picture = motion_picture(design.trajectory, robot.names, robot.units)
    still: Any = {"displayModeBar": False, "responsive": True}
    return [*found, dcc.Graph(figure=picture, config=still, style={"minHeight": MOTION_HEIGHT})]


def _length(design: DesignFile) -> str:
    once = f"{design.duration:g} s from rest to rest"
    return f"{once}, {design.repeat} times" if design.repeat > 1 else once


def _advice(opened: OpenedStudy) -> list[Any]:
    """How to have one designed, if there is anything that a motion could tell."""
    found = opened.search.diagnosis
    if found is None or found.wiring or found.impossible:
        return []
    task = open_task(found, DesignTask())
    if task is None:
        return []
    what = "tell apart the effects that these recordings do not"
    if not task.tell:
        hidden = [one.title for one in task.show]
        more = f" and {len(hidden) - _MOST} more" if len(hidden) > _MOST else ""
        what = f"show what these recordings cannot: {', '.join(hidden[:_MOST])}{more}"
    command = f"dynident explain {shlex.quote(opened.study.path.name)} --design next"
    return [html.P([f"A motion may {what}. Have it designed: ", html.Code(command)])]


def serve_motions(server: Flask, token: str, study: Path) -> None:
    """Show the motions of designed recordings, each as its own folder has it, in a sandbox.

    Parameters
    ----------
    server : that asks for the token.
    token : under which motions lie, and nothing else.
    study : the study file; only folders beside it with a designed recording are looked into.
    """

    def motion(name: str) -> Response:
        known = {one.name: one for one in _folders(study.parent)}
        page = motion_page(known[name]) if name in known else None
        if page is None:
            abort(404)
        return Response(page, headers={"Content-Security-Policy": _SANDBOX}, mimetype="text/html")

    server.add_url_rule(f"/{token}/<name>", "motion", motion)
