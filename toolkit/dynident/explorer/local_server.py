"""The page served on this machine: until Ctrl-C, or beside a notebook."""

from __future__ import annotations

import signal
import time
from html import escape
from threading import Thread

from flask import Flask
from werkzeug.serving import WSGIRequestHandler, make_server

from dynident.explorer.local_access import ADDRESS, Framing, guard, new_token
from dynident.explorer.next_recording import serve_motions
from dynident.explorer.opened_study import StudyVersions
from dynident.explorer.page import page

_HEIGHT = 900  # pixels of the frame in a notebook
_LOOK = 0.2  # s between two looks at whether it is to end


class _Quiet(WSGIRequestHandler):
    """Says nothing of single requests, whose paths hold the token."""

    def log(self, type: str, message: str, *args: object) -> None:
        pass


class LocalServer:
    """A study's page at an address of its own.

    Parameters
    ----------
    versions : the study.
    framing : whether a notebook may show it in a frame.

    Attributes
    ----------
    flask : the application behind it.
    token : without which nothing is told of the study.
    motions : token of the motions of its designed recordings.
    """

    def __init__(self, versions: StudyVersions, framing: Framing = "alone") -> None:
        self.versions, self.token, self.motions = versions, new_token(), new_token()
        self.flask = Flask("dynident", static_folder=None)
        guard(self.flask, (self.token, self.motions), lambda: self.port, framing)
        self.flask.add_url_rule(f"/{self.token}/alive", "alive", lambda: ("", 204))
        serve_motions(self.flask, self.motions, versions.path)
        page(self.flask, self.token, versions, self.motions)
        self._server = make_server(ADDRESS, 0, self.flask, threaded=True, request_handler=_Quiet)
        self._thread: Thread | None = None

    @property
    def port(self) -> int:
        """At which it listens: one that was free."""
        return self._server.server_port

    @property
    def url(self) -> str:
        """What is opened in a browser."""
        return f"http://{ADDRESS}:{self.port}/{self.token}/"

    def serve(self) -> None:
        """Answer until Ctrl-C.

        What Ctrl-C raises is lost where it arrives while an object is finalised, as that of a
        request is in the thread that starts the requests. So it is noted here, and looked at.
        A shell's background job ignores Ctrl-C, and goes on.
        """
        noted: list[int] = []  # an Event has a lock, for which a second Ctrl-C would wait for ever
        before = signal.getsignal(signal.SIGINT)
        if callable(before):
            signal.signal(signal.SIGINT, lambda number, _: noted.append(number))
        try:
            serving = self.start()
            while serving.is_alive() and not noted:
                time.sleep(_LOOK)
        finally:
            self.stop()
            if callable(before):  # after the end: a second Ctrl-C would break it off
                signal.signal(signal.SIGINT, before)

    def start(self) -> Thread:
        """Answer beside whatever else goes on; in the thread that is returned."""
        self._thread = Thread(target=self._answer, daemon=True)
        self._thread.start()
        return self._thread

    def _answer(self) -> None:
        try:
            self._server.serve_forever(poll_interval=_LOOK)
        finally:
            self.versions.stop()
            self._server.server_close()

    def stop(self) -> None:
        """End it; what was not written is lost."""
        if self._thread is None:
            self._server.server_close()
            return
        self._server.shutdown()
        self._thread.join()

    def _repr_html_(self) -> str:
        """Show the page in a notebook."""
        url = escape(self.url)
        return (
            f'<iframe src="{url}" title="dynident" width="100%" height="{_HEIGHT}" '
            'style="border: 1px solid #888"></iframe>'
            "<p>It runs until the notebook's kernel ends, or until <code>.stop()</code> is called "
            "on this object.</p>"
        )
