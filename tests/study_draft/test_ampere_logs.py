"""Headerless logs in amperes, with a jittered clock and a known load: begun by `init` alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import ampere_logs
from dynident.study import load
from dynident.study_draft import CarriedLoad, LogFacts, draft_study
from dynident.study_draft.guesses.drive_unit import drive_sizes
from dynident.wiring.assignment import DEGREE
from study_files import csv_text, recording
from synthetic import ARM, arm


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    ampere_logs.write_logs(folder, 30.0, 2)
    return folder


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*jittered")
def test_the_draft_tells_what_the_study_by_hand_does(logs: Path) -> None:
    files = [logs / f"{log.name}.txt" for log in ampere_logs.LOGS]
    facts = LogFacts(loads=(CarriedLoad(pattern="run_load_*", mass=ampere_logs.MASS),))
    draft = draft_study(logs / "arm.urdf", files, facts=facts)
    drafted = load(draft.write(logs / "drafted.toml"))
    by_hand = load(logs / "by_hand.toml")
    assert drafted.model.effects == by_hand.model.effects
    assert [len(one) for one in (drafted.train, drafted.test)] == [2, 1]
    assert drafted.train.recordings[0].period == pytest.approx(10.0, rel=1e-4)
    for one in (drafted, by_hand):
        assert one.drives is not None
        assert set(one.drives.findings) == {"identified"}
        # Stribeck friction is in the data, and not in the models: gains are off by more than noise.
        np.testing.assert_allclose(one.drives.gains, ampere_logs.GAINS, rtol=0.05)
        (crate,) = one.drives.loads
        np.testing.assert_allclose(crate.values[1:4], [0.01, -0.03, 0.09], atol=0.005)
    assert drafted.drives is not None and by_hand.drives is not None
    np.testing.assert_allclose(drafted.drives.gains, by_hand.drives.gains, rtol=2e-3)


def test_files_carry_the_loads_that_are_said(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    files = [tmp_path / f"{log.name}.csv" for log in ampere_logs.LOGS]
    for seed, file in enumerate(files):
        file.write_text(csv_text(seed))
    facts = LogFacts(loads=(CarriedLoad(pattern="run_test*"), CarriedLoad(pattern="*load_1.csv")))
    draft = draft_study(tmp_path / "arm.urdf", files, facts=facts)
    # One with each load is fitted, although its name says that it judges.
    assert [(one.load, one.use) for one in draft.recordings] == [
        ("", "train"),
        ("load2", "train"),
        ("load1", "train"),
    ]
    assert draft.loads == {"load1": None, "load2": None}
    assert "[loads.load1]" in draft.text(tmp_path)


POSITIONS, CURRENTS = slice(7, 13), slice(19, 25)
"""Columns of the logs."""


def without_speeds(logs: Path, folder: Path, order: Sequence[int]) -> list[Path]:
    """The logs with clock, positions in degrees and currents alone, these in some order."""
    found = []
    for log in ampere_logs.LOGS:
        x = np.loadtxt(logs / f"{log.name}.txt")
        rows = np.hstack([x[:, POSITIONS] / DEGREE, x[:, CURRENTS]])[:, list(order)]
        found.append(folder / f"{log.name}.txt")
        np.savetxt(found[-1], np.hstack([x[:, :1], rows]), fmt="%.9g")
    return found


SIDE_BY_SIDE = tuple(k for j in range(6) for k in (j, 6 + j))
STATED = {
    f"{signal}.{joint}": f"column{2 * j + at}"
    for at, signal in ((2, "q"), (3, "tau"))
    for j, joint in enumerate(ampere_logs.JOINTS)
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*jittered")
@pytest.mark.parametrize(
    ("order", "columns"), [(range(12), {}), (SIDE_BY_SIDE, STATED)], ids=["found", "said"]
)
def test_columns_without_names_and_speeds_and_in_degrees(
    logs: Path, tmp_path: Path, order: Sequence[int], columns: dict[str, str]
) -> None:
    files = without_speeds(logs, tmp_path, order)
    loads = (CarriedLoad(pattern="run_load_*", mass=ampere_logs.MASS),)
    if columns:
        columns = {ours: f"{x}*pi/180" if ours[0] == "q" else x for ours, x in columns.items()}
    draft = draft_study(logs / "arm.urdf", files, facts=LogFacts(loads=loads, columns=columns))
    drafted = load(draft.write(tmp_path / "drafted.toml"))
    assert drafted.drives is not None
    np.testing.assert_allclose(drafted.drives.gains, ampere_logs.GAINS, rtol=0.05)


def test_sizes_tell_amperes_from_newton_metres() -> None:
    one = recording(1)
    plain = drive_sizes(arm(), [one])
    assert plain.are_newton_metres
    np.testing.assert_allclose(plain.sizes, 1.0, rtol=0.1)
    amperes = drive_sizes(arm(), [one.replace(tau=one.tau / [12.0, -7.0])])
    assert not amperes.are_newton_metres
    np.testing.assert_allclose(amperes.sizes, [12.0, -7.0], rtol=0.1)
    assert drive_sizes(arm(), [one.replace(tau=1000 * one.tau)]).are_newton_metres
    noise = np.random.default_rng(1).normal(size=one.tau.shape)
    assert drive_sizes(arm(), [one.replace(tau=noise)]).are_newton_metres
