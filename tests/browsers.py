"""Pages in a real browser, as a reader sees them on a desk and on a phone."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import pytest
from axe_playwright_python.sync_playwright import Axe

# The shell has the same engine without a window, which costs a processor's time to draw.
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, _NAMES)), None)
PHONE, DESK = 390, 1280
"""Widths of a screen in pixels."""
HEIGHT = 844
PATIENCE = 120_000
"""Milliseconds: a slow machine gets there, a page that hangs does not."""

needs_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"none of {', '.join(_NAMES)} is on the path"
)


@dataclass
class Tab:
    """A page that was opened, with what it has complained of and asked for."""

    page: Any
    width: int
    home: str
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    pending: set[Any] = field(default_factory=set)

    def go(self, url: str) -> None:
        """Open another page in the place of this one."""
        self.home = url
        self.page.goto(url)

    def wait_for_answers(self) -> None:
        """Wait until all that was asked for has been answered, and nothing follows from it."""
        seen = -1
        while self.pending or seen < len(self.requests):
            seen = len(self.requests)
            self.page.wait_for_timeout(200)

    def assert_quiet(self) -> None:
        """Nothing was complained of, and nothing but the page and its parts was asked for."""
        assert self.complaints == []
        assert [one for one in self.requests if not one.startswith((self.home, "data:"))] == []

    def assert_fits(self) -> None:
        """Nothing sticks out to the side."""
        assert self.page.evaluate("document.documentElement.scrollWidth") <= self.width, self.home


OneTab = TypeVar("OneTab", bound=Tab)


def opened(browser: Any, url: str, width: int, kind: type[OneTab]) -> OneTab:
    """Open a page; a phone is touched, and what is a file needs no network."""
    phone = width == PHONE
    context = browser.new_context(
        viewport={"width": width, "height": HEIGHT},
        has_touch=phone,
        is_mobile=phone,
        offline=url.startswith("file:"),
    )
    found = kind(context.new_page(), width, url)
    found.page.on("console", lambda message: found.complaints.append(message.text))
    found.page.on("pageerror", lambda error: found.complaints.append(str(error)))
    found.page.on("dialog", lambda one: found.complaints.append(one.message))
    found.page.on("request", lambda request: found.requests.append(request.url))
    found.page.on("request", lambda request: found.pending.add(request))
    found.page.on("requestfinished", lambda request: found.pending.discard(request))
    found.page.on("requestfailed", lambda request: found.pending.discard(request))
    found.page.set_default_timeout(PATIENCE)
    found.page.goto(url)
    return found


def serious_faults(page: Any, colours: bool = True) -> Sequence[tuple[str, list[str]]]:
    """What axe-core finds that keeps readers out: its name, and the first places.

    Parameters
    ----------
    page : as it is now.
    colours : whether to look for text that stands out too little, which takes most of the time.
    """
    rules = {"color-contrast": {"enabled": colours}}
    options = {"resultTypes": ["violations"], "rules": rules}
    found = Axe().run(page, options=options).response["violations"]
    serious = [one for one in found if one["impact"] in ("serious", "critical")]
    return [(one["id"], [node["html"][:90] for node in one["nodes"][:3]]) for one in serious]
