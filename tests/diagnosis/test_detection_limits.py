"""What a diagnosis says it would have seen, against effects of that size."""

from __future__ import annotations

import numpy as np
import pytest

from dynident import diagnose
from dynident.diagnosis import Diagnosis
from dynident.diagnosis.detection_limits import limit_table
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

pytestmark = pytest.mark.slow  # every answer is a whole diagnosis

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"


def recordings(model: Model, **hidden: float):
    truth = true_values(model, **FRICTION, **hidden)
    return tuple(
        synthetic(model, truth, 100 + seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(4)
    )


def diagnosed(model: Model, **hidden: float) -> Diagnosis:
    made = recordings(model, **hidden)
    return diagnose(MODEL, Dataset(made[:3]), Dataset(made[3:]))


@pytest.fixture(scope="module")
def healthy() -> Diagnosis:
    found = diagnosed(MODEL)
    assert found.verdict == "nothing_missing"
    return found


def limit(found: Diagnosis, label: str, at: str) -> float:
    return next(
        one.torque_rms
        for one in found.detection_limits
        if (one.effect.label, one.at) == (label, at)
    )


@pytest.mark.parametrize(
    ("label", "name", "joint"),
    [
        ("torque_offset@elbow", "offset__elbow", 1),
        ("quadratic_drag@shoulder", "Fq__shoulder", 0),
        ("torque_ripple@shoulder", "As__shoulder", 0),
    ],
)
def test_an_effect_is_found_above_its_limit_and_not_far_below(
    healthy: Diagnosis, label: str, name: str, joint: int
) -> None:
    model = MODEL + label
    size = limit(healthy, label, ("shoulder", "elbow")[joint])
    pairs = zip(recordings(model, **{name: 1.0}), recordings(MODEL), strict=True)
    of_one = np.sqrt(np.mean([np.mean((a.tau - b.tau)[:, joint] ** 2) for a, b in pairs]))
    above = diagnosed(model, **{name: 1.4 * size / of_one})
    assert [step.effect.label for step in above.steps] == [label]
    assert above.detection_limits == (), "of what is found beside something that is missing"
    assert "detection_limits" not in above.to_dict()
    below = diagnosed(model, **{name: 0.4 * size / of_one})
    assert below.verdict == "nothing_missing"


def test_every_effect_that_can_be_shown_has_a_limit_in_words_and_in_json(
    healthy: Diagnosis,
) -> None:
    shown = {c.effect.label for c in healthy.candidates if c.status != "absorbed"}
    with_limit = {one.effect.label for one in healthy.detection_limits}
    # Contacts and effects that were never evaluated have none.
    assert with_limit <= shown and len(with_limit) > 15
    assert all(0 < one.torque_rms < np.inf for one in healthy.detection_limits)
    said = healthy.to_dict()["detection_limits"]
    assert {"effect", "joint", "source", "at", "torque_rms"} == set(said[0])
    table = next(one for one in healthy.tables() if "would have been found" in str(one))
    assert "Nothing larger was detected than" in str(table)
    assert "N m at shoulder" in " ".join(str(table).split())


def test_the_limit_at_a_joint_is_of_effects_there(healthy: Diagnosis) -> None:
    """What an elastic shoulder makes at the elbow is no limit of an elastic elbow."""
    for one in healthy.detection_limits:
        assert one.effect.joint in (None, one.at)
    table = limit_table(healthy.detection_limits)
    assert table.title.startswith("What would have been found: torque (rms, N m)")
    assert table.columns == ("effect", "shoulder", "elbow")
    here = [one for one in healthy.detection_limits if one.effect.label != "joint_spring@elbow"]
    (row,) = (row for row in limit_table(tuple(here)).rows if row[0] == "joint spring")
    assert row[2] == "-" != row[1]
    assert any(note.startswith("A dash") for note in limit_table(tuple(here)).notes)
