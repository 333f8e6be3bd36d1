"""Part of a recording as it was, as it is seen, and as it is seen once more with noise.

The bias of a fit need not be known to many digits: of a long recording the middle is enough.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dynident.fitting.sampling import BLOCK, Sampled, sample
from dynident.fitting.uncertainty.trembling import trembling
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Filter,
    Motion,
    Recording,
    default_filter,
    default_position_cutoff,
    differentiate,
)
from dynident.recording.filters import FORGOTTEN, butterworth, memory
from dynident.recording.white_noise import encoder_noise_std

_POINTS = (0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5)
"""Shares of a step at which a mean over it is taken (Gauss, two points)."""
_PASSES = 4  # of the positions' low-pass and of sums in time, that `trembling` takes one by one
_HELD = 4  # motions whose columns of a block are held at a time, as decimated rows
_MEMORY = 12 * 2**20
"""Bytes that these are meant to take, with those of one motion before they are decimated."""
_LEAST_BLOCK = 1792  # samples; of many fewer each has a larger part of what a block costs
_FINEST = 1e-7
"""Noise over a joint's travel that no encoder is below: what high differences show of smooth motion
without noise is less."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NoisyColumns:
    """Columns of some rows, (T, n, p) each.

    Attributes
    ----------
    seen : of the motion as it is seen.
    true : of the motion as it was, in the mean; None where all is seen.
    mean : of those with noise and with its mirror image.
    half : half of what these two differ by.
    """

    seen: np.ndarray
    true: np.ndarray | None
    mean: np.ndarray
    half: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class NoisyPart:
    """A recording with its motion as it was, as it is seen, and seen once more with noise.

    Attributes
    ----------
    sampled : whose motion is the seen one.
    true : two motions whose columns have those of the true motion for their mean, without
        what averages out; none where all is seen.
    noisy : with noise and with its mirror image: what is odd cancels.
    position_std : (n,) rad or m.
    share : of the recording's rows.
    """

    sampled: Sampled
    true: tuple[Motion, ...]
    noisy: tuple[Motion, Motion]
    position_std: np.ndarray
    share: float

    @classmethod
    def of(
        cls,
        model: Model,
        dataset: Dataset,
        values: np.ndarray,
        recording: Recording,
        most: int,
    ) -> NoisyPart:
        """Make it of a recording, or of the middle of a long one.

        Parameters
        ----------
        model, values : (p,) the fit.
        dataset : its filter and its stated noise count.
        recording : one of it.
        most : samples of which it is made, at most.

        Returns
        -------
        With the share of the recording that it is.
        """
        rate, settings = recording.rate_hz, dataset.filter or default_filter(recording.rate_hz)
        cutoff = settings.position_cutoff_hz or default_position_cutoff(rate, settings.cutoff_hz)
        # Without a low-pass the true motion is sought behind one, and noise is added without.
        behind = replace(settings, position_cutoff_hz=cutoff, difference_order=settings.order)  # type: ignore[arg-type]
        whole = sample(recording, behind)
        recording, fewer = whole.recording, max(1, round(most / whole.parallel.step))
        sampled = _middle(whole, behind, model, fewer)
        recording = sampled.recording
        hidden = trembling(model, values, recording, cutoff)
        std = encoder_noise_std(recording.q - hidden.q)
        std = np.where(std > _FINEST * np.ptp(recording.q, axis=0), std, 0.0)
        if dataset.noise is not None:
            std = np.asarray(dataset.noise.position_std, dtype=float)
        noise = std * np.random.default_rng(0).standard_normal(recording.q.shape)
        seen, added = sampled.motion, _added(recording, noise, settings, sampled)
        rows = slice(seen.first, seen.first + seen.samples)
        if settings.position_cutoff_hz is None:
            seen = _moved(seen, _added(recording, hidden.q, settings, sampled), 1.0)
            true = ()
        else:
            # Along straight lines from sample to sample. What is odd cancels: it is no bias.
            one, other = (hidden.between(share)[rows] for share in _POINTS)
            true = (replace(seen, v=seen.v + one), replace(seen, v=seen.v - other))
        fewer = min(sampled.count, fewer)
        start = sampled.kept.start + (sampled.count - fewer) // 2
        held = 1.0 + _HELD / sampled.parallel.step  # rows for each sample
        fitting = int(_MEMORY / held) // (8 * model.robot.n * model.size)
        at_once = min(BLOCK, max(_LEAST_BLOCK, fitting))
        return cls(
            sampled=replace(
                sampled, source=seen, kept=slice(start, start + fewer), at_once=at_once
            ),
            true=true,
            noisy=(_moved(seen, added, 1.0), _moved(seen, added, -1.0)),
            position_std=std,
            share=fewer / whole.count,
        )

    def columns(self, model: Model, values: np.ndarray) -> Iterator[NoisyColumns]:
        """Yield the columns of the motions, block by block.

        Parameters
        ----------
        model, values : (p,) the fit.
        """
        # One after the other, in each other's place: every block of columns takes megabytes.
        seen, draw, mirrored, *others = (
            replace(self.sampled, source=one).columns(model, values)
            for one in (self.sampled.motion, *self.noisy, *self.true)
        )
        for mean in draw:
            half = next(mirrored)
            half -= mean
            half *= -0.5
            mean -= half
            true = None
            if others:
                true = next(others[0])
                true += next(others[1])
                true *= 0.5
            yield NoisyColumns(seen=next(seen), true=true, mean=mean, half=half)
            del mean, half, true


def _middle(whole: Sampled, settings: Filter, model: Model, rows: int) -> Sampled:
    """A recording's middle, of so many decimated rows and what its filters need around them.

    Effects that have a memory need all of it.
    """
    motion, parallel = whole.source, whole.parallel
    if rows >= whole.count or any(effect.needs_recording for effect in model.effects):
        return whole
    start = whole.kept.start + (whole.count - rows) // 2
    first, last = parallel.rows(motion.samples, slice(start, start + rows))[[0, -1]] + motion.first
    assert settings.position_cutoff_hz is not None
    sections = butterworth(motion.rate_hz, settings.position_cutoff_hz)
    around = parallel.overlap + _PASSES * memory(sections, FORGOTTEN)
    some = slice(max(0, int(first) - around), int(last) + around + 1)
    recording = whole.recording
    if some.start == 0 and some.stop >= recording.samples:
        return whole
    return sample(recording.part(some).replace(window=None), replace(settings, edge_s=(0.0, 0.0)))


def _added(recording: Recording, q: np.ndarray, settings: Filter, sampled: Sampled) -> Motion:
    """What positions (T, n) do to a motion behind a filter, on the rows of a sampled recording."""
    motion, rate = sampled.motion, sampled.motion.rate_hz
    after = recording.samples - motion.first - motion.samples
    edges = replace(settings, edge_s=(motion.first / rate, after / rate))
    return differentiate(recording.replace(q=q), edges)


def _moved(motion: Motion, other: Motion, factor: float) -> Motion:
    return replace(
        motion,
        q=motion.q + factor * other.q,
        v=motion.v + factor * other.v,
        a=motion.a + factor * other.a,
    )
