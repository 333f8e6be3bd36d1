"""A physical parameter has one value behind every filter."""

from __future__ import annotations

import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search.refusal import follows_the_filter
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

MODEL = Model(arm()) + "viscous_friction@elbow"
VISCOUS = next(one for one in MODEL.effects if one.label == "viscous_friction@elbow")
HERE = 0.6


def evidence(viscosity: float) -> Evidence:
    """What a recording shows that does not repeat."""
    values = true_values(MODEL, Fv__elbow=viscosity)
    made = synthetic(MODEL, values, rate_hz=250.0, period=None, torque_std=0.01)
    return Evidence(MODEL, gather(Dataset((made,)), DEFAULTS.noise), criteria=DEFAULTS)


@pytest.mark.parametrize(
    "behind, shares",
    [
        ((1.0, 1.0), ()),
        ((1.25, 1.0), ()),
        ((1.0, 0.8), ()),
        ((1.6, 1.0), ("160 %",)),
        ((1.0, 0.6), ("60 %",)),
        # Each is near the first value, and they are far from each other.
        ((1.3, 0.75), ("130 %", "75 %")),
        ((0.75, 1.3), ("75 %", "130 %")),
    ],
)
def test_any_two_filters_are_compared(behind: tuple[float, float], shares: tuple[str, ...]) -> None:
    here = evidence(HERE)
    fitted = fit_evidence(here, MODEL)
    lower = tuple(evidence(HERE * share) for share in behind)
    said = follows_the_filter(here, lower, fitted, VISCOUS)
    assert bool(said) == bool(shares)
    assert all(f"{share}" in said for share in shares)
