"""The command that opens a study in the browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path

import click

from dynident.cli.group import commands
from dynident.cli.output import say
from dynident.cli.work import STUDY, load_study, permission_given


@commands.command("open")
@STUDY
@click.option("--no-browser", is_flag=True, help="Print the address, and open nothing.")
def open_study(study: Path, no_browser: bool) -> None:
    """Do the loop by hand on a page in the browser: see, switch on, refit, write.

    Measured against predicted torque, residual maps, and what the diagnosis finds missing, with a
    switch each: the held-out error falls as effects are switched on. The study is written to on a
    click, and nothing else is. Only this machine reaches the page, under an address that nobody
    guesses. Ctrl-C ends it. It needs Dash: pip install 'dynident[app]'.

    Example: dynident open study.toml
    """
    from dynident.explorer import require_app

    require_app()
    from dynident.explorer.local_server import LocalServer
    from dynident.explorer.opened_study import OpenedStudy, StudyVersions
    from dynident.study import load

    modules = permission_given()
    first = OpenedStudy(load_study(study))
    server = LocalServer(StudyVersions(study, lambda: load(study, modules=modules), first))
    say(f"{study} is open at {server.url} (Ctrl-C ends it)")
    if not no_browser:
        webbrowser.open(server.url)
    server.serve()
    say("closed; what was not written is gone")
    # Requests and the search may still be at work, inside libraries that an interpreter which is
    # taken down under them aborts or waits for. What they make is gone anyway.
    sys.stderr.flush()
    os._exit(0)
