"""Scores of an effect from second moments alone: rows of known truth, no robot moves.

The rows are whitened, as those of a diagnosis are: noise of unit variance, in replicates of the
same motion. `x` are columns of the model, `z` those of the effect beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from dynident import diagnose
from dynident.criteria import Criteria
from dynident.diagnosis.search.cross_validation import cross_validate
from dynident.diagnosis.search.scores.candidate_moments import (
    CandidateMoments,
    moments_with_payload,
)
from dynident.diagnosis.search.scores.score import Score, impossible
from dynident.diagnosis.search.scores.scoring import score, scores
from dynident.effects import Effect, effects_of
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.model import Model
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import regress
from dynident.recording import Dataset
from row_moments import row_moments
from synthetic import arm, synthetic, true_values

RELIABLE = Criteria().noise.reliable
MODEL = Model(arm()) + "viscous_friction"
INSTANTS, REPLICATES, BLOCKS = 600, 3, 20
EDGES = np.linspace(0, INSTANTS, BLOCKS + 1).astype(int)
OF_MODEL = np.array([2.0, -1.0, 0.5])


def effect(label: str = "torque_offset@elbow") -> Effect:
    (found,) = effects_of(label, MODEL.robot)
    return found


def replicated(signal: np.ndarray, std: float, rng: np.random.Generator) -> np.ndarray:
    """Replicates (P, S, k) of a signal (S, k) with noise."""
    return signal + std * rng.normal(size=(REPLICATES, *signal.shape))


def products(left: np.ndarray, right: np.ndarray, edges: np.ndarray = EDGES) -> SecondMoments:
    return row_moments(left, right, edges, "repeated")


def side_by_side(
    parts: Sequence[SecondMoments], put: Callable[..., np.ndarray], axis: int
) -> SecondMoments:
    """Moments of the same rows in one."""
    total, signal = (put([getattr(p, n) for p in parts], axis=axis) for n in ("total", "signal"))
    return SecondMoments(total, parts[0].counts, None, signal)


class Rows:
    """Torque x @ OF_MODEL + z @ values + noise, and what a diagnosis makes of it."""

    def __init__(
        self,
        values: tuple[float, ...],
        seed: int,
        *,
        noise: float = 1.0,
        column_noise: float = 0.0,
        along_model: float = 0.0,
        edges: np.ndarray = EDGES,
    ) -> None:
        rng = np.random.default_rng(seed)
        self.x = rng.normal(size=(INSTANTS, len(OF_MODEL)))
        self.z = rng.normal(size=(INSTANTS, len(values))) + along_model * self.x[:, :1]
        torque = self.x @ OF_MODEL + self.z @ np.array(values)
        measured = replicated(torque[:, None], noise, rng)
        known = np.concatenate([np.tile(self.x, (REPLICATES, 1, 1)), measured], axis=2)
        columns = replicated(self.z, column_noise, rng)
        self.fitted = fitted(products(known, known, edges))
        self.with_model = products(known, columns, edges)
        self.with_self = products(columns, columns, edges)

    def scored(self, one: Effect | None = None, grid: int = 1) -> Score:
        label = "torque_offset@elbow" if self.z.shape[1] == 1 else "torque_ripple@elbow"
        return score(self.fitted, one or effect(label), self.with_model, self.with_self, grid)

    def left(self) -> np.ndarray:
        """The effect's columns less what the model's explain of them."""
        return self.z - self.x @ np.linalg.lstsq(self.x, self.z, rcond=None)[0]


def fitted(known: SecondMoments) -> EvidenceFit:
    """A fit as the scores know it: of the evidence only its moments count."""
    solution = regress(known.pooled(), RELIABLE)
    unused: Any = None
    return EvidenceFit(
        criteria=Criteria(),
        model=MODEL,
        values=solution.values,
        covariance=solution.covariance,
        solution=solution,
        noise=(),
        noise_known=True,
        white=(),
        moments=known,
        error_signal=unused,
        squares=unused,
        variances=unused,
        torque_peaks=np.full(MODEL.robot.n, np.inf),
    )


@pytest.mark.parametrize("values", [(0.3,), (0.3, -0.2)])
@pytest.mark.parametrize("seed", range(5))
def test_the_values_of_an_effect_that_is_there_are_found(
    values: tuple[float, ...], seed: int
) -> None:
    rows = Rows(values, seed)
    found = rows.scored()
    assert found.rank == len(values)
    assert found.p_value < 1e-4
    errors = (np.array(found.values) - values) / np.array(found.sigma)
    assert np.all(np.abs(errors) < 4.5)


def test_uncertainty_is_that_of_the_scatter() -> None:
    every = [Rows((0.3,), seed).scored() for seed in range(200)]
    errors = [(one.values[0] - 0.3) / one.sigma[0] for one in every]
    assert np.mean(errors) == pytest.approx(0.0, abs=0.25)
    assert np.std(errors) == pytest.approx(1.0, rel=0.2)


def test_the_drop_is_the_square_of_what_the_effect_explains_and_nothing_else_does() -> None:
    rows = Rows((0.3,), 0, noise=0.0, along_model=2.0)
    explained = REPLICATES * np.sum((rows.left() * 0.3) ** 2)
    found = rows.scored()
    assert found.drop == pytest.approx(explained, rel=1e-6)
    assert found.share == pytest.approx(1.0, rel=1e-6)
    assert found.values == pytest.approx((0.3,), rel=1e-6)


def test_p_values_of_what_is_not_there_are_uniform() -> None:
    p = np.sort([Rows((0.0, 0.0), seed).scored().p_value for seed in range(200)])
    uniform = (np.arange(200) + 0.5) / 200
    assert np.max(np.abs(p - uniform)) < 1.63 / np.sqrt(200)  # Kolmogorov, 1 %


def test_noise_in_a_column_does_not_shrink_its_value() -> None:
    """Least squares on the same rows finds a half: as much noise as signal is in the column."""
    every = [Rows((1.0,), seed, column_noise=1.0).scored().values[0] for seed in range(30)]
    assert np.mean(every) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_units_of_the_effect_change_its_value_alone(factor: float) -> None:
    rows = Rows((0.3,), 1)
    plain = rows.scored()
    other = score(
        rows.fitted,
        effect(),
        replace_products(rows.with_model, 1.0, factor),
        replace_products(rows.with_self, factor, factor),
        1,
    )
    assert other.values[0] * factor == pytest.approx(plain.values[0], rel=1e-7)
    for name in ("drop", "share", "p_value", "penalised"):
        assert getattr(other, name) == pytest.approx(getattr(plain, name), rel=1e-6)


def replace_products(moments: SecondMoments, left: float, right: float) -> SecondMoments:
    factor = left * right
    return SecondMoments(moments.total * factor, moments.counts, None, moments.signal * factor)


def test_a_column_that_the_model_has_is_not_identifiable() -> None:
    rows = Rows((0.3,), 2)
    same = np.tile(rows.x[:, :1], (REPLICATES, 1, 1))
    torque = np.tile((rows.x @ OF_MODEL)[:, None], (REPLICATES, 1, 1))
    known = np.concatenate([np.tile(rows.x, (REPLICATES, 1, 1)), torque], axis=2)
    found = score(rows.fitted, effect(), products(known, same), products(same, same), 1)
    assert found.not_identifiable
    assert found.rank == 0 and found.drop == 0.0 and found.p_value == 1.0


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_a_column_whose_squares_overflow_is_not_identifiable() -> None:
    """A shape that is tried may be beyond all numbers: it must not end the search."""
    rows = Rows((3.0,), seed=4)
    rows.z = 1e200 * rows.z
    columns = replicated(rows.z, 0.0, np.random.default_rng(0))
    known = np.concatenate(
        [np.tile(rows.x, (REPLICATES, 1, 1)), np.ones((REPLICATES, INSTANTS, 1))], axis=2
    )
    with_self = row_moments(columns, columns, EDGES, "single")
    with_model = row_moments(known, columns, EDGES, "single")
    said = score(rows.fitted, effect(), with_model, with_self, 1)
    assert said.not_identifiable


def test_of_two_equal_columns_one_direction_is_left() -> None:
    rows = Rows((0.3,), 3)
    twice = np.repeat(np.tile(rows.z, (REPLICATES, 1, 1)), 2, axis=2)
    known = rows.with_model
    beside = known.columns(np.repeat(np.arange(known.total.shape[2]), 2))
    ripple = effect("torque_ripple@elbow")
    found = score(rows.fitted, ripple, beside, products(twice, twice), 1)
    assert found.rank == 1
    assert sum(found.values) == pytest.approx(rows.scored().values[0], rel=1e-6)


@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_variants_are_scored_as_if_each_were_alone() -> None:
    """Whatever stands beside them: columns that are dependent, the model's, zero, or no numbers."""
    rows, rng = Rows((0.3, -0.2), 0), np.random.default_rng(1)
    torque = rows.x @ OF_MODEL + rows.z @ [0.3, -0.2]
    known = np.tile(np.column_stack([rows.x, torque]), (REPLICATES, 1, 1))
    noisy, plain = replicated(rows.z, 1.0, rng), replicated(rows.z, 0.0, rng)
    others = replicated(rng.normal(size=rows.z.shape), 30.0, rng)
    half = plain * [1.0, 0.0]
    model = np.tile(rows.x[:, :2], (REPLICATES, 1, 1))
    columns = [noisy, plain[..., [0, 0]], model, np.inf * plain, half, others]
    one = effect("torque_ripple@elbow")
    variants = [one.shaped(float(k)) for k in range(1, 7)]
    grid = np.array([1, 2, 3, 4, 5, 6])
    each = [(products(known, z), products(z, z)) for z in columns]
    moments = CandidateMoments(
        side_by_side([beside for beside, _ in each], np.concatenate, 2),
        side_by_side([own for _, own in each], np.stack, 1),
    )
    found = scores(rows.fitted, variants, moments, grid)
    alone = [
        score(rows.fitted, *of) for of in zip(variants, *zip(*each, strict=True), grid, strict=True)
    ]
    assert [one.rank for one in found] == [2, 1, 0, 0, 1, 0]
    for a, b in zip(found, alone, strict=True):
        assert (a.effect, a.not_identifiable, a.rank) == (b.effect, b.not_identifiable, b.rank)
        numbers = [(*x.values, *x.sigma, x.drop, x.p_value, x.penalised, x.fall) for x in (a, b)]
        assert numbers[0] == pytest.approx(numbers[1], rel=1e-9, abs=0.0)


def test_scores_are_those_of_regressions_on_the_rows() -> None:
    """Of two columns, of two that are one, and of two taken at given values."""
    rng = np.random.default_rng(2)
    x, z = rng.normal(size=(INSTANTS, 3)), rng.normal(size=(INSTANTS, 2))
    z += 0.5 * x[:, :1]
    y = x @ OF_MODEL + z @ [0.1, -0.05] + rng.normal(size=INSTANTS)
    columns = [z, z[:, [0, 0]] * [1.0, 2.0], z]
    one, point = effect("torque_ripple@elbow"), (0.25, -0.1)
    variants = [one, one.shaped(2.0), replace(one, point=point)]
    known, every = np.column_stack([x, y])[None], np.hstack(columns)[None]
    own = [row_moments(each[None], each[None], EDGES, "single") for each in columns]
    beside = row_moments(known, every, EDGES, "single")
    moments = CandidateMoments(beside, side_by_side(own, np.stack, 1))
    without = fitted(row_moments(known, known, EDGES, "single"))
    found = scores(without, variants, moments, 7)
    assert [one.rank for one in found] == [2, 1, 2]
    residual = y - x @ np.linalg.lstsq(x, y)[0]
    for a, each in zip(found, columns, strict=True):
        left = each - x @ np.linalg.lstsq(x, each)[0]
        axes = np.linalg.svd(left, full_matrices=False)[0][:, : a.rank]
        rest = residual - axes @ (axes.T @ residual)
        assert a.drop == pytest.approx(residual @ residual - rest @ rest)
        parts = zip(np.split(axes, EDGES[1:-1]), np.split(rest, EDGES[1:-1]), strict=True)
        blocks = np.array([part.T @ of for part, of in parts])
        spread = blocks.T @ blocks * BLOCKS / (BLOCKS - 1)
        wald = residual @ axes @ np.linalg.solve(spread, axes.T @ residual)
        ratio = wald * (BLOCKS - a.rank) / (a.rank * (BLOCKS - 1))
        chance = stats.f.sf(ratio, a.rank, BLOCKS - a.rank)
        assert a.p_value == pytest.approx(chance, rel=1e-9, abs=0.0)
        worth = (a.rank + len(one.shape)) * np.log(INSTANTS) + 2.0 * np.log(7)
        assert a.penalised == pytest.approx(a.drop - worth)
        at = np.array(a.effect.point or a.values)
        taken = residual - left @ at
        assert a.fall == pytest.approx(residual @ residual - taken @ taken)
        if a.rank == 2:
            assert a.values == pytest.approx(np.linalg.lstsq(left, residual)[0])
            assert a.sigma == pytest.approx(np.sqrt(np.diag(np.linalg.inv(left.T @ left))))


def test_a_column_that_is_nothing_but_noise_is_identifiable_and_explains_nothing() -> None:
    found = Rows((0.0,), 4, column_noise=30.0).scored()
    assert not found.not_identifiable
    assert found.drop < 12.0  # of a chi-squared variable of one degree of freedom, about


def test_a_finer_grid_costs_its_logarithm() -> None:
    rows = Rows((0.3,), 5)
    one, many = rows.scored(grid=1), rows.scored(grid=100)
    assert one.penalised - many.penalised == pytest.approx(2.0 * np.log(100.0))
    assert one.drop - one.penalised == pytest.approx(np.log(INSTANTS * REPLICATES))


@pytest.mark.parametrize("blocks", [1, 2])
def test_too_few_blocks_prove_nothing(blocks: int) -> None:
    edges = np.linspace(0, INSTANTS, blocks + 1).astype(int)
    assert Rows((3.0,), 6, edges=edges).scored().p_value == 1.0


def test_held_out_losses_are_those_of_regressions_without_the_block() -> None:
    rows = Rows((0.3,), 7, noise=0.0)
    torque = rows.x @ OF_MODEL + rows.z @ [0.3]
    without, with_effect = cross_validate(rows.fitted, rows.with_model, rows.with_self)
    expected = []
    for start, stop in pairwise(EDGES):
        out = np.r_[0:start, stop:INSTANTS]
        values = np.linalg.lstsq(rows.x[out], torque[out], rcond=None)[0]
        left = (torque - rows.x @ values)[start:stop]
        expected.append(REPLICATES * left @ left)
    assert without == pytest.approx(np.array(expected), rel=1e-6)
    assert with_effect == pytest.approx(np.zeros(BLOCKS), abs=1e-8 * without.sum())


@pytest.mark.slow
def test_held_out_gain_is_positive_for_what_is_there_and_not_for_what_is_not() -> None:
    def gain(value: float, seed: int) -> float:
        rows = Rows((value,), seed)
        without, with_effect = cross_validate(rows.fitted, rows.with_model, rows.with_self)
        return float(np.sum(without - with_effect))

    assert min(gain(0.3, seed) for seed in range(20)) > 0.0
    assert np.mean([gain(0.0, seed) for seed in range(100)]) < 1.0


def test_losses_of_an_exact_model_vanish() -> None:
    rows = Rows((0.0,), 8, noise=0.0)
    losses, _ = cross_validate(rows.fitted, rows.with_model, rows.with_self)
    assert losses == pytest.approx(np.zeros(BLOCKS), abs=1e-8 * INSTANTS)


def test_without_the_payload_a_column_is_nothing() -> None:
    rows = Rows((0.3,), 9)
    half = EDGES[: BLOCKS // 2 + 1]
    evidence: Any = SimpleNamespace(runs=[SimpleNamespace(edges=half)] * 2)
    masked = moments_with_payload(rows.with_model, evidence, (True, False))
    assert np.array_equal(masked.signal[: BLOCKS // 2], rows.with_model.signal[: BLOCKS // 2])
    assert not np.any(masked.signal[BLOCKS // 2 :]) and not np.any(masked.total[BLOCKS // 2 :])
    every = moments_with_payload(rows.with_model, evidence, (True, True))
    assert np.array_equal(every.total, rows.with_model.total)


def test_values_beyond_their_bounds_are_impossible() -> None:
    friction = effect("coulomb_friction@elbow")
    rows = Rows((0.3,), 10)
    found = replace(rows.scored(), effect=friction)
    assert impossible(found, rows.fitted) == ""
    negative = replace(found, values=(-0.3,))
    assert "Fc" in impossible(negative, rows.fitted)
    assert impossible(replace(negative, not_identifiable=True), rows.fitted) == ""


@pytest.mark.parametrize("gain", [-0.4, -0.48])
@pytest.mark.slow
def test_the_gain_of_one_drive_is_named_with_the_other_that_it_cannot_be_told_from(
    gain: float,
) -> None:
    """Two joints whose bodies' scale nothing fixes: e and -e / (1 + e) make the same torques.

    As a share of the torque that is predicted without it, the true gain is beyond what a drive has.
    """
    given = Model(arm()) + "viscous_friction" + "coulomb_friction"
    with_gain = given + "drive_gain@elbow"
    friction = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
    truth = true_values(with_gain, **friction, e__elbow=gain)
    recordings = (
        synthetic(with_gain, truth, seed, rate_hz=250.0, torque_std=0.1) for seed in (0, 1)
    )
    found = diagnose(given, Dataset(tuple(recordings)))
    (step,) = found.steps
    named = {step.effect.label, *(one.label for one in step.indistinguishable)}
    assert named == {"drive_gain@shoulder", "drive_gain@elbow"}
    values = {one.effect.label: one.values for one in found.candidates}
    assert values["drive_gain@elbow"] == pytest.approx((gain,), abs=0.02)
