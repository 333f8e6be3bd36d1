"""A shape is found from wherever the search for it begins."""

from __future__ import annotations

import numpy as np

from dynident.diagnosis.search.candidate_shapes import reshaped
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from slides import at, gantry, recorded

TRUE = 2e-4
"""m"""


def test_a_search_with_derivatives_goes_on_where_it_ends_at_its_reach() -> None:
    """Which is short, so that no other peak leads it astray; it had been taken for the best."""
    hidden = at("presliding@x", TRUE)
    evidence = Evidence(gantry(), gather(recorded(hidden, (6.0,), (2,))))
    others, found = fit_evidence(evidence, gantry()), []
    for start in (1e-4, 1e-3, 3e-3):
        given = at("presliding@x", start)
        whole = fit_evidence(evidence, gantry() + given)
        found.append(reshaped(evidence, others, whole, given).effect.shape[0])
    np.testing.assert_allclose(found, found[0], rtol=1e-3)
    assert 0.8 < found[0] / TRUE < 1.25
