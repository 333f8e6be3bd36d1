"""Errors are said to be of recordings only where recordings are held out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident import compare, diagnose, fit, read, write
from dynident.evidence import compare_models
from dynident.model import Model
from dynident.recording import Dataset
from dynident.reporting.html import page
from dynident.tables import Table
from synthetic import arm, synthetic, true_values

MODEL = Model(arm()) + "viscous_friction"


@pytest.fixture(scope="module")
def runs():
    truth = true_values(MODEL, Fv__shoulder=1.2, Fv__elbow=0.5)
    return tuple(synthetic(MODEL, truth, seed, rate_hz=250.0, torque_std=0.1) for seed in range(2))


@pytest.mark.parametrize("blocks", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_held_out_are_recordings_or_blocks_of_time(runs, blocks: bool) -> None:
    train, test = Dataset(runs if blocks else runs[:1]), Dataset(() if blocks else runs[1:])
    table, *_ = compare_models({"given": MODEL}, train, test).tables()
    found = diagnose(MODEL, train, None if blocks else test, most=0)
    html = page(found)
    assert isinstance(table, Table)
    assert table.title.endswith("held-out blocks of time" if blocks else "held-out recordings")
    title = found.joint_table().title
    assert title.endswith("held-out blocks of time" if blocks else "held-out data")
    assert ("Torque error on held-out blocks of time" in html) == blocks
    assert ("Torque error on held-out data" in html) == (not blocks)


def test_a_rank_without_a_gap_has_no_infinite_one(runs) -> None:
    """Rows as few as the parameters that they show leave nothing to compare the last one with."""
    whole = fit(MODEL + "rotor_inertia@shoulder", Dataset(runs))
    basis = whole.basis
    assert basis.dependent  # the inertia of the first link takes its place
    none = replace(basis, diagonal=np.array(basis.diagonal[: basis.rank]))
    said = replace(whole, basis=none).summary()
    assert "inf" not in said and f"{basis.rank} of {MODEL.size + 1} parameters identified" in said


def test_recordings_that_a_fit_has_seen_are_not_called_held_out(runs, tmp_path) -> None:
    """The same rows of a file; another window of it is other data."""
    first, other = (
        write(run, tmp_path / f"run{k}.csv") and read(tmp_path / f"run{k}.csv")
        for k, run in enumerate(runs)
    )
    middle = (first.t[0] + first.t[-1]) / 2
    found = fit(MODEL, Dataset((first.replace(window=(first.t[0], middle)),)))
    same = compare(found, Dataset((first.replace(window=(first.t[0], middle)), other)))
    assert same.fitted_to == (first.name,)
    table, *_ = same.tables()
    assert isinstance(table, Table) and table.title == "Relative torque error on recordings"
    assert any(f"Fitted to: {first.name}" in note for note in table.notes)
    for fresh in (first.replace(window=(middle, first.t[-1])), other):
        table, *_ = compare(found, Dataset((fresh,))).tables()
        assert isinstance(table, Table) and "held-out" in table.title
