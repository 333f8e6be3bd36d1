"""A low-pass of positions that makes up missing physics is named; one that does no harm is not."""

from __future__ import annotations

import pytest

from dynident import diagnose
from dynident.model import Model
from dynident.recording import Dataset, Filter
from dynident.wiring import check_wiring
from synthetic import arm, synthetic, true_values

MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
TRUTH = true_values(MODEL, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.5, Fc__elbow=0.6)
QUICK, SLOW = 1.25, 8.0  # s, of motions of up to 4 and 0.6 Hz
NARROW = Filter(position_cutoff_hz=5.0, cutoff_hz=5.0)
NO_FILTER = Filter()


def recorded(period: float, filter: Filter | None, model: Model = MODEL) -> Dataset:
    truth = TRUTH if model is MODEL else true_values(model, d__elbow=0.02)
    runs = tuple(
        synthetic(model, truth, seed, period=period, position_std=5e-5, torque_std=0.1)
        for seed in range(3)
    )
    return Dataset(runs, filter)


@pytest.mark.parametrize(
    ("period", "filter", "mend"),
    [
        (QUICK, NARROW, ("position_cutoff_hz = 40",)),
        (SLOW, NARROW, ()),
        (QUICK, Filter(position_cutoff_hz=30.0, cutoff_hz=10.0, rate_hz=40.0), ()),
        (SLOW, NO_FILTER, ("position_cutoff_hz = 40", "cutoff_hz = 18", "rate_hz = 50")),
        (QUICK, None, ()),
    ],
)
def test_it_is_named_where_another_leaves_far_less_of_the_same_torque(
    period: float, filter: Filter | None, mend: tuple[str, ...]
) -> None:
    found = check_wiring(MODEL, recorded(period, filter))
    assert [fault.kind for fault in found] == ["position_filter"] * bool(mend)
    for fault in found:
        assert fault.joints == ("shoulder", "elbow") and fault.mend == mend
        assert "of the same torque with positions low-passed at 40 Hz" in fault.sentence


def test_missing_physics_is_not_laid_to_the_filter() -> None:
    """A delay shows more the quicker the motion is, behind any filter."""
    delayed = MODEL + "torque_delay@elbow"
    filter = Filter(position_cutoff_hz=30.0, cutoff_hz=15.0, rate_hz=50.0)
    assert check_wiring(MODEL, recorded(QUICK, filter, delayed)) == ()


@pytest.mark.slow
def test_no_effect_is_added_behind_a_filter_that_makes_it_up() -> None:
    """Of this healthy arm a joint that gives way used to be added."""
    data = recorded(QUICK, NARROW)
    train, test = (Dataset(some, NARROW) for some in (data.recordings[:2], data.recordings[2:]))
    found = diagnose(MODEL, train, test, propose="never")
    assert [fault.kind for fault in found.wiring] == ["position_filter"]
    assert not found.steps and "position_cutoff_hz = 40" in found.sentence
