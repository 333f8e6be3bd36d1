"""A low-pass that hides motion looks like missing physics."""

from __future__ import annotations

from dataclasses import replace

import pytest

from brief_search import BRIEF
from dynident.diagnosis import diagnose
from dynident.model import Model
from dynident.recording import Dataset, Filter, suited_filter, suited_instead
from dynident.reporting.headline import headline
from dynident.reporting.next_steps import next_steps
from synthetic import arm, synthetic, true_values


def recordings(seeds: range) -> Dataset:
    model = Model(arm()) + "viscous_friction" + "coulomb_friction"
    known = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0, "Fc__shoulder": 2.0, "Fc__elbow": 1.5}
    values = true_values(model, **known)
    return Dataset(
        tuple(
            synthetic(
                model,
                values,
                seed,
                duration=24.0,
                rate_hz=500.0,
                position_std=1e-6,
                torque_std=0.01,
            )
            for seed in seeds
        )
    )


@pytest.mark.parametrize(("cutoff_hz", "hides"), [(1.5, True), (None, False)])
@pytest.mark.slow
def test_the_filter_is_named_before_the_pictures(cutoff_hz: float | None, hides: bool) -> None:
    train, test = recordings(range(2)), recordings(range(2, 3))
    filter = suited_filter(train.recordings)
    if cutoff_hz is not None:
        filter = replace(filter, position_cutoff_hz=cutoff_hz)
    model = Model(arm()) + "viscous_friction" + "coulomb_friction"
    train, test = (replace(one, filter=filter) for one in (train, test))
    found = diagnose(model, train, test, propose="never", most=1, criteria=BRIEF)
    assert (found.hiding_filter is not None) == hides
    first, said = next_steps(found)[0], headline(found)
    assert ("out of [filter]" in first.what) == hides
    assert ("hides motion" in said.sentence) == hides
    assert (said.mark == "✓") != hides
    assert any("hides motion" in one for one in found.notes) == hides


def test_a_filter_that_suits_or_is_higher_hides_nothing() -> None:
    one = recordings(range(1)).recordings
    suited = suited_filter(one).position_cutoff_hz
    assert isinstance(suited, float)
    assert suited_instead(0.5 * suited, one) == suited
    assert suited_instead(suited, one) is None
    assert suited_instead(3.0 * suited, one) is None
    assert Filter().position_cutoff_hz is None
