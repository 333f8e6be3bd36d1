"""The Panda on its published trajectory: friction and offsets, and no step that does harm."""

from __future__ import annotations

from pathlib import Path

import pytest

from dynident import diagnose, load
from dynident.data_files import find_data
from dynident.errors import FileError

STUDY = Path(__file__).parents[2] / "problems" / "panda" / "study.toml"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*time stamps are jittered")
def test_the_error_falls_below_the_published_one_and_never_rises() -> None:
    try:
        find_data("panda/recording.npz", STUDY.parent)
    except FileError as missing:
        pytest.skip(str(missing))
    study = load(STUDY)
    found = diagnose(study.model, study.train, study.test, propose="never")
    assert found.wiring == ()
    assert found.test_error.before == pytest.approx(0.039, abs=0.002)
    assert found.test_error.after <= 0.0132
    assert all(step.test_error_after <= step.test_error_before for step in found.steps)
    added = [step.effect.label for step in found.steps]
    assert {f"coulomb_friction@joint{k}" for k in range(1, 8)} <= set(added)
    assert "payload" not in added
