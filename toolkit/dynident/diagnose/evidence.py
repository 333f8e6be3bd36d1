"""Training data in the form in which the diagnosis looks at it.

Columns of the model and of every candidate, low-passed and decimated like the torque, in versions
that can be compared: the repetitions of a period; or the record and copies with more of the stated
noise; or the bare record where neither is known.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynident.diagnose.moments import Kind
from dynident.diagnose.noise import ORDER, NoiseModel
from dynident.effects import Block, Effect, JointEffect
from dynident.fit.sampling import Sampled, flagged, sample
from dynident.model import Model
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


@dataclass
class ColumnStore:
    """Columns of the rigid body and of effects for every run, computed once.

    Payload columns are kept as if every recording carried it; `of` applies who does.
    """

    model: Model
    runs: tuple[Run, ...]
    _rigid: list[Signals] = field(default_factory=list)
    _known: dict[Effect, list[Signals]] = field(default_factory=dict)
    _torque: dict[tuple[Hashable, int], list[np.ndarray]] = field(default_factory=dict)

    def prepare(self, effects: Iterable[Effect]) -> None:
        """Compute the rigid body's columns and those of many effects in one pass."""
        wanted = [e for e in effects if e not in self._known and "torque" not in e.needs]
        base = self.model.base.independent
        self._rigid = []
        for effect in wanted:
            self._known[effect] = []
        for run in self.runs:
            rigid: Signals = []
            found: dict[Effect, Signals] = {effect: [] for effect in wanted}
            for version in run.versions:

                def evaluate(block: Block) -> list[np.ndarray]:
                    assert block.rigid is not None
                    loaded = replace(block, carries_payload=True)
                    return [block.rigid[:, :, base], *(acting(e, loaded) for e in wanted)]

                first, *others = version.decimate(self.model, evaluate)
                rigid.append(first)
                for effect, columns in zip(wanted, others, strict=True):
                    found[effect].append(columns)
            self._rigid.append(rigid)
            for effect in wanted:
                self._known[effect].append(found[effect])

    def forget(self, effect: Effect) -> None:
        """Drop the columns of an effect, tried once and not needed again."""
        self._known.pop(effect, None)

    def rigid(self, run: int) -> Signals:
        """Columns of the base parameters, (T, n, b) for each version."""
        return self._rigid[run]

    def of(self, effect: Effect, run: int, model: Model, values: np.ndarray | None) -> Signals:
        """Columns of an effect at the joints where it acts, (T, J, k) for each version.

        `model` and its parameters are those whose predicted torque some columns depend on.
        """
        if "torque" in effect.needs:
            return self._loaded(effect, run, model, values)
        if effect not in self._known:
            self._known[effect] = [[self._plain(effect, v) for v in r.versions] for r in self.runs]
        return self._known[effect][run]

    def _plain(self, effect: Effect, version: Sampled) -> np.ndarray:
        return version.decimate(
            self.model,
            lambda block: [acting(effect, replace(block, carries_payload=True))],
            rigid="rigid" in effect.needs,
        )[0]

    def _loaded(self, effect: Effect, run: int, model: Model, values: np.ndarray | None) -> Signals:
        """Columns that depend on the predicted torque."""
        versions = self.runs[run].versions
        if effect.linear_in_torque:
            return [
                acting(effect, replace(self._rows(v), torque=torque))
                for v, torque in zip(versions, self._filtered(run, model, values), strict=True)
            ]
        torques = self._predicted(run, model, values)
        found = []
        for version, torque in zip(versions, torques, strict=True):
            motion = version.motion
            block = self.model.block(motion.t, motion.q, motion.v, motion.a, rigid=False)
            columns = acting(effect, replace(block, torque=torque))
            found.append(version.parallel.apply(columns)[version.kept])
        return found

    def _rows(self, version: Sampled) -> Block:
        return self.model.block(version.t, version.q, version.v, version.a, rigid=False)

    def _filtered(self, run: int, model: Model, values: np.ndarray | None) -> list[np.ndarray]:
        """Decimated rows of the torque that the model predicts, but for effects that scale it."""
        values = np.zeros(model.size) if values is None else values
        base = len(model.base.independent)
        found = [rigid @ values[:base] for rigid in self.rigid(run)]
        for effect in model.effects:
            if "torque" in effect.needs:
                continue
            if "payload" in effect.needs and not self.runs[run].recording.payload:
                continue
            joints = list(joints_of(effect, model))
            own = values[model.slices[effect.label]]
            for torque, columns in zip(found, self.of(effect, run, model, values), strict=True):
                torque[:, joints] += columns @ own
        return found

    def _predicted(self, run: int, model: Model, values: np.ndarray | None) -> list[np.ndarray]:
        """Torque at the full rate that the model predicts with these parameters."""
        values = np.zeros(model.size) if values is None else values
        carries = tuple(bool(one.recording.payload) for one in self.runs)
        key = ((model.effects, values.tobytes(), carries), run)
        if key not in self._torque:
            if key[0] not in {known for known, _ in self._torque}:
                self._torque.clear()
            rigid = any("rigid" in one.needs for one in model.effects)
            self._torque[key] = [
                v.full_rate(model, lambda b: model.torque_without_loads(b, values), rigid=rigid)
                for v in self.runs[run].versions
            ]
        return self._torque[key]


def flagged_run(run: Run, carries: bool) -> Run:
    """Return a run marked as carrying the payload, or not."""
    return replace(run, versions=tuple(flagged(v, carries) for v in run.versions))


def joints_of(effect: Effect, model: Model) -> tuple[int, ...]:
    """Joints whose torque an effect changes."""
    if isinstance(effect, JointEffect):
        return (model.robot.names.index(str(effect.joint)),)
    return tuple(range(model.robot.n))


def acting(effect: Effect, block: Block) -> np.ndarray:
    """Columns of an effect at the joints where it acts, (T, J, k)."""
    if isinstance(effect, JointEffect):
        return effect.at_joint(block)[:, None, :]
    return effect.columns(block)
