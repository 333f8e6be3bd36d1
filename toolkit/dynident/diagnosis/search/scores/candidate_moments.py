"""Moments of the columns that effects would bring, block by block."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Signals
from dynident.evidence.time_varying import (
    of_the_torque,
    time_varying_columns,
    time_varying_variants,
)
from dynident.model import Model
from dynident.moments.replicates import time_varying_products, with_torque_again
from dynident.moments.second_moments import SecondMoments

Columns = Callable[[Sequence[Effect], Model, np.ndarray], list[list[Signals]]]
"""Columns of variants of an effect, for a model and its values, as `Evidence.columns`."""


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
