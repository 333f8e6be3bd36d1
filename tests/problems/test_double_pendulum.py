"""A measured double pendulum: inertias that do not depend on the filter."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.fitting.instrumental import Filtered
from problem_scripts import script

ROOT = Path(__file__).parents[2]
FILE = Path("dfki_double_pendulum_C0") / "recordings.npz"
FOLDER = Path(os.environ.get("DYNIDENT_DATA", ROOT.parent / "shared" / "data"))
pytestmark = pytest.mark.skipif(
    not (FOLDER / FILE).is_file(), reason=f"no {FILE} in DYNIDENT_DATA or ../shared/data"
)
cutoffs = script("double_pendulum", "cutoffs")
CUTOFFS, AUTHORS = cutoffs.PUBLISHED["cutoffs"], cutoffs.PUBLISHED["authors"]
NARROW, WIDE = 10.0, 40.0


@cache
def study() -> di.Study:
    return cutoffs.load()


@cache
def least_squares() -> dict[str, np.ndarray]:
    return cutoffs.sweep(study(), di.LeastSquares(), (NARROW, WIDE))


@cache
def instruments() -> dict[str, np.ndarray]:
    method = di.IV(Filtered(CUTOFFS["instruments_hz"]))
    return cutoffs.sweep(study(), method, (NARROW, WIDE))


def test_every_record_is_read_by_its_name() -> None:
    recordings = study().train.recordings
    assert len(recordings) == 9
    assert [r.name for r in recordings][-1] == "trajectory_13"
    assert len({r.provenance.sha256 for r in recordings}) == 1
    assert all(r.jitter < 1e-6 for r in recordings)
    assert 550 < recordings[-1].rate_hz < 600 and 490 < recordings[0].rate_hz < 510


@pytest.mark.slow
def test_least_squares_loses_the_inertias_as_the_filter_is_opened() -> None:
    for name in cutoffs.INERTIAL:
        narrow, wide = least_squares()[name]
        assert wide < (1.0 - CUTOFFS["least_fall"]) * narrow, name
    at = [CUTOFFS["hz"].index(hz) for hz in (NARROW, WIDE)]
    expected = np.array(CUTOFFS["least_squares_J2"])[at]
    assert least_squares()["J2"] == pytest.approx(expected, abs=CUTOFFS["tolerance"])


@pytest.mark.slow
def test_instruments_give_the_same_inertias_at_every_cutoff() -> None:
    for name in cutoffs.INERTIAL:
        narrow, wide = instruments()[name]
        assert abs(wide / narrow - 1.0) < CUTOFFS["largest_change"], name
    at = [CUTOFFS["hz"].index(hz) for hz in (NARROW, WIDE)]
    expected = np.array(CUTOFFS["instruments_J2"])[at]
    assert instruments()["J2"] == pytest.approx(expected, abs=CUTOFFS["tolerance"])


@pytest.mark.parametrize("name", ["J1", "J2", "m2r2", "g1"])
@pytest.mark.slow
def test_they_are_near_to_the_authors_fits(name: str) -> None:
    low, high = sorted(AUTHORS[name])
    assert 0.96 * low < instruments()[name][0] < 1.04 * high


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*time stamps are jittered")
def test_nothing_is_carried_and_nothing_is_invented() -> None:
    read = di.load(ROOT / "problems" / "double_pendulum" / "study.toml")
    found = di.diagnose(read.model, read.train)
    assert found.steps == () and found.wiring == () and found.verdict == "nothing_missing"
    assert not any(one.status == "material" for one in found.candidates)
    why = {one.effect.label: one.finding for one in found.candidates}
    assert "changes with the filter" in why["drive_gain@elbow"]
    assert "changes with the filter" in why["load_friction@elbow"]
    assert why["payload"] != "significant and relevant"
