"""Words that a robot of linear axes, or of one joint, would find wrong."""

from __future__ import annotations

from dynident import fit as fit_model
from dynident.diagnosis.details import IMPOSSIBLE, Candidate
from dynident.effects import catalogue
from dynident.fitting import LeastSquares
from dynident.fitting.uncertainty.shape_errors import with_shape_errors
from dynident.recording import Dataset
from reporting.fabricated import arm
from slides import at, gantry, recorded


def test_a_robot_of_one_joint_has_one_delay() -> None:
    one = catalogue()["torque_delay"].candidates(arm("swing"))
    assert [e.label for e in one] == ["torque_delay"]
    two = catalogue()["torque_delay"].candidates(gantry().robot)
    assert [e.label for e in two] == ["torque_delay", "torque_delay@x", "torque_delay@y"]


def test_what_was_added_is_not_said_to_make_the_impossible() -> None:
    refused = Candidate(
        effect=at("torque_offset@x"),
        status="not_material",
        p_value=0.0,
        test_gain=None,
        remark=f"{IMPOSSIBLE}: ry = 767 rad at the robot",
    )
    assert refused.finding_of_added.startswith(f"a first fit with it {IMPOSSIBLE}")
    assert refused.finding_of_added.endswith("the one that is taken does not; added")


def test_a_payload_that_never_turns_has_moments_without_influence() -> None:
    (recording, *_) = recorded().recordings
    carried = Dataset((recording.replace(payload=True),))
    rows = fit_model(gantry() + "payload", carried).parameter_table().rows
    words = {row[0]: row[-1] for row in rows}
    assert words["payload.mx"] == "without influence on these torques"
    assert words["payload.mass"] == "not identified on its own, only in combinations"


def test_a_shape_at_the_end_of_where_it_is_sought_is_said_to_be() -> None:
    def notes(k: float) -> str:
        model = gantry() + at("torque_ripple@y", k)
        return " ".join(with_shape_errors(LeastSquares().fit(model, recorded()), None).notes)

    assert "k@y = 10 rad/m is at the end of where it is sought" in notes(10.0)
    assert "the end of where" not in notes(100.0)
