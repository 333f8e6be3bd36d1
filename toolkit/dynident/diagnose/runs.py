"""Recordings in versions that can be compared.

The repetitions of a period; or the record and copies with more of the stated noise; or the bare
record where neither is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.diagnose.moments import Kind
from dynident.diagnose.noise import ORDER, NoiseModel
from dynident.fit.sampling import Sampled, flagged, sample
from dynident.recording import (
    Dataset,
    Noise,
    Recording,
    periods,
    require_repetition,
    require_torque,
    uniform,
)

COPIES = 4
"""Noisy copies of each recording where the noise is stated and nothing repeats."""

BLOCKS = 20
"""Blocks of time for cross-validation, over all recordings, at least three in each."""

Signals = list[np.ndarray]
"""One array per version of a recording, (T, J, k): rows, joints of the effect, columns."""


@dataclass(frozen=True)
class Run:
    """One recording and its versions.

    Attributes
    ----------
    kind : how the versions come about.
    versions : the measured record, and its noisy copies where there are any.
    index : (P, S) rows that belong together: repetition p, instant s. For copies, P counts the
        versions and every row of `index` is the same.
    edges : (B + 1,) blocks of instants.
    """

    kind: Kind
    versions: tuple[Sampled, ...]
    index: np.ndarray
    edges: np.ndarray

    @property
    def recording(self) -> Recording:
        """The recording itself."""
        return self.versions[0].recording

    def fold(self, signals: Sequence[np.ndarray]) -> np.ndarray:
        """Arrange signals, (T, ...) for each version, as (P, S, ...)."""
        if self.kind == "repeated":
            return signals[0][self.index]
        return np.stack([one[rows] for one, rows in zip(signals, self.index, strict=True)])

    def whitened(self, signals: Sequence[np.ndarray], joint: int, noise: NoiseModel) -> np.ndarray:
        """Whiten signals, (T, k) for each version, of a joint, and fold them into (P, S, k)."""
        speed = self.versions[0].v[:, joint]
        return self.fold([noise.whiten(one, speed) for one in signals])


def gather(dataset: Dataset, seed: int = 0) -> tuple[Run, ...]:
    """Arrange the recordings of a dataset in versions; see the module.

    Raises
    ------
    RecordingError
        If a recording is too short for its filter, or for two of its periods, or there is no
        torque at all.
    """
    require_torque(dataset.recordings)
    per_run = max(3, -(-BLOCKS // len(dataset.recordings)))
    runs = []
    streams = np.random.default_rng(seed).spawn(len(dataset.recordings))
    repeats = any(r.period for r in dataset.recordings)
    for recording, stream in zip(dataset.recordings, streams, strict=True):
        # Noise on top would hide the signs of a jittered clock: straighten it before.
        recording = uniform(recording)
        first = sample(recording, dataset.filter)
        usable = np.arange(ORDER, len(first.t))
        if recording.period:
            where = recording.where
            found = periods(len(usable), first.rate_hz, recording.period, where)
            require_repetition(first.q[ORDER:], found, where)
            index = ORDER + found.index
            kind: Kind = "repeated"
            versions: tuple[Sampled, ...] = (first,)
        elif dataset.noise and not repeats:
            copies = (noisy(recording, dataset.noise, stream) for _ in range(COPIES))
            versions = (first, *(sample(copy, dataset.filter) for copy in copies))
            index, kind = np.tile(usable, (len(versions), 1)), "perturbed"
        else:
            versions, index, kind = (first,), usable[None, :], "single"
        edges = np.linspace(0, index.shape[1], per_run + 1).round().astype(int)
        runs.append(Run(kind, versions, index, edges))
    return tuple(runs)


def noisy(recording: Recording, noise: Noise, stream: np.random.Generator) -> Recording:
    """Return a copy of a recording with one more draw of the stated noise on it."""
    q = recording.q + noise.position_std * stream.standard_normal(recording.q.shape)
    tau = recording.tau + noise.torque_std * stream.standard_normal(recording.tau.shape)
    return recording.replace(q=q, tau=tau)


def flagged_run(run: Run, carries: bool) -> Run:
    """Return a run marked as carrying the payload, or not."""
    return replace(run, versions=tuple(flagged(v, carries) for v in run.versions))
