"""How often answers like this one were right."""

from __future__ import annotations

import pytest

from dynident.diagnosis import track_record as module
from dynident.diagnosis.track_record import LARGE, TrackRecord, kind_of, track_record


@pytest.mark.parametrize(
    ("verdict", "named", "said"),
    [
        ("nothing_missing", False, "nothing_missing"),
        ("explained", True, "explained"),
        ("unexplained", True, "in_part"),
        ("unexplained", False, "none_of_these"),
    ],
)
def test_answers_are_of_four_kinds_and_two_sizes(verdict: str, named: bool, said: str) -> None:
    assert kind_of(verdict, effects=int(named), over_floor=1.0) == (said, "small")
    assert kind_of(verdict, effects=int(named), over_floor=LARGE) == (said, "large")


def test_a_record_states_its_counts_and_their_interval(monkeypatch) -> None:
    monkeypatch.setattr(module, "_COUNTS", {("explained", "large"): (45, 50)})
    found = track_record("explained", effects=1, over_floor=2.0)
    assert found is not None and found == TrackRecord("explained", 45, 50)
    # Wilson's interval of 45 in 50, from his formula with z = 1.96.
    assert found.interval == pytest.approx((0.7864, 0.9565), abs=1e-4)
    assert "Of 50 answers" in str(found) and "45 were right" in str(found)
    assert "2 to 7 joints, whose recorded motion repeats" in str(found)
    assert "79 % to 96 %" in str(found) and "truly missing" in str(found)
    assert track_record("explained", effects=1, over_floor=1.0) is None
    assert track_record("explained", effects=module.MOST_EFFECTS, over_floor=2.0) == found
    assert track_record("explained", effects=module.MOST_EFFECTS + 1, over_floor=2.0) is None


def test_what_is_shipped_is_a_count_of_many() -> None:
    assert module._COUNTS
    for right, cases in module._COUNTS.values():
        assert 0 <= right <= cases
        assert cases >= module.LEAST_CASES
