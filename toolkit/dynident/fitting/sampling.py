"""A recording as rows of a regression: filtered, differentiated, low-passed and decimated.

Columns are evaluated at the full rate, where friction is what it is, and then pass the same
low-pass as the torque; in blocks, so that a regressor at the full rate never exists as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.effects import Block
from dynident.errors import RecordingError
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Filter,
    FilterBlock,
    Motion,
    ParallelFilter,
    Recording,
    default_filter,
    differentiate,
    uniform,
    usable_rows,
)

BLOCK = 16384
"""Samples at the full rate that are evaluated at a time, at most."""

_MEMORY = 2**27  # bytes of the columns of so many samples: more than 12 joints get fewer
_LEAST_BLOCK = 2048  # fewer do not pay for a function of many samples

LEAST_ROWS = 20
"""Rows below which a recording says too little."""

Evaluate = Callable[[Block], list[np.ndarray]]
"""Columns of a block, each (T, ...)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Sampled:
    """A recording ready for evaluation.

    Attributes
    ----------
    recording : on a uniform clock.
    motion : at the full rate.
    parallel : the low-pass and decimation of columns and torque.
    kept : decimated rows that are used, see `usable_rows`.
    t, q, v, a, tau : decimated rows, (T,) and (T, n).
    """

    recording: Recording
    motion: Motion
    parallel: ParallelFilter
    kept: slice
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    tau: np.ndarray

    @property
    def rate_hz(self) -> float:
        """Rate of the decimated rows."""
        return self.parallel.output_rate_hz

    def columns(self, model: Model, values: np.ndarray | None = None) -> Iterator[np.ndarray]:
        """Columns of a model block by block, (T, n, p) as decimated rows.

        Effects that need the whole recording see it once; the regressor is made in blocks.

        Parameters
        ----------
        values : (p,) parameters at which columns that depend on the fitted model are taken.
        """
        known = self.whole_columns(model, values)
        for plan in self._plans(model):
            here = {label: own[plan.raw] for label, own in known.items()}
            columns = model.columns(self.block(model, plan.raw), values, here)
            yield self.parallel.apply_block(columns, plan)

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
            for plan in self._plans(model)
        ]
        return [np.concatenate(pieces) for pieces in zip(*parts, strict=True)]

    def block(self, model: Model, raw: slice = slice(None)) -> Block:
        """Samples at the full rate as effects see them; all of them by default.

        Parameters
        ----------
        model : for the robot.
        raw : which samples.
        """
        motion, recording = self.motion, self.recording
        temperature = getattr(recording, "temperature", None)
        if temperature is not None:
            temperature = temperature[motion.first : motion.first + motion.samples][raw]
        block = model.block(
            motion.t[raw] + recording.start,
            motion.q[raw],
            motion.v[raw],
            motion.a[raw],
            carries_payload=bool(recording.payload),
            number=getattr(recording, "number", 0),
            temperature=temperature,
        )
        return replace(block, period=recording.period) if raw == slice(None) else block

    def _plans(self, model: Model) -> Iterator[FilterBlock]:
        """Blocks whose rows lie in the recording's window."""
        fitting = _MEMORY // (8 * model.robot.n * model.size)
        size = min(BLOCK, max(_LEAST_BLOCK, fitting))
        for plan in self.parallel.blocks(self.motion.samples, size):
            low, high = max(plan.kept.start, self.kept.start), min(plan.kept.stop, self.kept.stop)
            if high > low:
                rows = slice(low - plan.kept.start, high - plan.kept.start)
                yield FilterBlock(plan.raw, plan.rows[rows], slice(low, high))


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
    motion = differentiate(recording, settings)
    parallel = ParallelFilter(settings, motion.rate_hz, recording.period, recording.where)
    times = parallel.times(motion.t)
    kept = usable_rows(recording, parallel, motion.t, times)
    count = kept.stop - kept.start
    if count < LEAST_ROWS:
        what = f"only {count} rows are left after filtering and decimation"
        if settings.ends == "drop":
            edge = max(settings.margins(motion.rate_hz)) / motion.rate_hz + parallel.transient
            what += f", which take {edge:.2g} s at each end"
        remedy = f"at least {LEAST_ROWS} are needed: record longer, or raise rate_hz or the "
        raise RecordingError(what, recording.where, remedy + "cut-offs in [filter]")
    q, v, a, tau = (parallel.apply(x)[kept] for x in (motion.q, motion.v, motion.a, motion.tau))
    return Sampled(
        recording=recording,
        motion=motion,
        parallel=parallel,
        kept=kept,
        t=times[kept],
        q=q,
        v=v,
        a=a,
        tau=tau,
    )


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
        sampled = sample(recording, dataset.filter)
        start = 0
        for columns in sampled.columns(model, values):
            stop = start + len(columns)
            yield columns, sampled.tau[start:stop]
            start = stop
