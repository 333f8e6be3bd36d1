"""What an effect would bring: tests and penalties on the moments."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from scipy import special

from dynident.diagnosis.search.cleared_columns import cleared, drops_at_most
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Signals
from dynident.evidence.time_varying import (
    of_the_torque,
    time_varying_columns,
    time_varying_variants,
)
from dynident.model import Model, not_met
from dynident.moments.replicates import time_varying_products, with_torque_again
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import eigenvectors

Columns = Callable[[Sequence[Effect], Model, np.ndarray], list[list[Signals]]]
"""Columns of variants of an effect, for a model and its values, as `Evidence.columns`."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """What one effect, with one shape, would bring if it were added.

    Attributes
    ----------
    effect : with its shape.
    payload_recordings : which runs carry the payload; None for effects to which that does not
        matter.
    not_identifiable : whether nothing of its columns is left beside the model's.
    rank : number of its parameters that the data can tell.
    drop : of the squared, whitened, noise-free residual.
    share : drop over the squared residual with its noise.
    p_value : before correction for the number of tests; blocks of time are the sampling units.
    penalised : drop less the price of its parameters and of its grid.
    values, sigma : (k,) its parameters and their standard deviations; of a share of the predicted
        torque, of that which the model predicts without it, where that is possible.
    covariance : (k, k) of the values; None where nothing of them can be told.
    fall : of the squared residual with its noise, at the value at which the column is taken. A
        column that noise drives is other in every repetition: that counts against it.
    losses : (B,) held-out squared residual of each block with the effect in the model.
    gains : (B,) held-out squared residual of each block without it less that with it.
    """

    effect: Effect
    payload_recordings: tuple[bool, ...] | None
    not_identifiable: bool
    rank: int = 0
    drop: float = 0.0
    share: float = 0.0
    p_value: float = 1.0
    penalised: float = -np.inf
    values: tuple[float, ...] = ()
    sigma: tuple[float, ...] = ()
    covariance: np.ndarray | None = None
    fall: float = 0.0
    losses: np.ndarray | None = None
    gains: np.ndarray | None = None

    @property
    def parameters(self) -> int:
        """Number of parameters that the effect brings, its shape among them."""
        return len(self.values) + len(self.effect.shape)

    @property
    def drop_at_point(self) -> float:
        """The drop if its value is the one at which its column was taken.

        A column that is not linear in the value says nothing of another value.
        """
        if len(self.values) != 1 or len(self.effect.point) != 1 or self.values[0] == 0:
            return self.drop
        return self.drop * (1.0 - (1.0 - self.effect.point[0] / self.values[0]) ** 2)


@dataclass(frozen=True, eq=False)
class CandidateMoments:
    """Moments of V variants of an effect, each of k columns; one after the other, both kinds.

    Attributes
    ----------
    beside : of the columns of all variants with the model's and the torque, (B, p + 1, V k).
    own : of each variant's columns with themselves, (B, V, k, k).
    """

    beside: SecondMoments
    own: SecondMoments

    def __iter__(self) -> Iterator[tuple[SecondMoments, SecondMoments]]:
        return (self.of(place) for place in range(self.own.total.shape[1]))

    def of(self, place: int) -> tuple[SecondMoments, SecondMoments]:
        """Return the moments of one variant's columns with the model's, and with themselves."""
        width = self.own.total.shape[2]
        columns = slice(place * width, (place + 1) * width)
        return self.beside.columns(columns), self.own.at(place)

    def drops_at_most(self, fitted: EvidenceFit) -> np.ndarray:
        """About what each variant would drop, or more, (V,): which are worth a closer look."""
        return drops_at_most(fitted, self.beside.pooled(), self.own.pooled())


def candidate_moments(
    evidence: Evidence,
    fitted: EvidenceFit,
    variants: Sequence[Effect],
    columns_of: Columns | None = None,
) -> CandidateMoments:
    """Moments of columns with the model's and the torque, and with themselves.

    A payload counts as carried in every run; see `moments_with_payload`.

    Parameters
    ----------
    variants : one effect at one place, with any number of shapes.
    columns_of : where columns come from; `Evidence.columns` by default.

    Returns
    -------
    (B, p + 1, k) and (B, k, k) for each variant
    """
    joints = variants[0].acting_at(fitted.model.robot)
    mixed = variants[0].time_varying or fitted.model.is_time_varying
    columns = (columns_of or evidence.columns)(variants, fitted.model, fitted.values)
    with_model, with_self, width = [], [], columns[0][0][0].shape[2]
    for stack, white_of_model in zip(evidence.stacks, fitted.white, strict=True):
        one, two = [], []
        for position, joint in enumerate(joints):
            parts = [
                [[s[:, position] for s in shapes] for shapes in zip(*columns[r], strict=True)]
                for r in stack.numbers
            ]
            known, noise = white_of_model[joint], fitted.noise[joint]
            white = stack.whitened(parts, joint, noise)
            one.append(known.moments_with(white))
            # Of each variant with itself: what two of them have in common is not asked for.
            apart = white.reshape(len(white), len(variants), width, *white.shape[2:])
            two.append(stack.moments(apart, apart))
            if stack.kind == "repeated" and mixed:
                edges = stack.runs[0].edges
                measured = [each[0] for each in parts], stack.unfolded(white)
                new = time_varying_variants(evidence, variants, stack, joint, noise, measured)
                dense = known.dense()
                old = time_varying_columns(evidence, fitted.model, stack, joint, noise, dense)
                if variants[0].linear_in_torque:
                    new = of_the_torque(new, old, fitted.values)
                known_values = fitted.beside(variants[0]).values
                products = time_varying_products(old.about(known_values), new, edges)
                one[-1] = one[-1].with_signal(with_torque_again(products, known_values))
                two[-1] = two[-1].with_signal(new.products_of_each(width, edges))
        with_model.append(reduce(add, one))
        with_self.append(reduce(add, two))
    return CandidateMoments(SecondMoments.stacked(with_model), SecondMoments.stacked(with_self))


def moments_with_payload(
    part: SecondMoments, evidence: Evidence, payload_recordings: tuple[bool, ...]
) -> SecondMoments:
    """Moments of columns that are zero in the runs which do not carry the payload.

    Parameters
    ----------
    part : of columns that count the payload as carried in every run.
    evidence : the runs, each with its blocks.
    payload_recordings : for each run, whether it carries the payload.

    Returns
    -------
    As `part`, zero in the blocks of the runs that do not.
    """
    blocks = [
        np.full(len(run.edges) - 1, c)
        for run, c in zip(evidence.runs, payload_recordings, strict=True)
    ]
    return part.weighted(np.concatenate(blocks).astype(float))


def score(
    fitted: EvidenceFit,
    effect: Effect,
    with_model: SecondMoments,
    with_self: SecondMoments,
    grid: int,
    payload_recordings: tuple[bool, ...] | None = None,
) -> Score:
    """Score an effect from its moments.

    Parameters
    ----------
    fitted : the model without the effect.
    effect : at one shape.
    with_model : of the effect's columns with the model's and the torque, (B, p + 1, k).
    with_self : of the effect's columns with themselves, (B, k, k).
    grid : number of shapes that were tried.
    payload_recordings : for each run, whether it carries the payload; None for another effect.

    Returns
    -------
    Not yet cross-validated; marked where the model already explains all that it could.
    """
    fitted, own = fitted.beside(effect), with_self.pooled()
    scale = np.sqrt(np.clip(np.diag(own.signal), 0.0, None))
    seen = _seen(effect, fitted, scale)
    if not np.any(seen) or not np.all(np.isfinite(own.signal)):
        return Score(effect=effect, payload_recordings=payload_recordings, not_identifiable=True)
    beside = with_model.pooled()
    found = cleared(fitted, beside, own, seen)
    if found is None:
        return Score(effect=effect, payload_recordings=payload_recordings, not_identifiable=True)
    part, directions, back = found.part, found.directions, found.back
    if part.rank == 0:
        return Score(effect=effect, payload_recordings=payload_recordings, not_identifiable=False)
    p, total, left_total = len(fitted.values), beside.total, found.left_total
    values = directions @ part.values
    drop = found.drop
    covariance = directions @ part.covariance @ directions.T
    at = np.array(effect.point) if len(effect.point) == len(values) else values
    combination = np.append(-fitted.values, 1.0)
    with_model_columns = (combination @ fitted.pooled.total)[:p]
    with_noise = combination @ total - with_model_columns @ back
    penalised = drop - price(fitted, effect, part.rank, grid)
    blocks = _block_scores(fitted, with_model, with_self, back, values) @ directions @ part.basis
    return Score(
        effect=effect,
        payload_recordings=payload_recordings,
        not_identifiable=False,
        rank=part.rank,
        drop=drop,
        share=drop / fitted.error_total,
        p_value=_block_p_value(part.basis.T @ found.moment, blocks),
        penalised=float(penalised),
        values=tuple(float(v) for v in values),
        sigma=tuple(float(s) for s in np.sqrt(np.clip(np.diag(covariance), 0.0, None))),
        covariance=covariance,
        fall=float(2.0 * at @ with_noise - at @ left_total @ at),
    )


def price(
    fitted: EvidenceFit, effect: Effect, rank: int, grid: int | np.ndarray
) -> float | np.ndarray:
    """Return what an effect has to explain at least to count for something.

    Parameters
    ----------
    fitted : the model without it.
    effect : with its shapes.
    rank : number of its parameters that the data can tell.
    grid : number of shapes that were tried, of one or of each of many.

    Returns
    -------
    Squared, whitened residual.
    """
    return (rank + len(effect.shape)) * np.log(fitted.rows) + 2.0 * np.log(grid)


def _seen(effect: Effect, fitted: EvidenceFit, scale: np.ndarray) -> np.ndarray:
    """Which columns, of these norms, could be told from rounding errors at any possible value."""
    bounds = [(p.lower, p.upper) for p in effect.parameters(fitted.model.robot)]
    reach = np.array([max(abs(low), abs(high)) for low, high in bounds])
    return scale > fitted.criteria.gates.unseen * np.sqrt(fitted.rows) / reach


def impossible(one: Score, fitted: EvidenceFit) -> str:
    """What is physically impossible in a score's values; empty where nothing is.

    Of several values some may leave their bounds by their uncertainty. A single one that is out of
    them says that at its bound, where there is no effect, the data are explained better. A level of
    friction is impossible where the joint moved with less.
    """
    if one.not_identifiable:
        return ""
    parameters = one.effect.parameters(fitted.model.robot)
    deviations = fitted.criteria.gates.beyond_bounds if len(one.values) > 1 else 0.0
    for parameter, value, sigma in zip(parameters, one.values, one.sigma, strict=False):
        slack = deviations * sigma
        if value < parameter.lower - slack or value > parameter.upper + slack:
            return f"would need {parameter.name} = {value:.3g} {parameter.unit}"
        if parameter.is_level and one.effect.joint is not None:
            peak = float(fitted.torque_peaks[fitted.model.robot.names.index(one.effect.joint)])
            if value > peak + fitted.criteria.gates.beyond_bounds * sigma:
                return f"would need {not_met(parameter, value, one.effect.joint, peak)}"
    return ""


def admissible(one: Score, evidence: Evidence, fitted: EvidenceFit) -> bool:
    """Return whether a shape may be the best one.

    What the samples do not tell is no better shape, however little it leaves: a spring that only
    gives way, and never resonates, is explained by any stiffness that is high enough.

    Parameters
    ----------
    one : the score of an effect with that shape.
    evidence, fitted : the recordings, and the model without the effect as it fits them.

    Returns
    -------
    Whether its values are possible, and the samples tell them.
    """
    told = not one.effect.unresolved(one.values, evidence.longest_step)
    return told and not impossible(one, fitted)


def _block_scores(
    fitted: EvidenceFit,
    with_model: SecondMoments,
    with_self: SecondMoments,
    back: np.ndarray,
    values: np.ndarray,
) -> np.ndarray:
    """Each block's moment of cleared columns and the residual with the effect in, (B, k)."""
    p = len(fitted.values)
    combination = np.append(-fitted.values + back @ values, 1.0)
    plain = combination @ with_model.signal - with_self.signal @ values
    model = (combination @ fitted.moments.signal)[:, :p] - with_model.signal[:, :p] @ values
    return plain - model @ back


def _block_p_value(moment: np.ndarray, scores: np.ndarray) -> float:
    """Wald test that an effect has no part, with blocks of time as the sampling units.

    Parameters
    ----------
    moment : (k,) of residual without the effect and cleared columns, over all blocks.
    scores : (B, k) the same of each block with the effect in; they sum to zero.
    """
    blocks, k = scores.shape
    if blocks <= k + 1:
        return 1.0
    size, axes = eigenvectors(scores.T @ scores * blocks / (blocks - 1))
    seen = size > 1e-12 * size[-1]
    statistic = float(np.sum((moment @ axes[:, seen]) ** 2 / size[seen]))
    ratio = max(statistic, 0.0) * (blocks - k) / (k * (blocks - 1))
    return float(special.fdtrc(k, blocks - k, ratio))
