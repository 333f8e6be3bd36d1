"""Iterations whose estimates cannot be simulated: damped, or stopped with the last good one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from dynident.errors import SimulationError
from dynident.fitting import IV
from dynident.fitting.history import Ending
from dynident.fitting.instrumental.source import prepared
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording
from synthetic import arm, synthetic


@dataclass(frozen=True)
class Stubborn:
    """The true motion as instruments, for estimates that pass a test."""

    true: Recording
    passes: Callable[[np.ndarray], bool]
    name: str = "stub"

    def prepare(self, model, dataset, guess):
        return StubbornSource(self, prepared(dataset))


class StubbornSource:
    iterates = True
    notes = ()
    noise_share = 1.0

    def __init__(self, settings, measured):
        self.settings, self.measured = settings, measured
        self.asked = 0

    def at(self, values):
        self.asked += 1
        if not self.settings.passes(values):
            raise SimulationError("it falls apart")
        true = self.settings.true
        # Another motion each time, or the second iteration would be the last.
        other = true.replace(q=true.q * (1.0 + 0.05 * self.asked))
        return prepared(replace(self.measured, recordings=(other,)))

    def verdict(self):
        return ""


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


@pytest.fixture(scope="module")
def true(model) -> Recording:
    values = model.given_values()
    values[model.base.rank :] = (1.0, 0.5)
    return synthetic(model, values, 1, rate_hz=200.0, duration=8.0)


def dataset(true: Recording) -> Dataset:
    return Dataset((true,), Filter())


def test_the_way_to_an_estimate_is_halved(model, true):
    """Only estimates with little friction can be simulated: half of the way is taken, no more."""
    friction = model.names.index("Fv@shoulder")
    source = Stubborn(true, lambda values: bool(values[friction] < 0.6))
    found = IV(source, start="description", rounds=4).fit(model, dataset(true))
    assert found.history is not None
    assert [one.way.share for one in found.history.rounds][:2] == [1.0, 0.5]
    # The estimate itself was never simulated: that is no fixed point.
    assert found.history.ending is Ending.ROUNDS_EXHAUSTED
    assert "approached" in found.history.message


def test_the_last_good_estimate_is_kept(model, true):
    """The second estimate cannot be simulated, nor any part of the way to it."""
    friction, asked = model.names.index("Fv@shoulder"), []

    def passes(values):
        asked.append(values[friction])
        return len(asked) < 3

    estimate = IV(Stubborn(true, passes), start="description").fit(model, dataset(true))
    assert estimate.history is not None and estimate.history.ending is Ending.NOT_SIMULATED
    assert estimate.value("Fv@shoulder") == asked[1]
    assert len(estimate.history.rounds) == 1
    assert "it falls apart" in estimate.history.message
    assert any("no motion" in note for note in estimate.notes)


def test_a_start_is_never_passed_off_as_an_estimate(model, true):
    friction = model.names.index("Fv@shoulder")
    source = Stubborn(true, lambda values: bool(values[friction] < 1e-3))
    with pytest.raises(SimulationError, match=r"first estimate has no motion.*it falls apart"):
        IV(source, start="description").fit(model, dataset(true))


def test_a_start_that_cannot_be_simulated_is_an_error(model, true):
    with pytest.raises(SimulationError, match="it falls apart"):
        IV(Stubborn(true, lambda values: False)).fit(model, dataset(true))


def test_too_few_rounds_are_told(model, true):
    noisy = true.replace(q=true.q + 1e-5 * np.random.default_rng(0).standard_normal(true.q.shape))
    source = Stubborn(true, lambda values: True)
    method = IV(source, start="regular", rounds=1)
    found = method.fit(model, dataset(noisy))
    assert found.history is not None and found.history.ending is Ending.ROUNDS_EXHAUSTED
    assert "not converged" in found.status


def test_progress_is_told(model, true):
    heard = []
    method = IV(Stubborn(true, lambda values: True), progress=lambda *said: heard.append(said))
    method.fit(model, dataset(true))
    assert heard and all(done <= total for _, done, total in heard)
