"""The study of noise in a hundred inputs: what is drawn is what is said, and what it shows."""

from __future__ import annotations

import numpy as np
import pytest

from problem_scripts import script

table = script("noisy_regression", "table")
RELEVANT = table.RELEVANT


def cell(snr: float, redundant: int, irrelevant: int):
    return table.CELLS[table.CELLS.index(table.Cell(snr, redundant, irrelevant))]


def test_the_eight_cells_have_a_hundred_inputs_each() -> None:
    assert len(table.CELLS) == 8
    for one in table.CELLS:
        assert RELEVANT + one.redundant + one.irrelevant == table.PUBLISHED["inputs"]
        assert table.draw(one, 20, 0).X.shape == (20, table.PUBLISHED["inputs"])


def test_redundant_inputs_are_convex_combinations_of_the_noisy_ones() -> None:
    one = cell(2.0, 30, 60)
    X = table.draw(one, 400, 3).X
    relevant, redundant = X[:, :RELEVANT], X[:, RELEVANT : RELEVANT + one.redundant]
    weights = np.linalg.lstsq(relevant, redundant, rcond=None)[0]
    assert redundant == pytest.approx(relevant @ weights, rel=1e-9, abs=1e-9)
    assert np.all(weights > -1e-9)
    assert weights.sum(axis=0) == pytest.approx(1.0)
    others = X[:, RELEVANT + one.redundant :]
    assert np.abs(np.corrcoef(relevant.T, others.T)[:RELEVANT, RELEVANT:]).max() < 0.25


@pytest.mark.parametrize("snr", table.PUBLISHED["input_snr"])
@pytest.mark.slow
def test_signals_and_noise_have_the_stated_ratios(snr: float) -> None:
    rows = 200_000
    one = cell(snr, 30, 60)
    sample = table.draw(one, rows, 1)
    total = sample.X.var(axis=0)[: RELEVANT + 1]
    assert total[:RELEVANT] == pytest.approx((1.0 + snr) * sample.noise[:RELEVANT], rel=0.03)
    # The clean output has output_snr parts of its variance, the noise one.
    _, clean = sample.tests["noiseless"]
    snr_out = table.PUBLISHED["output_snr"]
    assert sample.y.var() == pytest.approx((1.0 + 1.0 / snr_out) * clean.var(), rel=0.12)


def test_a_trial_depends_on_its_seed_alone() -> None:
    one = cell(5.0, 60, 30)
    first, again, other = (table.draw(one, 50, seed) for seed in (4, 4, 5))
    assert np.array_equal(first.X, again.X)
    assert not np.array_equal(first.X, other.X)


@pytest.mark.slow
def test_a_trial_judges_every_method_on_both_test_sets() -> None:
    """Even with few rows every method predicts better than the mean does, and none is perfect."""
    found = table.trial(cell(5.0, 30, 60), 400, 100)
    assert set(found) == {(method, kind) for method in table.METHODS for kind in table.SETS}
    for (method, kind), error in found.items():
        least = 1.0 / (1.0 + table.PUBLISHED["output_snr"]) if kind == "noisy" else 0.0
        assert least < error < 1.0, (method, kind)


def test_the_change_against_ols_has_its_own_standard_error() -> None:
    """Trials are hard or easy for both: that is no doubt of their ratio."""
    one = table.CELLS[0]
    changes, doubts = [], []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        plain = 10.0 ** rng.normal(0.0, 0.3, 30)
        own = 0.6 * plain * (1 + 0.05 * rng.standard_normal(30))
        study = table.Study({(one, "OLS", "noisy"): plain, (one, "Bayes", "noisy"): own})
        change, doubt = study.change(one, "Bayes", "noisy")
        back, _ = study.change(one, "OLS", "noisy", "Bayes")
        assert (1 + change / 100) * (1 + back / 100) == pytest.approx(1.0)
        changes.append(change)
        doubts.append(doubt)
    assert np.mean(changes) == pytest.approx(-40.0, abs=0.2)
    assert np.mean(doubts) == pytest.approx(np.std(changes), rel=0.15)


def test_tables_and_bars_show_every_cell_and_method() -> None:
    rng = np.random.default_rng(0)
    found = table.Study(
        {
            (one, method, kind): rng.uniform(0.1, 0.2, 3)
            for one in table.CELLS
            for method in table.METHODS
            for kind in table.SETS
        }
    )
    for kind in table.SETS:
        assert len(found.table(kind).rows) == len(table.CELLS) * len(table.METHODS)
    assert [row[0] for row in found.rivals().rows] == [one.name for one in table.CELLS]
    # The inputs, the claim, and every method but the two that are Bayes.
    assert len(found.rivals().columns) == 2 + len(table.METHODS) - 2
    bars = [bar for panel in table.figure(found).axes for bar in panel.patches]
    assert len(bars) == len(table.CELLS) * len(table.METHODS)
