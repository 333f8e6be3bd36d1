"""What is said of a residual that no effect explains: in words, in tables, as JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.dependence.explained_shares import ExplainedShares, Share
from dynident.diagnosis.dependence.residual_dependence import (
    JointDependence,
    dependence_sentences,
    dependence_table,
    residual_dependence,
)
from dynident.diagnosis.dependence.residual_record import ResidualRecord, joined
from dynident.evidence.held_out import HeldOut, HeldOutRun
from residuals import record, rough_friction

NAMES = ("shoulder", "elbow")


def judged(*records: ResidualRecord, noise_std: np.ndarray | None = None) -> HeldOut:
    runs = tuple(
        HeldOutRun(
            name="run",
            certain=one.certain,
            t=one.t,
            q=one.q,
            v=one.v,
            a=one.a,
            measured=one.load + one.residual,
            predicted=one.load,
        )
        for one in records
    )
    found = HeldOut(runs=runs, noise_std=None, ratio=None, least_ratio=None, inflation=np.ones(2))
    if noise_std is None:
        return found
    systematic = np.sqrt(np.clip(found.residual_rms**2 - noise_std**2, 0.0, None))
    return replace(found, noise_std=noise_std, ratio=systematic / noise_std)


def asked(*records: ResidualRecord, noise_std: np.ndarray | None = None):
    if noise_std is None:
        records = tuple(
            replace(one, noise_power=np.full(one.residual.shape, np.nan)) for one in records
        )
    held = judged(*records, noise_std=noise_std)
    return residual_dependence(held, records, NAMES, DEFAULTS.verdict)


ONE = record(11, {rough_friction: 0.6})


@pytest.mark.slow
def test_joints_where_only_noise_is_left_are_not_asked() -> None:
    (found,) = asked(ONE, noise_std=np.sqrt([0.4, 1.0]))
    assert (found.joint, found.whole) == ("shoulder", "systematic")
    shares = found.shares
    assert shares is not None and shares.by["position and velocity"].value > 0.7
    assert found.sentence.startswith(
        "What is left at shoulder, beyond the noise: position and velocity of this joint explain "
    )


@pytest.mark.slow
def test_without_a_noise_floor_shares_are_of_everything_and_it_says_so() -> None:
    first, second = asked(ONE)
    shares = first.shares
    assert shares is not None
    assert 0.4 < shares.by["position and velocity"].value < 0.65
    assert first.whole == "all" and "noise included" in first.sentence
    assert second.told == {} and "no share that the regression explains" in second.sentence
    assert "noise included" in " ".join(str(dependence_table((first, second))).split())


@pytest.mark.slow
def test_no_unit_and_no_order_of_recordings_matters() -> None:
    """In degrees and N mm, and with the second recording first."""
    two = (record(12, {rough_friction: 0.6}, duration=30.0), record(13, {}, duration=30.0))
    degrees = [180 / np.pi, 1.0]
    other = tuple(
        replace(
            one,
            q=one.q * degrees,
            v=one.v * degrees,
            a=one.a * degrees,
            load=one.load * 1e3,
            residual=one.residual * 1e3,
        )
        for one in two
    )
    first, same = (asked(*made)[0].to_dict() for made in (two, other))
    swapped = asked(*two[::-1])[0].to_dict()
    for one, two_ in zip(first["inputs"], same["inputs"], strict=True):
        assert one["name"] == two_["name"]
        assert one["share"] == pytest.approx(two_["share"], rel=1e-6, abs=1e-9)
        assert one["standard_error"] == pytest.approx(two_["standard_error"], rel=1e-6, abs=1e-9)
    for one, two_ in zip(first["inputs"], swapped["inputs"], strict=True):
        assert (one["name"], one["distinguishable"]) == (two_["name"], two_["distinguishable"])
        assert one["share"] == pytest.approx(two_["share"], abs=0.02)


@pytest.mark.slow
def test_rows_that_do_not_count_are_not_asked() -> None:
    """Half of the rows are spoilt, and masked."""
    residual, certain = ONE.residual.copy(), ONE.certain.copy()
    spoilt = np.random.default_rng(0).random(len(ONE.t)) < 0.5
    residual[spoilt, 0] += 100.0
    certain[spoilt, 0] = False
    found = asked(replace(ONE, residual=residual, certain=certain))[0].shares
    assert found is not None and 0.4 < found.by["position and velocity"].value < 0.65


def test_too_little_data_is_a_reason_and_no_number() -> None:
    short = record(14, {rough_friction: 0.6}, duration=2.0)
    first = asked(short)[0]
    assert first.shares is None and "100 rows are too few" in first.sentence
    said = first.to_dict()
    assert said["inputs"] == [] and said["rest"] is None and "too few" in said["why"]
    assert json.loads(json.dumps(said)) == said
    assert "-" in str(dependence_table((first,)))


@pytest.mark.slow
def test_one_motion_over_and_over_is_no_way_to_look_it_up() -> None:
    """Ten cycles of one motion, and nobody has said so; what is left is no function of anything."""
    one = record(15, {}, duration=30.0, period=3.0)
    residual = one.residual.copy()
    residual[:, 0] = np.tile(np.convolve(residual[:150, 0], np.ones(8) / 3, mode="same"), 10)
    first = asked(replace(one, residual=residual, period=None))[0]
    assert first.told == {}


def test_windows_of_a_recording_are_one_stretch_without_instants_twice() -> None:
    index = np.arange(len(ONE.t))
    parts = (ONE.rows(index[1400:]), ONE.rows(index[:1500]))
    (whole,) = joined(parts)
    assert np.array_equal(whole.t, ONE.t) and np.array_equal(whole.q, ONE.q)
    assert len(joined((parts[0], replace(parts[1], source="another")))) == 2


def shares(**by: tuple[float, float]) -> JointDependence:
    found = {name.replace("_", " "): Share(*pair, needed=2.5) for name, pair in by.items()}
    rest = Share(1.0 - sum(s.value for s in found.values() if s.told), 0.05, 2.5)
    of_elbow = ExplainedShares(by=found, rest=rest, units=20)
    return JointDependence(joint="elbow", whole="systematic", shares=of_elbow)


def test_the_sentence_names_what_is_told_and_what_no_input_explains() -> None:
    one = shares(
        position_and_velocity=(0.62, 0.04),
        past=(0.2, 0.03),
        acceleration_and_load=(0.05, 0.03),
        other_joints=(-0.4, 0.1),
        time=(0.004, 0.001),
    )
    assert one.sentence == (
        "What is left at elbow, beyond the noise: position and velocity of this joint explain 62 % "
        "of it (standard error 4 %) and its past 20 % (3 %) more; the regression leaves 18 % (5 %) "
        "unexplained."
    )
    said = one.to_dict()
    assert [x["distinguishable"] for x in said["inputs"]] == [True, True, False, False, False]
    assert said["inputs"][1] == {
        "name": "past",
        "share": 0.2,
        "standard_error": 0.03,
        "distinguishable": True,
    }
    assert (said["joint"], said["of"], said["blocks"]) == ("elbow", "systematic", 20)


def test_where_nothing_is_told_no_share_is_named() -> None:
    one = shares(position_and_velocity=(0.05, 0.04), time=(-0.1, 0.05))
    assert one.sentence.endswith("no share that the regression explains can be told from nothing.")
    assert "%" not in one.sentence
    (row,) = dependence_table((one,)).rows
    assert row == ("elbow", "(5 \u00b1 4)", "(0 \u00b1 5)", "all")


def test_the_table_sets_what_is_not_told_in_brackets() -> None:
    one = shares(position_and_velocity=(0.62, 0.04), past=(0.2, 0.03), time=(0.05, 0.05))
    (row,) = dependence_table((one,)).rows
    assert row == ("elbow", "62 \u00b1 4", "20 \u00b1 3", "(5 \u00b1 5)", "18 \u00b1 5")


def test_joints_of_which_the_same_is_to_be_said_share_a_sentence() -> None:
    nothing = shares(position_and_velocity=(0.05, 0.04), time=(-0.1, 0.05))
    more = shares(position_and_velocity=(0.62, 0.04), time=(-0.1, 0.05))
    # Which inputs were asked, and in which order, is in the table.
    other = replace(shares(past=(0.02, 0.05), other_joints=(0.1, 0.1)), joint="wrist")
    two = dependence_sentences((nothing, more, other))
    heads = ["What is left at elbow and wrist", "What is left at elbow"]
    assert [one[: one.index(",")] for one in two] == heads
    assert "62 %" in two[1]
