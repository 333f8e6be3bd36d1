"""For all designs of recordings: where their searches begin."""

import pytest

from dynident.experiment_design import motion_program


@pytest.fixture
def few_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    """Begin the search at the best of few random motions, for what holds wherever it begins.

    Most of the time of a small design goes into trying many.
    """
    monkeypatch.setattr(motion_program, "_TRIED", 15)
