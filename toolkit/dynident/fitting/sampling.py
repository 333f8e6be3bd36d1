"""A recording as rows of a regression: filtered, differentiated, low-passed and decimated.

Columns are evaluated at the full rate, where friction is what it is, and then pass the same
low-pass as the torque; in blocks, so that a regressor at the full rate never exists as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.effects import Block
from dynident.errors import RecordingError
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Filter,
    FilterBlock,
    Motion,
    MotionInParts,
    ParallelFilter,
    Recording,
    default_filter,
    uniform,
    usable_rows,
)

BLOCK = 8192
"""Samples at the full rate that are evaluated at a time, at most."""

_MEMORY = 2**27
"""Bytes that the columns of a block are meant to take: more than 12 joints get fewer samples.

No bound: a block is never shorter than twice the filter's overlap, which grows with the sampling
rate over the cut-off, and has an overlap on either side besides.
"""
_LEAST_BLOCK = 2048  # of many fewer each has a larger part of what a block costs

LEAST_ROWS = 20
"""Rows below which a recording says too little."""

_OF_CUTOFF, _OF_POSITIONS = 20.0, 5.0
"""Rate of a thinned motion over the cut-offs of columns and of positions, at least."""

Evaluate = Callable[[Block], list[np.ndarray]]
"""Columns of a block, each (T, ...)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Sampled:
    """A recording ready for evaluation; what is not asked for is not computed.

    Attributes
    ----------
    recording : on a uniform clock.
    source : its motion at the full rate, before decimation, part by part; or thinned.
    parallel : the low-pass and decimation of columns and torque.
    kept : decimated rows that are used, see `usable_rows`.
    at_once : samples at the full rate that are evaluated at a time, at most.
    unthinned : the recording with all its samples, see `thinned`; None where none is left out.
    """

    recording: Recording
    source: MotionInParts | Motion
    parallel: ParallelFilter
    kept: slice
    at_once: int = BLOCK
    unthinned: Sampled | None = None

    @property
    def motion(self) -> Motion:
        """The motion before decimation, as a whole."""
        return self.source.whole

    @property
    def count(self) -> int:
        """How many decimated rows are used, T."""
        return self.kept.stop - self.kept.start

    @cached_property
    def t(self) -> np.ndarray:
        """Time stamps of the decimated rows, (T,) s."""
        rows = self.parallel.rows(self.source.samples, self.kept)
        return self.recording.t[self.source.first + self.source.every * rows]

    @cached_property
    def counting(self) -> np.ndarray:
        """Rows that count at each joint, (T, n) mask: not those around its stops."""
        shape = self.count, self.recording.n
        if not any(map(len, self.recording.stops)):
            return np.broadcast_to(True, shape)  # one number: no memory
        found = np.ones(shape, dtype=bool)
        for j, stops in enumerate(self.recording.stops):
            begun = np.searchsorted(stops[:, 0], self.t, side="right") - 1
            over = self.t > np.append(stops[:, 1], -np.inf)[begun]
            found[:, j] = (begun < 0) | over
        return found

    def counted(self, x: np.ndarray, kept: slice | None = None) -> np.ndarray:
        """Return rows with zeros in place of those that do not count.

        Parameters
        ----------
        x : (T, n, ...)
        kept : which of the decimated rows they are; by default all that are used.
        """
        if not any(map(len, self.recording.stops)):
            return x
        some = kept or self.kept
        mask = self.counting[some.start - self.kept.start : some.stop - self.kept.start]
        return np.where(mask.reshape(*mask.shape, *[1] * (x.ndim - 2)), x, 0.0)

    @property
    def q(self) -> np.ndarray:
        """Positions in the decimated rows, (T, n) rad or m."""
        return self._decimated[0]

    @property
    def v(self) -> np.ndarray:
        """Their derivative in the decimated rows, (T, n)."""
        return self._decimated[1]

    @property
    def a(self) -> np.ndarray:
        """Their second derivative in the decimated rows, (T, n)."""
        return self._decimated[2]

    @cached_property
    def tau(self) -> np.ndarray:
        """Torque in the decimated rows, (T, n) N m or N."""
        return self._each(lambda motion: [motion.tau])[0]

    @cached_property
    def _decimated(self) -> list[np.ndarray]:
        return self._each(lambda motion: [motion.q, motion.v, motion.a])

    def _each(self, signals: Callable[[Motion], list[np.ndarray]]) -> list[np.ndarray]:
        """Decimated rows of signals of the motion, (T, n) each."""
        parts = [
            self.parallel.apply_each(signals(self.source.part(plan.raw)), plan)
            for plan in self.parallel.blocks(self.source.samples, BLOCK, self.kept)
        ]
        return [np.concatenate(pieces) for pieces in zip(*parts, strict=True)]

    @property
    def rate_hz(self) -> float:
        """Rate of the decimated rows."""
        return self.parallel.output_rate_hz

    def thinned(self, least_hz: float) -> Sampled:
        """Return the same rows, made of fewer samples where the recording has more than they need.

        Of a low-passed motion a tenth of the samples, say, hold as much. Where columns are
        evaluated once that saves little; a search evaluates hundreds. Columns that change within
        a sample, as friction that reverses sharply, are those of a robot recorded at that rate.

        Parameters
        ----------
        least_hz : rate of the samples, at least; and 20 times the cut-off of columns and torque,
            5 times that of the positions. Recipes with decimation or ends of their own are
            followed to the letter.
        """
        filter = self.parallel.filter
        cutoff, of_positions = filter.cutoff_hz, filter.position_cutoff_hz
        recipe = filter.decimation != "pick" or filter.ends == "keep"
        if recipe or cutoff is None or of_positions is None:
            return self
        enough = max(least_hz, _OF_CUTOFF * cutoff, _OF_POSITIONS * of_positions)
        parallel, every = self.parallel.thinned(int(self.parallel.rate_hz / enough + 1e-9))
        if every == 1:
            return self
        motion = self.source.part(slice(0, self.source.samples)).thinned(every)
        return replace(self, source=motion, parallel=parallel, unthinned=self)

    def columns(self, model: Model, values: np.ndarray | None = None) -> Iterator[np.ndarray]:
        """Columns of a model block by block, (T, n, p) as decimated rows.

        Rows that do not count are zero, here and in `rows` and `residuals`. Effects that need the
        whole recording see it once; the regressor is made in blocks.

        Parameters
        ----------
        values : (p,) parameters at which columns that depend on the fitted model are taken.
        """
        for plan, block, known, _ in self._blocks(model, values):
            columns = self.parallel.apply_block(model.columns(block, values, known), plan)
            yield self.counted(columns, plan.kept)
            del columns  # whose memory is used for the next ones

    def rows(
        self, model: Model, values: np.ndarray | None = None
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """As `columns`, with the torque (T, n) of the same rows."""
        for plan, block, known, torque in self._blocks(model, values):
            # No name is left on the columns: their memory is used for the next ones.
            yield (
                self.counted(
                    self.parallel.apply_block(model.columns(block, values, known), plan), plan.kept
                ),
                self.counted(self.parallel.apply_block(torque, plan), plan.kept),
            )

    def residuals(self, model: Model, values: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
        """What a model leaves of the torque and that torque, block by block, (T, n) each.

        By inverse dynamics where the model permits: a torque costs less than its columns.

        Parameters
        ----------
        values : (p,) the model's parameters.
        """
        for plan, block, known, torque in self._blocks(model, values):
            if any(effect.needs_torque or effect.is_payload for effect in model.effects):
                predicted = model.torque(block, values, known)
            else:
                predicted = model.torque_without_loads(block, values, known)
            found = self.parallel.apply_each([torque - predicted, torque], plan)
            yield tuple(self.counted(one, plan.kept) for one in found)

    def _blocks(
        self, model: Model, values: np.ndarray | None
    ) -> Iterator[tuple[FilterBlock, Block, dict[str, np.ndarray], np.ndarray]]:
        """Yield plans with what they evaluate: samples, columns that are known, and the torque."""
        known = self.whole_columns(model, values)
        for plan in self.plans(model):
            here = {label: own[plan.raw] for label, own in known.items()}
            motion = self.source.part(plan.raw)
            yield plan, self._block(model, motion, plan.raw), here, motion.tau

    def whole_columns(
        self, model: Model, values: np.ndarray | None = None
    ) -> dict[str, np.ndarray]:
        """Columns at the full rate of the effects that need the whole recording, by label."""
        if not any(effect.needs_recording for effect in model.effects):
            return {}
        return model.whole_columns(self.block(model), values)

    def filtered(self, columns: np.ndarray) -> np.ndarray:
        """Decimated rows of columns at the full rate, (T, ...)."""
        return self.filtered_each([columns])[0]

    def filtered_each(self, columns: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Decimated rows of several columns at the full rate, (T, ...) each."""
        return [one[self.kept] for one in self.parallel.apply_each(columns)]

    def decimate(self, model: Model, evaluate: Evaluate) -> list[np.ndarray]:
        """Evaluate columns block by block; all of their decimated rows."""
        parts = [
            self.parallel.apply_each(evaluate(self.block(model, plan.raw)), plan)
            for plan in self.plans(model)
        ]
        return [np.concatenate(pieces) for pieces in zip(*parts, strict=True)]

    @property
    def layout(self) -> Hashable:
        """What the blocks of its rows depend on: recordings of one layout are filtered at once."""
        filter = self.parallel
        rows = (self.source.samples, self.kept.start, self.kept.stop, self.at_once)
        return filter.filter, filter.rate_hz, filter.period, *rows

    def block(self, model: Model, raw: slice = slice(None)) -> Block:
        """Samples at the full rate as effects see them; all of them by default.

        Parameters
        ----------
        model : for the robot.
        raw : which samples.
        """
        if raw == slice(None):
            return replace(
                self._block(model, self.motion, slice(0, self.source.samples)),
                period=self.recording.period,
            )
        return self._block(model, self.source.part(raw), raw)

    def _block(self, model: Model, motion: Motion, raw: slice) -> Block:
        """Some samples of the motion as effects see them."""
        recording, temperature = self.recording, getattr(self.recording, "temperature", None)
        if temperature is not None:
            first, every = self.source.first, self.source.every
            start, stop, _ = raw.indices(self.source.samples)
            temperature = temperature[first + every * start : first + every * stop : every]
        return model.block(
            motion.t + recording.start,
            motion.q,
            motion.v,
            motion.a,
            carries_payload=bool(recording.payload),
            number=getattr(recording, "number", 0),
            temperature=temperature,
        )

    def plans(self, model: Model) -> Iterator[FilterBlock]:
        """Blocks whose rows are used."""
        fitting = _MEMORY // (8 * model.robot.n * model.size)
        size = min(self.at_once, max(_LEAST_BLOCK, fitting))
        return self.parallel.blocks(self.source.samples, size, self.kept)


def decimate_each(
    every: Sequence[Sampled],
    model: Model,
    evaluate: Callable[[Sampled, slice], list[np.ndarray]],
) -> list[list[np.ndarray]]:
    """As `Sampled.decimate`, of several recordings: those of one layout are filtered at once.

    Parameters
    ----------
    every : the recordings.
    model : as for `Sampled.decimate`.
    evaluate : columns of a recording's samples at the full rate, of all that are told.

    Returns
    -------
    For each recording its columns.
    """
    found: dict[Sampled, list[np.ndarray]] = {}
    for layout in dict.fromkeys(one.layout for one in every):
        some = [one for one in every if one.layout == layout]
        first, parts = some[0], []
        for plan in first.plans(model):
            columns = [evaluate(one, plan.raw) for one in some]
            parts.append(first.parallel.apply_each([x for each in columns for x in each], plan))
        whole = [np.concatenate(pieces) for pieces in zip(*parts, strict=True)]
        count = len(whole) // len(some)
        found |= {one: whole[k * count : (k + 1) * count] for k, one in enumerate(some)}
    return [found[one] for one in every]


def sample(recording: Recording, settings: Filter | None) -> Sampled:
    """Prepare a recording for evaluation.

    Parameters
    ----------
    recording : resampled here if its clock is jittered.
    settings : None for `default_filter` at the recording's rate.

    Raises
    ------
    RecordingError
        If fewer than `LEAST_ROWS` rows are left, or the filter does not suit the recording.
    """
    recording = uniform(recording)
    settings = settings or default_filter(recording.rate_hz)
    source = MotionInParts(recording, settings)
    rate = source.rate_hz
    parallel = ParallelFilter(settings, rate, recording.period, recording.where)
    kept = usable_rows(recording, parallel, source.first, source.samples)
    count = kept.stop - kept.start
    if count < LEAST_ROWS:
        what = f"only {count} rows are left after filtering and decimation"
        if settings.ends == "drop":
            edge = max(settings.margins(rate)) / rate + parallel.transient
            what += f", which take {edge:.2g} s at each end"
        remedy = f"at least {LEAST_ROWS} are needed: record longer, or raise rate_hz or the "
        raise RecordingError(what, recording.where, remedy + "cut-offs in [filter]")
    return Sampled(recording=recording, source=source, parallel=parallel, kept=kept)


def flagged(sampled: Sampled, payload: bool | None) -> Sampled:
    """Return the recording with or without the payload on board."""
    return replace(sampled, recording=sampled.recording.replace(payload=payload))


def rows(
    model: Model, dataset: Dataset, values: np.ndarray | None = None
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rows of the regression of all recordings, in blocks.

    Parameters
    ----------
    values : (p,) parameters at which columns that depend on the fitted model are taken.

    Yields
    ------
    columns (T, n, p) and torque (T, n)
    """
    for recording in dataset.recordings:
        yield from sample(recording, dataset.filter).rows(model, values)
