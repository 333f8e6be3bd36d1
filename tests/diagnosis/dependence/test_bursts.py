"""A few instants that hold most of a residual are told, with the place of the largest."""

from __future__ import annotations

import numpy as np
import pytest

from dynident import diagnose
from dynident.criteria import VerdictCriteria
from dynident.diagnosis.dependence.bursts import beyond_reversals, burst_notes, bursts_in
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.reporting.headline import headline
from dynident.reporting.next_steps import next_steps
from synthetic import arm, synthetic, true_values

ROWS = 800
DRY = Model(arm()) + "coulomb_friction"


def left(
    *residuals: np.ndarray,
    certain: np.ndarray | None = None,
    predicted: np.ndarray | None = None,
    v: float | np.ndarray = 1.0,
) -> HeldOut:
    """A model that leaves (T, n) of recordings at 50 Hz."""
    still = np.zeros_like(residuals[0])
    torque = still if predicted is None else predicted
    v = still + v
    whole = np.ones(still.shape, dtype=bool)
    runs = tuple(
        HeldOutRun(
            name=f"run{k + 1}",
            certain=whole if certain is None else certain,
            t=np.arange(len(one)) / 50.0,
            q=still,
            v=v,
            a=still,
            measured=torque + one,
            predicted=torque,
        )
        for k, one in enumerate(residuals)
    )
    ones = np.ones(still.shape[1])
    return HeldOut(runs=runs, noise_std=None, ratio=None, least_ratio=None, inflation=ones)


def moving(trained: HeldOut, level: float = 50.0) -> HeldOut:
    """What is left beyond the reversals of joints with dry friction of a level, N m."""
    values = true_values(DRY, Fc__shoulder=level, Fc__elbow=level)
    return beyond_reversals(trained, DRY, values)


def told(trained: HeldOut, level: float = 50.0) -> tuple[str, ...]:
    """What is said of joints a and b."""
    every, beyond = (
        bursts_in(one, ["a", "b"], ["N m", "N"], VerdictCriteria())
        for one in (trained, moving(trained, level))
    )
    return burst_notes(every, beyond)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((ROWS, 2))


def test_bursts_are_counted_and_the_largest_is_placed() -> None:
    first, second = noise(1), noise(2)
    first[100:103, 1] += [20.0, 40.0, 20.0]
    second[500:503, 1] -= [20.0, 60.0, 20.0]
    (said,) = told(left(first, second))
    assert "; at b the " in said and "at a the" not in said
    assert ": 2 bursts, " in said
    assert "at 10.02 s of run2" in said
    assert f"the largest of {abs(second[501, 1]):.2g} N " in said


def test_several_joints_are_told_of_at_once() -> None:
    one = noise(5)
    one[100:103] += 40.0
    (said,) = told(left(one))
    assert "; at a the " in said and "; at b the " in said


@pytest.mark.parametrize(("knocks", "rows"), [(1, 10_000), (3, 20_000), (40, 20_000)])
def test_as_many_bursts_are_told_as_there_are(knocks: int, rows: int) -> None:
    """Few fill no hundredth of the rows: the largest of the noise is no burst beside them."""
    one = np.random.default_rng(knocks).standard_normal((rows, 2))
    one[np.linspace(50, rows - 50, knocks).astype(int), 0] = 120.0
    (said,) = told(left(one))
    assert (": one burst, " if knocks == 1 else f": {knocks} bursts, ") in said


def test_alike_and_tiny_residuals_break_nothing() -> None:
    """More rows alike than are looked at; and of 1e-6 of the torque nothing is told."""
    alike = np.zeros((ROWS, 2))
    alike[::90] = 5.0
    assert ": 9 bursts, " in told(left(alike))[0]
    one = noise(6)
    one[100, 0] = 200.0
    assert told(left(one))
    assert not told(left(1e-6 * one, predicted=np.ones_like(one)))


@pytest.mark.parametrize("seed", range(5))
def test_no_noise_is_called_a_burst(seed: int) -> None:
    """Normal noise of one size or of one that grows fourfold, steps, and heavier tails."""
    rng = np.random.default_rng(seed)
    growing = noise(seed) * np.linspace(0.4, 1.6, ROWS)[:, None]
    heavy = rng.standard_t(5, (ROWS, 2))
    for one in (noise(seed), growing, heavy, np.round(noise(seed))):
        assert not told(left(one, one[::-1]))


def test_what_does_not_count_is_no_burst() -> None:
    one, certain = noise(3), np.ones((ROWS, 2), dtype=bool)
    one[100:103, 0] = 50.0
    certain[95:110, 0] = False
    assert told(left(one))
    assert not told(left(one, certain=certain))


SWINGING = 3.0 * np.sin(np.arange(ROWS) / 7.5)[:, None] * [1.0, 0.0] + [0.0, 1.0]
TURNS = np.flatnonzero(SWINGING[1:, 0] * SWINGING[:-1, 0] < 0.0)[::4]


@pytest.mark.parametrize(
    ("rows", "level", "friction"),
    [
        (TURNS, 50.0, True),
        (TURNS + 8, 50.0, False),
        (TURNS, 20.0, False),
        (TURNS, 0.0, False),
    ],
    ids=["at reversals", "elsewhere", "more than friction can leave", "no dry friction"],
)
def test_bursts_where_a_joint_turns_round_are_its_friction(
    rows: np.ndarray, level: float, friction: bool
) -> None:
    """At 0.4 rad/s from row to row the speed is below 0.01 in hardly any of them."""
    one = noise(7)
    one[rows, 0] = 50.0
    (said,) = told(left(one, v=SWINGING), level)
    assert "; at a the " in said
    assert said.endswith("no verdict rests on them.") == friction


@pytest.mark.parametrize("v", [0.0, 0.008], ids=["stands", "slow"])
def test_a_joint_that_does_not_turn_round_has_bursts_however_slow(v: float) -> None:
    one = noise(8)
    one[100] = 50.0
    (said,) = told(left(one, v=v))
    assert "; at a the " in said and "turns round" not in said


def test_few_rows_and_nothing_left_say_nothing() -> None:
    assert not told(left(np.zeros((ROWS, 2))))
    assert not told(left(noise(4)[:50]))


@pytest.mark.slow
def test_without_a_noise_floor_knocks_are_told_and_are_no_noise() -> None:
    """Its test recording shows none, and its residual is as large as noise might be."""
    model = Model(arm()) + "viscous_friction" + "coulomb_friction"
    values = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
    truth = true_values(model, **values)

    def recorded(seed: int, knocks: tuple[float, ...]) -> Recording:
        one = synthetic(model, truth, seed, rate_hz=250.0, torque_std=0.1)
        tau = np.array(one.tau)
        for at in knocks:
            tau[:, 1] += 12.0 * np.exp(-(((one.t - at) / 0.02) ** 2))
        return one.replace(tau=tau, period=None)

    train = Dataset((recorded(0, (3.0, 9.0)), recorded(1, (5.0,))))
    found = diagnose(model, train, Dataset((recorded(2, ()),)), propose="never")
    said = [note for note in found.notes if "largest of" in note]
    assert len(said) == 1
    assert "; at elbow the " in said[0] and "shoulder" not in said[0]
    assert ": 3 bursts, " in said[0]
    assert found.bursts == ("elbow",)
    assert found.verdict == "unexplained"
    head = headline(found)
    assert (head.mark, head.title) == ("!", "a residual remains")
    assert "Look at the pictures of elbow" in next_steps(found)[0].what
    quiet = diagnose(model, Dataset((recorded(0, ()), recorded(1, ()))), propose="never")
    assert (quiet.verdict, quiet.bursts) == ("nothing_missing", ())
    assert "At elbow a few bursts hold most of what is left" in head.sentence
