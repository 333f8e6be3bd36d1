"""For all tests: no test of times, a browser, small designs, and the catalogue left alone."""

import gc
import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

# What a first example loads takes seconds, and machines differ: a deadline would test both.
settings.register_profile("without deadlines", deadline=None)
settings.load_profile("without deadlines")


# Searches for cycles took a fifteenth of the suite: they go through all modules that are loaded.
gc.set_threshold(200_000, *gc.get_threshold()[1:])


def pytest_collection_finish() -> None:
    """Leave what is loaded by now out of every later search for cycles: it stays."""
    gc.freeze()


@pytest.fixture(autouse=True)
def catalogue_as_it_was():
    """Effects that a test defines join the catalogue for as long as it runs."""
    # Loaded by the workers alone: pytest itself reads this file, and waits for them.
    from dynident.effects import known_effects

    with known_effects.unchanged():
        yield


@pytest.fixture(scope="module")
def browser(tmp_path_factory) -> Iterator:
    """Chromium. No longer than a file: the loop of events that drives it is the thread's only."""
    from playwright.sync_api import sync_playwright

    from browsers import BROWSER, PATIENCE

    home = tmp_path_factory.mktemp("home")
    with sync_playwright() as driver:
        found = driver.chromium.launch(
            executable_path=BROWSER,
            timeout=PATIENCE,
            args=["--no-sandbox", "--disable-gpu"],
            env={**os.environ, "HOME": str(home)},
        )
        yield found
        found.close()
