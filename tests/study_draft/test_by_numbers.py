"""Files without a header line: columns told by how they move together."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.model import Model
from dynident.robot import Robot
from dynident.robot.poses import poses
from dynident.study_draft.by_numbers import UNUSED, named_by_numbers
from study_files import recording
from synthetic import ARM, arm, synthetic, true_values

NAMES = ("t", "q.shoulder", "q.elbow", "v.shoulder", "v.elbow", "tau.shoulder", "tau.elbow")


SIGNALS = ("q", "v", "tau")


def table(seed: int = 3) -> dict[str, np.ndarray]:
    """Time, positions with an encoder's noise, their references, speeds, torques and a flag."""
    one, rng = recording(seed), np.random.default_rng(seed)
    v = np.gradient(one.q, one.t, axis=0)
    blocks = {
        "t": one.t[:, None] + 1.7e9,
        "q_ref": one.q,
        "v_ref": v,
        "a_ref": np.gradient(v, one.t, axis=0),
        "q": one.q + 1e-5 * rng.normal(size=one.q.shape),
        "v": v + 1e-4 * rng.normal(size=v.shape),
        "noise": rng.normal(size=one.q.shape),
        "tau": one.tau,
        "flag": np.zeros((one.samples, 1)),
    }
    return blocks


ORDERS = (
    ("t", "q", "v", "tau"),
    ("tau", "t", "q", "v"),
    ("t", "q_ref", "v_ref", "q", "v", "noise", "tau", "flag"),
    ("flag", "t", "v", "q", "tau", "noise"),
    ("t", "q_ref", "v_ref", "a_ref", "q", "v", "tau"),
    ("t", "q", "tau"),
    ("tau", "noise", "t", "q"),
    ("t", "q_ref", "q", "tau", "flag"),
    ("flag", "tau", "q", "q_ref", "t"),
)


@pytest.mark.parametrize("order", ORDERS, ids=" ".join)
@pytest.mark.slow
def test_blocks_are_told_in_whatever_order(order: tuple[str, ...]) -> None:
    blocks = table()
    x = np.hstack([blocks[name] for name in order])
    found = named_by_numbers(x, arm(), None, "log.csv")
    wanted = [
        f"{name}.{joint}" if name in SIGNALS else "t" if name == "t" else UNUSED
        for name in order
        for joint in (("shoulder", "elbow") if blocks[name].shape[1] == 2 else ("",))
    ]
    assert list(found.named(0, arm().names)) == wanted


def test_a_rate_stands_in_for_a_clock() -> None:
    blocks = table()
    x = np.hstack([blocks[name] for name in ("q", "v", "tau")])
    found = named_by_numbers(x, arm(), 100.0, "log.csv")
    assert found.named(0, arm().names) == NAMES[1:]
    with pytest.raises(RecordingError, match="--rate"):
        named_by_numbers(x, arm(), None, "log.csv")


def test_one_joint_has_one_column_of_each() -> None:
    text = ARM.replace('"shoulder" type="revolute"', '"shoulder" type="fixed"')
    model = Model(Robot.from_text(text)) + "viscous_friction"
    one = synthetic(model, true_values(model, Fv__elbow=1.0), rate_hz=100.0, torque_std=0.01)
    x = np.hstack([one.t[:, None], one.tau, one.q])
    found = named_by_numbers(x, model.robot, None, "log.csv")
    assert found.choices[0] == "positions in column 3, torques in column 2"
    assert found.named(0, model.robot.names) == ("t", "tau.elbow", "q.elbow")


def test_what_is_no_motion_or_has_no_torque_is_refused() -> None:
    blocks = table()
    for orders in (
        ("t", "q", "noise"),
        ("t", "noise", "tau"),
        ("t", "q", "q_ref"),
        ("t", "q", "v"),
    ):
        x = np.hstack([blocks[name] for name in orders])
        with pytest.raises(RecordingError, match=r"motion explains 2 others.*--column"):
            named_by_numbers(x, arm(), None, "x")
    with pytest.raises(RecordingError, match=r"300 columns have no names.*--column"):
        named_by_numbers(np.zeros((50, 300)), arm(), None, "x")


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.slow
def test_what_only_drifts_is_no_motion_and_no_torque(seed: int) -> None:
    rng, blocks = np.random.default_rng(seed), table()
    walks = np.cumsum(rng.normal(size=(len(blocks["t"]), 6)), axis=0)
    warming = 25.0 + 20.0 * (1.0 - np.exp(-np.outer(blocks["t"] - blocks["t"][0], [0.02, 0.05])))
    warming += 0.05 * rng.normal(size=warming.shape)
    for columns in ((walks,), (blocks["q"], warming)):
        x = np.hstack([blocks["t"], *columns])
        with pytest.raises(RecordingError, match=r"motion explains 2 others.*--column"):
            named_by_numbers(x, arm(), None, "x")


MIXED = np.array([[80.0, 0.0], [-31.0, -100.0]])
"""Positions of motors behind gears, of which the second turns with the first joint."""


def tool(q: np.ndarray) -> np.ndarray:
    """Where a point of the last link is, m: of six coordinates those that the plane arm moves."""
    R, p = poses(arm(), q)
    point = R[:, -1] @ [0.1, 0.02, 0.3] + p[:, -1]
    return point[:, np.ptp(point, axis=0) > 1e-6]


@pytest.mark.parametrize("order", [("t", "q", "{}"), ("t", "q", "v", "{}"), ("t", "{}", "q")])
@pytest.mark.parametrize("copy", ["motor", "tool"])
@pytest.mark.slow
def test_positions_of_motors_and_of_the_tool_are_no_torques(order, copy: str) -> None:
    blocks = table()
    rng = np.random.default_rng(0)
    moved = blocks["q"] @ MIXED.T if copy == "motor" else tool(blocks["q"])
    blocks["copy"] = moved + 1e-4 * np.ptp(moved, axis=0) * rng.normal(size=moved.shape)
    names = [name.format("copy") for name in order]
    x = np.hstack([blocks[name] for name in names])
    with pytest.raises(RecordingError, match=r"motion explains 2 others.*--column"):
        named_by_numbers(x, arm(), None, "x")
    x = np.hstack([blocks[name] for name in (*names, "tau")])
    found = named_by_numbers(x, arm(), None, "x").named(0, arm().names)
    assert found[-2:] == ("tau.shoulder", "tau.elbow")


@pytest.mark.slow
def test_more_pairs_than_are_tried_are_said() -> None:
    blocks = table()
    rng = np.random.default_rng(0)
    x = np.hstack([blocks["t"], rng.normal(size=(len(blocks["t"]), 45))])
    with pytest.raises(
        RecordingError, match=r"\d+ pairs of them.*at most 1200 are tried.*--column"
    ):
        named_by_numbers(x, arm(), None, "x")


@pytest.mark.parametrize("beside", [16, 26])
@pytest.mark.slow
def test_many_motors_that_warm_up_are_no_motion(beside: int) -> None:
    """Each rises in its own time, and more than 21 columns are looked at where joints are few."""
    blocks, rng = table(), np.random.default_rng(5)
    t = blocks["t"] - blocks["t"][0]
    warm = 30 + 5 * (1 - np.exp(-t / (4.0 + np.arange(beside))))
    warm += 0.05 * rng.normal(size=warm.shape)
    half = beside // 2
    parts = [blocks["t"], warm[:, :half], blocks["q"], warm[:, half:], blocks["tau"]]
    found = named_by_numbers(np.hstack(parts), arm(), None, "log.csv")
    names = found.named(0, arm().names)
    assert [k for k, name in enumerate(names) if name.startswith("q.")] == [half + 1, half + 2]
    assert [k for k, name in enumerate(names) if name.startswith("tau.")] == [
        beside + 3,
        beside + 4,
    ]
