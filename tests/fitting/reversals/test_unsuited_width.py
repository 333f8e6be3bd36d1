"""A fit says first that a friction width does not suit, though no motion repeats."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from carriage import COULOMB, MASS, SEEDS, WIDTH, model, recorded
from dynident.fitting import LeastSquares
from dynident.fitting.reversals import unsuited_width

NAMED = "the model's friction width"
HZ, FORCE_STD = 0.1, 0.2


@pytest.mark.parametrize("hz", [0.05, HZ, 0.5])
@pytest.mark.slow
def test_a_width_that_suits_is_not_doubted(hz: float) -> None:
    for seed in range(SEEDS):
        assert NAMED not in di.fit(model(), recorded(hz, FORCE_STD, seed)).headline


@pytest.mark.parametrize(
    ("factor", "side"),
    [(0.02, "wider"), (0.1, "wider"), (0.5, "wider"), (1.5, "narrower"), (5, "narrower")],
)
@pytest.mark.slow
def test_a_wrong_width_is_said_where_it_makes_friction_wrong(factor: float, side: str) -> None:
    errors = []
    for seed in range(SEEDS):
        found = di.fit(model(factor * WIDTH), recorded(HZ, FORCE_STD, seed))
        errors.append((found.values[-1] - COULOMB) / found.sigma[-1])
        assert NAMED in found.headline
        assert f"{side} than {number(factor * WIDTH)} m/s at slider" in found.headline
    assert np.abs(errors).min() > 3.0


@pytest.mark.slow
def test_noise_that_hides_the_width_hides_what_it_does() -> None:
    for seed in range(4):
        found = di.fit(model(1.5 * WIDTH), recorded(HZ, 40.0, seed))
        assert not found.headline
        assert abs(found.values[-1] - COULOMB) < 3.0 * found.sigma[-1]


def test_of_a_long_recording_the_first_part_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    data = recorded(HZ, FORCE_STD, 0)
    monkeypatch.setattr(unsuited_width, "_ENOUGH", 2400)
    passes = []
    fit = LeastSquares.fit

    def counted(method: LeastSquares, model: di.Model, data: di.Dataset) -> di.Estimate:
        passes.append(sum(one.samples for one in data.recordings))
        return fit(method, model, data)

    monkeypatch.setattr(LeastSquares, "fit", counted)
    assert NAMED in di.fit(model(2 * WIDTH), data).headline
    assert passes[-2:] == [2400, 2400]
    assert NAMED not in di.fit(model(), data).headline


@pytest.mark.parametrize("errors", ["independent", "correlated"])
def test_a_recipe_is_not_judged(errors) -> None:
    data = recorded(HZ, FORCE_STD, 1)
    assert data.filter is not None
    if errors == "correlated":
        data = replace(data, filter=replace(data.filter, ends="keep"))
    found = di.fit(model(2 * WIDTH), data, LeastSquares(errors=errors))
    assert NAMED not in found.headline and abs(found.values[0] - MASS) < 0.1


def number(value: float) -> str:
    return f"{value:.2g}"
