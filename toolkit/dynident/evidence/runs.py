"""Recordings in replicates that can be compared.

The repetitions of a period; or the record and copies with more of the stated noise; or the bare
record where neither is known. To these comes the same motion simulated, where nothing repeats and
the control loop is known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from dynident.criteria import DEFAULTS, NoiseCriteria
from dynident.effects import Block
from dynident.evidence.columns.windows import shared_motion
from dynident.fitting.sampling import Sampled, flagged, sample
from dynident.model import Model
from dynident.moments.replicates import Kind
from dynident.recording import (
    Dataset,
    Noise,
    Recording,
    as_points,
    periods,
    require_repetition,
    require_torque,
    turning_round,
    uniform,
)

Signals = list[np.ndarray]
"""One array per replicate of a recording, (T, J, k): rows, joints of the effect, columns."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One recording and its replicates.

    Attributes
    ----------
    kind : how the replicates come about, which tells the noise.
    replicates : the measured record, its noisy copies where there are any, and last the simulated
        motion where there is one.
    index : (P, S) rows that belong together: repetition p, instant s. For copies, P counts the
        replicates but for the simulated one and every row of `index` is the same.
    edges : (B + 1,) blocks of instants.
    columns_from : whose motion the columns of the regression are taken along.
    left_out : (T,) rows that are not to be judged, a contact in them; None for none.
    uncertain : (T, n) rows of a joint whose dry friction nothing tells, as it sticks: they count
        neither in fits nor where effects are judged; None for none.
    """

    kind: Kind
    replicates: tuple[Sampled, ...]
    index: np.ndarray
    edges: np.ndarray
    columns_from: Literal["recording", "simulation"] = "recording"
    left_out: np.ndarray | None = None
    uncertain: np.ndarray | None = None

    @property
    def certain_rows(self) -> np.ndarray:
        """Rows by which each joint is judged, (T, n) mask."""
        everywhere = np.ones(self.replicates[0].tau.shape, dtype=bool)
        return everywhere if self.uncertain is None else ~self.uncertain

    def certain(self, joint: int) -> np.ndarray:
        """Instants (S,) at which a joint's dry friction is known in every repetition, a mask."""
        return self.certain_instants[:, joint]

    @cached_property
    def certain_instants(self) -> np.ndarray:
        """The same of every joint, (S, n)."""
        if self.uncertain is None:
            return np.ones((self.index.shape[1], self.replicates[0].tau.shape[1]), dtype=bool)
        return np.asarray(~self.uncertain[self.index].any(axis=0))

    def told(self, joint: int) -> np.ndarray | None:
        """Rows (T,) whose dry friction is known at a joint, a mask; None for all of them.

        Whitening looks back: rows that are not would be seen in those after them. Alike in all
        repetitions.
        """
        if self.uncertain is None:
            return None
        told = ~self.uncertain[:, joint]
        told[self.index[:, ~self.certain(joint)]] = False
        return told

    def noisy_speeds(self, joint: int) -> list[np.ndarray]:
        """Velocity of a joint (S,) in each replicate whose noise the others tell."""
        certain = self.certain(joint)
        if self.kind == "single" or not certain.any():
            return []
        told = self.index if self.kind == "repeated" else self.index[1:]
        return list(self.replicates[0].v[:, joint][told][:, certain])

    @property
    def kept(self) -> np.ndarray:
        """Rows of the recording that are judged, (T,) mask."""
        whole = np.ones(len(self.replicates[0].t), dtype=bool)
        return whole if self.left_out is None else ~self.left_out

    @property
    def block_of_rows(self) -> np.ndarray:
        """The block of instants, by number, that each row is in, (T,); all its repetitions alike.

        Rows before the first instant and after the last one are in the block that is next to them.
        """
        blocks = np.repeat(np.arange(len(self.edges) - 1), np.diff(self.edges))
        rows, first = np.unique(self.index, return_index=True)
        of_rows = blocks[first % self.index.shape[1]]
        near = np.searchsorted(rows, np.arange(len(self.replicates[0].t)), side="right") - 1
        return of_rows[np.maximum(near, 0)]

    @property
    def recording(self) -> Recording:
        """The recording itself."""
        return self.replicates[0].recording

    def rows(self, model: Model) -> Block:
        """Return the decimated rows as effects see them, with their time in the session.

        For what varies slowly: the motion and its temperatures, and no regressor.
        """
        first, recording = self.replicates[0], self.recording
        temperature = None
        if recording.temperature is not None:
            columns = recording.temperature.T
            at = [np.interp(first.t, recording.t, column) for column in columns]
            temperature = np.stack(at, axis=1)
        start, motion = recording.start, (first.q, first.v, first.a)
        return model.block(first.t + start, *motion, temperature=temperature)

    def fold(self, signals: Sequence[np.ndarray]) -> np.ndarray:
        """Arrange measured signals, (T, ...) for each replicate, as (P, S, ...)."""
        if self.kind == "repeated":
            return signals[0][self.index]
        return np.stack([one[rows] for one, rows in zip(signals, self.index, strict=False)])


def gather(
    dataset: Dataset,
    criteria: NoiseCriteria = DEFAULTS.noise,
    *,
    simulated: Dataset | None = None,
    samples_hz: float = math.inf,
    seed: int = 0,
) -> tuple[Run, ...]:
    """Arrange the recordings of a dataset in replicates; see the module.

    Parameters
    ----------
    dataset : the recordings.
    criteria : copies, and blocks of time.
    simulated : the motion of each recording, simulated, on the same time stamps.
    samples_hz : rate to which recordings are thinned, see `Sampled.thinned`; by default none is.
    seed : of the noise on the copies.

    Returns
    -------
    A run for each recording, in their order.

    Raises
    ------
    RecordingError
        If a recording is too short for its filter, or for two of its periods, or there is no
        torque at all.
    """
    require_torque(dataset.recordings)
    per_run = max(criteria.blocks_per_recording, -(-criteria.blocks // len(dataset.recordings)))
    runs: list[Run] = []
    streams = np.random.SeedSequence(seed).spawn(len(dataset.recordings))
    repeats = any(r.period for r in dataset.recordings)
    for number, recording in enumerate(dataset.recordings):
        # Noise on top would hide the signs of a jittered clock: straighten it before.
        recording = uniform(recording)
        whole = sample(recording, dataset.filter).thinned(samples_hz)
        first = shared_motion(whole, (r.replicates[0] for r in runs))
        usable = np.arange(criteria.order, len(first.t))
        if recording.period:
            where = recording.where
            found = periods(len(usable), first.rate_hz, recording.period, where)
            points = as_points(first.q[criteria.order :], turning_round(recording))
            require_repetition(points, found, where)
            index = criteria.order + found.index
            kind: Kind = "repeated"
            replicates: tuple[Sampled, ...] = (first,)
        elif dataset.noise and not repeats:
            # Where columns come from elsewhere, the copies tell the size of the noise only.
            count = criteria.copies if simulated is None else criteria.copies_beside_simulation
            # Windows of one recording have the same noise on their copies: each is evaluated once.
            windows = [k for k, run in enumerate(runs) if run.replicates[0].motion is first.motion]
            stream = np.random.default_rng(streams[windows[0] if windows else number])
            known = runs[windows[0]].replicates if windows else ()
            copies = (noisy(recording, dataset.noise, stream) for _ in range(count))
            replicates = (
                first,
                *(
                    shared_motion(sample(copy, dataset.filter).thinned(samples_hz), known)
                    for copy in copies
                ),
            )
            index, kind = np.tile(usable, (len(replicates), 1)), "noise_augmented"
        else:
            replicates, index, kind = (first,), usable[None, :], "single"
        edges = np.linspace(0, index.shape[1], per_run + 1).round().astype(int)
        uncertain = None if first.counting.all() else ~first.counting
        runs.append(
            Run(kind=kind, replicates=replicates, index=index, edges=edges, uncertain=uncertain)
        )
    if simulated is None:
        return tuple(runs)
    return tuple(
        replace(run, replicates=(*run.replicates, motion), columns_from="simulation")
        for run, motion in zip(runs, simulated_versions(runs, simulated), strict=True)
    )


def simulated_versions(runs: Sequence[Run], simulated: Dataset) -> tuple[Sampled, ...]:
    """Simulated motions, filtered and cut as the recordings of these runs are."""
    return tuple(
        shared_motion(
            sample(
                one.replace(window=run.recording.window, payload=run.recording.payload),
                simulated.filter,
            ).thinned(run.replicates[0].parallel.rate_hz)
        )
        for run, one in zip(runs, simulated.recordings, strict=True)
    )


def resimulated(runs: Sequence[Run], simulated: Dataset) -> tuple[Run, ...]:
    """Return runs with other simulated motions in place of theirs."""
    return tuple(
        replace(run, replicates=(*run.replicates[:-1], motion))
        for run, motion in zip(runs, simulated_versions(runs, simulated), strict=True)
    )


def noisy(recording: Recording, noise: Noise, stream: np.random.Generator) -> Recording:
    """Return a copy of a recording with one more draw of the stated noise on it.

    Parameters
    ----------
    recording : on a uniform clock.
    noise : standard deviations of position (rad or m) and torque (N m or N), (n,) each.
    stream : of random numbers.
    """
    q = recording.q + noise.position_std * stream.standard_normal(recording.q.shape)
    tau = recording.tau + noise.torque_std * stream.standard_normal(recording.tau.shape)
    return recording.replace(q=q, tau=tau)


def flagged_run(run: Run, carries: bool | None) -> Run:
    """Return a run marked as carrying the payload, or not, or as nobody knows."""
    return replace(run, replicates=tuple(flagged(v, carries) for v in run.replicates))
