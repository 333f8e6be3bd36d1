"""Effects that act where rows do not count: their values are said to be extrapolated."""

from __future__ import annotations

from dynident.diagnosis.nuisances.sticking import without_reversals
from dynident.diagnosis.nuisances.unseen_rows import unseen_notes
from dynident.effects.friction.stribeck_friction import StribeckFriction
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.recording import Dataset
from standing_arm import STOPPED, given, record


def test_an_effect_of_rows_left_out_is_extrapolated_and_others_are_not() -> None:
    whole = Evidence(given(), gather(Dataset(tuple(record(seed, STOPPED) for seed in range(3)))))
    without = without_reversals(whole, ("elbow",), {"elbow": 0.1})
    for speed, said in ((0.02, True), (1.0, False)):
        slow = StribeckFriction("elbow", shape=(speed,)).on(given().robot)
        fitted = fit_evidence(without, given() + slow)
        notes = unseen_notes(without, fitted, (slow.label,))
        assert bool(notes) == said
        assert all("stribeck friction at elbow acts where rows do not count" in n for n in notes)
        assert unseen_notes(without, fitted, ()) == ()
        assert unseen_notes(whole, fit_evidence(whole, given() + slow), (slow.label,)) == ()
