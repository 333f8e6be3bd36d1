"""`dynident design`: files that can be followed and simulated."""

from __future__ import annotations

import numpy as np
import pandas as pd

from loop_studies import write_loop_study


def test_the_design_is_written_and_can_be_simulated(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    wanted = ("--duration", "4", "--repeat", "2", "--harmonics", "3", "--starts", "1")
    done = run("design", study, *wanted, "--out", "next", "--json")
    assert done.status == 0, done.err
    table = pd.read_csv(tmp_path / "next" / "reference.csv")
    assert list(table.columns) == [
        "t",
        *(f"{what}.{joint}" for joint in ("shoulder", "elbow") for what in ("q_ref", "v_ref")),
    ]
    assert table.t.iloc[-1] == 8.0
    half = len(table) // 2
    np.testing.assert_allclose(
        table["q_ref.elbow"][:half], table["q_ref.elbow"][half:-1], atol=1e-8
    )
    assert abs(table["v_ref.elbow"].iloc[0]) < 1e-9
    done = run("simulate", tmp_path / "next" / "experiment.toml", "--out", "made")
    assert done.status == 0, done.err
    made = pd.read_csv(tmp_path / "made" / "designed.csv")
    reference = made["q_ref.shoulder"].to_numpy()
    np.testing.assert_allclose(reference, table["q_ref.shoulder"][: len(reference)], atol=1e-8)


def test_what_cannot_be_designed_is_one_line(run, tmp_path) -> None:
    study = write_loop_study(tmp_path)
    for wrong in (
        ("--tell", "backlash@elbow", "joint_spring@elbow"),
        ("--tell", "viscous_friction", "joint_spring@elbow"),
        ("--show", "joint_sprung@elbow"),
        ("--duration", "-1"),
        ("--duration", "1e9"),
        ("--limits", "nothing.toml"),
        ("--harmonics", "1"),
        ("--show", "joint_zero@wrist"),
    ):
        done = run("design", study, *wrong, "--starts", "1", "--out", "next")
        assert done.status == 2
        assert done.err.count("\n") == 1, done.err
        assert not (tmp_path / "next").exists()
