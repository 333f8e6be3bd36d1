"""Training data in the form in which the diagnosis looks at it.

Columns of the model and of every candidate, low-passed and decimated like the torque, for every
version of every run.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Block, Effect, JointEffect
from dynident.evidence.runs import Run, Signals
from dynident.fitting.sampling import Sampled
from dynident.model import Model

_SHARED = 50_000
"""Samples up to which a recording's torque and its derivatives are kept for several effects."""
_TOGETHER = 500_000
"""Samples, over all shapes, up to which responses in several recordings are evaluated at once."""


@dataclass
class Evidence:
    """Columns of the rigid body and of effects for every run, computed once.

    Payload columns are kept as if every recording carried it; `of` applies who does.
    """

    model: Model
    runs: tuple[Run, ...]
    criteria: Criteria = DEFAULTS
    _rigid: list[Signals] = field(default_factory=list)
    _known: dict[Effect, list[Signals]] = field(default_factory=dict)
    _now: Hashable = None
    _present: dict[Hashable, Signals] = field(default_factory=dict)
    _blocks: dict[Hashable, Block] = field(default_factory=dict)
    _screened: dict[Hashable, Signals] = field(default_factory=dict)
    _full: dict[Hashable, np.ndarray] = field(default_factory=dict)
    _simulation: Evidence | None = None

    @property
    def simulation(self) -> Evidence | None:
        """Evidence of the simulated motion alone, which is all that candidates need of it."""
        if any(run.columns_from == "recording" for run in self.runs):
            return None
        runs = tuple(
            replace(run, replicates=run.replicates[-1:], columns_from="recording")
            for run in self.runs
        )
        if self._simulation is None:
            self._simulation = Evidence(self.model, runs, self.criteria)
        self._simulation.runs = runs  # who carries the payload may have been found out
        return self._simulation

    def prepare(self, effects: Iterable[Effect]) -> None:
        """Compute the rigid body's columns and those of many effects in one pass.

        Effects that depend on the present model, or need the whole recording, are left for `of`.
        """
        if self.simulation is not None:
            effects = list(effects)
            self.simulation.prepare([e for e in effects if e not in self.model])
            effects = [e for e in effects if e in self.model]
        later = {"torque", "body", "whole"}
        wanted = [e for e in effects if e not in self._known and not e.needs & later]
        base = self.model.base.independent
        self._rigid = []
        for effect in wanted:
            self._known[effect] = []
        for run in self.runs:
            rigid: Signals = []
            found: dict[Effect, Signals] = {effect: [] for effect in wanted}
            for replicate in run.replicates:

                def evaluate(block: Block) -> list[np.ndarray]:
                    assert block.rigid is not None
                    loaded = replace(block, carries_payload=True)
                    return [block.rigid[:, :, base], *(acting(e, loaded) for e in wanted)]

                first, *others = replicate.decimate(self.model, evaluate)
                rigid.append(first)
                for effect, columns in zip(wanted, others, strict=True):
                    found[effect].append(columns)
            self._rigid.append(rigid)
            for effect in wanted:
                self._known[effect].append(found[effect])

    def forget(self, effect: Effect) -> None:
        """Drop the columns of an effect, tried once and not needed again."""
        self._known.pop(effect, None)
        for run in range(len(self.runs)):
            self._present.pop((effect, run), None)
        if self._simulation is not None:
            self._simulation.forget(effect)

    def renew(self, runs: tuple[Run, ...]) -> None:
        """Take runs whose last versions, the simulated motions, are new."""
        wanted = list(self._simulation._known) if self._simulation else []
        self.runs, self._simulation, self._now = runs, None, None
        self._full.clear()
        self.renew_screening()
        fresh = self.simulation
        assert fresh is not None
        fresh.prepare(dict.fromkeys([*wanted, *self._known]))
        for r in range(len(runs)):
            self._rigid[r][-1] = fresh.rigid(r)[0]
            for effect, columns in self._known.items():
                columns[r][-1] = fresh.of(effect, r, self.model, None)[0]

    def rigid(self, run: int) -> Signals:
        """Columns of the base parameters, (T, n, b) for each version."""
        return self._rigid[run]

    def of(self, effect: Effect, run: int, model: Model, values: np.ndarray | None) -> Signals:
        """Columns of an effect at the joints where it acts, (T, J, k) for each version.

        `model` and its parameters are those whose torque and bodies some columns depend on. Of a
        candidate for it along simulated motion, the columns of that motion only.
        """
        if self.simulation is not None and effect not in model:
            return self.simulation.of(effect, run, model, values)
        if effect.linear_in_torque:
            rows = zip(self.runs[run].replicates, self._filtered(run, model, values), strict=True)
            return [acting(effect, replace(self._rows(v), torque=torque)) for v, torque in rows]
        if effect.needs & {"torque", "body"}:
            return self._of_present(effect, run, model, values)
        if effect not in self._known:
            self._known[effect] = [
                [self._plain(effect, v) for v in r.replicates] for r in self.runs
            ]
        return self._known[effect][run]

    def screening(self, effect: Effect, run: int, model: Model, values: np.ndarray) -> Signals:
        """As `of`, but as the first model of this diagnosis had them; for a first look only.

        Columns that depend on the predicted torque or on the bodies cost an inverse dynamics of
        the whole recording, and change little as effects are added.
        """
        if effect.linear_in_torque or not effect.needs & {"torque", "body"}:
            return self.of(effect, run, model, values)
        if (effect, run) not in self._screened:
            self._screened[effect, run] = self.of(effect, run, model, values)
        return self._screened[effect, run]

    def together(self, variants: Sequence[Effect], model: Model, values: np.ndarray) -> None:
        """Evaluate the response of one effect with several shapes at once, for `of` to find."""
        first = variants[0]
        if len(variants) < 2 or first in model or not {"body", "whole"} <= first.needs:
            return
        if self.simulation is not None:
            self.simulation.together(variants, model, values)
            return
        self._look_at(model, values)
        known = {*self._present, *self._screened}
        every = range(len(self.runs))
        new = [v for v in dict.fromkeys(variants) if any((v, r) not in known for r in every)]
        places = [(r, i) for r, run in enumerate(self.runs) for i in range(len(run.replicates))]
        samples = max(replicate.motion.samples for run in self.runs for replicate in run.replicates)
        step = max(1, _TOGETHER // (samples * max(len(new), 1)))
        found: dict[Hashable, Signals] = {(v, r): [] for v in new for r in every}
        for start in range(0, len(places) if new else 0, step):
            some = places[start : start + step]
            blocks = [self._block(first, *place, model, values) for place in some]
            for (r, i), each in zip(some, first.family(new, blocks), strict=True):
                replicate = self.runs[r].replicates[i]
                for variant, columns in zip(new, each, strict=True):
                    found[variant, r].append(replicate.filtered(columns))
        self._present.update(found)

    def renew_screening(self) -> None:
        """Let `screening` evaluate everything anew: the model has become another one."""
        self._screened.clear()

    def time_factor(self, effect: Effect, run: int) -> np.ndarray:
        """The factor of an effect's columns that depends on the time, folded, (P, S)."""
        replicate, recording = self.runs[run].replicates[0], self.runs[run].recording
        block = replace(self._rows(replicate), t=replicate.t + recording.start)
        if recording.temperature is not None:
            columns = recording.temperature.T
            at = [np.interp(replicate.t, recording.t, column) for column in columns]
            block = replace(block, temperature=np.stack(at, axis=1))
        return effect.time_factor(block)[self.runs[run].index]

    def _plain(self, effect: Effect, replicate: Sampled) -> np.ndarray:
        if "whole" in effect.needs:
            block = replace(replicate.block(self.model, rigid=False), carries_payload=True)
            return replicate.filtered(acting(effect, self.model.ready(effect, block, None)))
        return replicate.decimate(
            self.model,
            lambda block: [acting(effect, replace(block, carries_payload=True))],
            rigid="rigid" in effect.needs,
        )[0]

    def _of_present(
        self, effect: Effect, run: int, model: Model, values: np.ndarray | None
    ) -> Signals:
        """Columns that depend on the present model; kept until another is the present one."""
        values = np.zeros(model.size) if values is None else values
        self._look_at(model, values)
        if (effect, run) not in self._present:
            count = len(self.runs[run].replicates)
            blocks = [self._block(effect, run, i, model, values) for i in range(count)]
            self._present[effect, run] = [
                replicate.filtered(acting(effect, block))
                for replicate, block in zip(self.runs[run].replicates, blocks, strict=True)
            ]
        return self._present[effect, run]

    def _look_at(self, model: Model, values: np.ndarray) -> None:
        """Forget what depends on another present model."""
        carries = tuple(bool(one.recording.payload) for one in self.runs)
        now = (model.effects, values.tobytes(), carries)
        if now != self._now:
            self._now = now
            self._present.clear()
            self._blocks.clear()

    def _block(
        self, effect: Effect, run: int, replicate: int, model: Model, values: np.ndarray
    ) -> Block:
        """A whole version with what an effect needs of the present model; shared by many."""
        sampled = self.runs[run].replicates[replicate]
        # What comes before an effect of the model is another robot than what a candidate sees.
        label = effect.label if "body" in effect.needs and effect in model else ""
        key = (run, replicate, effect.needs & {"body", "rigid", "torque"}, label)
        if key in self._blocks:
            return self._blocks[key]
        # One motion for all effects: what a robot does along it is then evaluated once.
        motion = self._blocks.get(("motion", run, replicate))
        motion = sampled.block(model, rigid=False) if motion is None else motion
        block = model.ready(effect, motion, values)
        if "torque" in effect.needs:
            block = replace(
                block, torque=self._torque(effect, run, replicate, block, model, values)
            )
        if sampled.motion.samples <= _SHARED:
            self._blocks[key] = block
            self._blocks["motion", run, replicate] = motion
        return block

    def _torque(
        self,
        effect: Effect,
        run: int,
        replicate: int,
        block: Block,
        model: Model,
        values: np.ndarray,
    ) -> np.ndarray:
        """Predicted torque at the full rate, (T, n), but for effects that depend on it.

        A fit whose own columns depend on it asks again and again: then the rigid body's columns are
        kept, of which the torque is a product.
        """
        changes_bodies = any("body" in e.needs for e in model.effects)
        if effect not in model or changes_bodies or len(block.t) > _SHARED:
            return model.torque_without_loads(block, values)
        base, tip = list(model.base.independent), 10 * (model.robot.tip % model.robot.n)
        if (run, replicate) not in self._full:
            whole = model.robot.regressor(block.q, block.v, block.a)
            self._full[run, replicate] = whole[:, :, [*base, *range(tip, tip + 10)]]
        rigid = self._full[run, replicate]
        torque = rigid[:, :, : len(base)] @ values[: len(base)]
        for one in model.effects:
            own = values[model.slices[one.label]]
            if "payload" in one.needs:
                torque = torque + rigid[:, :, len(base) :] @ own * float(block.carries_payload)
            elif "torque" not in one.needs:
                torque = torque + one.columns(block) @ own
        return torque

    def _rows(self, replicate: Sampled) -> Block:
        return self.model.block(replicate.t, replicate.q, replicate.v, replicate.a, rigid=False)

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
