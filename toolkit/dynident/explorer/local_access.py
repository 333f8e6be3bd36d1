"""Who may see the page: whoever has its token, from this machine, under this machine's name.

Motions of designed recordings lie beside the study and may be anybody's pages. A page knows its own
address, and may tell it by going elsewhere: theirs has another token, which opens motions alone.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Callable, Sequence
from typing import Literal

from flask import Flask, Response, abort, request

ADDRESS = "127.0.0.1"
"""The loopback address: nobody on the network reaches it."""

Framing = Literal["alone", "in a notebook"]
"""Whether other pages may show the page in a frame; only a notebook is to."""

_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
    "base-uri 'none'; form-action 'none'; object-src 'none'"
)


def new_token() -> str:
    """Return a token that nobody guesses: the first part of every path."""
    return secrets.token_urlsafe(24)


def guard(
    server: Flask, tokens: Sequence[str], port: Callable[[], int], framing: Framing = "alone"
) -> None:
    """Refuse whatever does not come from the page itself, or is not one of its motions.

    A token is part of the path of every request, so that no cookie is needed, which a frame in a
    notebook would not be given. The names in Host and Origin are compared, too: a page elsewhere
    may have its own name lead to this machine (DNS rebinding).

    Parameters
    ----------
    server : every request to which is looked at.
    tokens : see `new_token`; what one of them opens are the paths that begin with it.
    port : at which it listens, once it does.
    framing : whether frames of other pages may hold it.
    """

    def refuse_others() -> None:
        names = [f"{name}:{port()}" for name in (ADDRESS, "localhost")]
        first = request.path.split("/")[1].encode()
        known = any([hmac.compare_digest(first, token.encode()) for token in tokens])
        origin = request.headers.get("Origin")
        at_home = request.headers.get("Host", "") in names
        from_home = origin is None or origin in [f"http://{name}" for name in names]
        if not (known and at_home and from_home):
            abort(403)

    def say_how_to_show(response: Response) -> Response:
        ancestors = "; frame-ancestors 'none'" if framing == "alone" else ""
        # What is no part of the page brings a narrower one.
        response.headers.setdefault("Content-Security-Policy", _POLICY + ancestors)
        # The address holds a token: no other page is told of it.
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Cache-Control"] = "no-store"
        return response

    server.before_request(refuse_others)
    server.after_request(say_how_to_show)
