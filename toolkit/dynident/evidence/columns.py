"""Recordings as the diagnosis sees them: columns of the model and of every candidate.

Low-passed and decimated like the torque, for every replicate of every run.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import Literal

import numpy as np

from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Block, Effect, Needs
from dynident.evidence.column_cache import ColumnCache, FirstLook, Kept
from dynident.evidence.joint_columns import RigidColumns
from dynident.evidence.noise_model import SpeedClasses
from dynident.evidence.runs import Run, Signals
from dynident.evidence.stacks import Stack
from dynident.evidence.windows import Source, sources
from dynident.fitting.sampling import Sampled, decimate_each
from dynident.model import Model

_NO_VALUES = np.zeros(0)
"""For columns that depend on none."""
_SHARED = 50_000
"""Samples up to which a recording's torque and its derivatives are kept for several effects."""
_TOGETHER = 500_000
"""Samples, over all shapes, up to which responses in several recordings are evaluated at once."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Recordings, and the columns that a model and its candidates have along them.

    Payload columns are those of a recording that carries it; who does is for others to apply.

    Attributes
    ----------
    model : whose base parameters are fitted; its effects are kept.
    runs : the recordings in their replicates.
    criteria : thresholds of whoever judges it.
    candidates : further effects whose columns are kept. Those that follow from a sample alone are
        evaluated with the model's in one pass through a motion. Of all other effects, which are
        tried once, only those of the model that asks are kept.
    responses : along whose motion, where columns are taken along simulated ones, the responses
        behind springs and gaps are taken. Along the measured one they fit best, and carry its
        noise; along a simulated one that does not ring yet they have another phase, and no noise.
    cache : of columns, shared with the evidence that this one was made of.
    look : the current first look, see `first_look`.
    """

    model: Model
    runs: tuple[Run, ...]
    _: KW_ONLY
    criteria: Criteria = DEFAULTS
    candidates: tuple[Effect, ...] = ()
    responses: Literal["recording", "simulation"] = "recording"
    cache: ColumnCache = field(default_factory=ColumnCache, repr=False)
    look: FirstLook = field(default_factory=FirstLook, repr=False)

    def with_runs(self, runs: tuple[Run, ...]) -> Evidence:
        """Return the evidence of other runs: what is known of their motions is still known."""
        return replace(self, runs=runs)

    def without_noise_in(self, effect: Effect) -> Evidence:
        """Return the evidence in which an effect's columns have no noise of measured positions.

        The very same where that noise does not enter, or no motion is simulated.
        """
        if not (effect.is_dynamic_response and self.is_simulated and self.responses == "recording"):
            return self
        return replace(self, responses="simulation")

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        """The recordings, those that are cut alike together."""
        return Stack.of(self.runs)

    @cached_property
    def torque_peaks(self) -> np.ndarray:
        """Largest torque that was measured at each joint, (n,) N m or N."""
        every = (one.tau for run in self.runs for one in run.replicates)
        return np.max([np.abs(tau).max(axis=0) for tau in every], axis=0)

    def looked_at_anew(self) -> Evidence:
        """Return the evidence without a first look: the model has become another one."""
        return replace(self, look=FirstLook())

    def speed_classes(self, joint: int) -> SpeedClasses:
        """Classes of a joint's speed wherever replicates tell its noise."""
        if joint not in self._speed_classes:
            speed = [one for run in self.runs for one in run.noisy_speeds(joint)]
            self._speed_classes[joint] = SpeedClasses.of(speed, self.criteria.noise)
        return self._speed_classes[joint]

    @cached_property
    def _speed_classes(self) -> dict[int, SpeedClasses]:
        return {}

    # --- columns --------------------------------------------------------------------------------

    def rigid(self, run: int) -> list[RigidColumns]:
        """Columns of the base parameters for each replicate."""
        return [self._rigid(sampled, self.model) for sampled in self.runs[run].replicates]

    def loading(self, sampled: Sampled, joint: int) -> np.ndarray:
        """Which of the base parameters load a joint, (u,)."""
        known, key = self.cache.rows_of(sampled), (self.model.robot, "loading", joint)
        if key not in known:
            known[key] = self._rigid(sampled, self.model).places[joint]
        return known[key]

    def torque(self, sampled: Sampled, joint: int) -> np.ndarray:
        """Measured torque at a joint (T, 1); one and the same array whenever it is asked for."""
        known, key = self.cache.rows_of(sampled), ("torque", joint)
        if key not in known:
            known[key] = sampled.tau[:, [joint]]
        return known[key]

    def plain_parts(self, sampled: Sampled, model: Model, joint: int) -> tuple[np.ndarray, ...]:
        """Columns of a model at a joint as far as they follow from the motion alone.

        They are the very same arrays as long as the effects at the joint are the same: a fit with
        something else at another joint needs nothing of this one anew.

        Parameters
        ----------
        sampled : the recording.
        model : with its effects and their shapes.
        joint : column of the joint.

        Returns
        -------
        (T, k) of the base parameters that load the joint, then of each effect that acts there, in
        the order of the model.
        """
        acting = model.acting_at(joint, carries_payload=bool(sampled.recording.payload))
        known = self.cache.rows_of(sampled)
        key = (self.model.robot, joint, acting.known_by)
        if key not in known:
            rigid = self._rigid(sampled, self.model).rows[joint].T
            columns = (self._of(e, sampled, model, _NO_VALUES)[:, at] for e, at in acting.plain)
            known[key] = (rigid, *columns)
        return known[key]

    def of(self, effect: Effect, run: int, model: Model, values: np.ndarray | None) -> Signals:
        """Columns of an effect at the joints where it acts in one run.

        Parameters
        ----------
        effect : of the model, or a candidate for it.
        run : which one.
        model, values : (p,) whose torque and bodies some columns depend on; None for zeros.

        Returns
        -------
        (T, J, k) for each replicate. Of a candidate where the columns are taken along a simulated
        motion: of that motion only. What rings behind a spring or a gap is in its place along the
        motion that `responses` says.
        """
        values = np.zeros(model.size) if values is None else values
        return [self._of(effect, one, model, values) for one in self._along(effect, run, model)]

    def columns(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> list[list[Signals]]:
        """Columns of one effect with several shapes: for each run those of each variant, as `of`.

        Parameters
        ----------
        variants : one effect at one place, with any number of shapes.
        model, values : as for `of`.

        Returns
        -------
        For each run, for each variant: (T, J, k) for each replicate.
        """
        runs = range(len(self.runs))
        first = variants[0]
        if len(variants) > 1 and first.is_dynamic_response and first not in model:
            found = self._together(variants, model, values)
            return [[found[variant, run] for variant in variants] for run in runs]
        along = [self._along(first, run, model) for run in runs]
        every = [one for some in along for one in some]
        if first.depends_on_fit:
            found = [[self._of(one, each, model, values) for one in variants] for each in every]
        else:
            found = self._plain(variants, every, model)
        of_replicates = iter(found)
        return [
            [list(signals) for signals in zip(*islice(of_replicates, len(some)), strict=True)]
            for some in along
        ]

    def first_look(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> list[list[Signals]]:
        """As `columns`, but as the model had them that asked first; for a first look only.

        Columns that depend on the predicted torque or on the bodies cost an inverse dynamics of
        the whole recording, and change little as effects are added.

        Parameters
        ----------
        variants, model, values : as for `columns`.

        Returns
        -------
        As `columns`.
        """
        if variants[0].linear_in_torque or not variants[0].depends_on_fit:
            return self.columns(variants, model, values)
        seen, latest = self.cache.seen_in(self.look), self._at(model, values)
        runs = range(len(self.runs))

        def key(variant: Effect, run: int) -> Hashable:
            along = self._along(variant, run, model)
            return variant, tuple((one.motion, one.kept.start, one.kept.stop) for one in along)

        new = [v for v in dict.fromkeys(variants) if any(key(v, r) not in seen for r in runs)]
        if new and len(variants) > 1 and new[0].is_dynamic_response:
            found = self._together(new, model, values)
        else:
            found = {(v, r): self.of(v, r, model, values) for v in new for r in runs}
        for (variant, run), signals in found.items():
            seen.setdefault(key(variant, run), signals)
            # To be looked at closely next, with the same model.
            for one, columns in zip(self._along(variant, run, model), signals, strict=True):
                latest[variant, self._recorded(one)] = columns
        return [[seen[key(variant, run)] for variant in variants] for run in runs]

    # --- of one replicate, by all that they depend on -------------------------------------------

    def _of(self, effect: Effect, sampled: Sampled, model: Model, values: np.ndarray) -> np.ndarray:
        if not effect.depends_on_fit:
            return self._plain([effect], [sampled], model)[0][0]
        kept, key = self._at(model, values), (effect, self._recorded(sampled))
        if key in kept:
            return kept[key]
        if effect.linear_in_torque:
            torque = self._filtered_torque(sampled, model, values)
            return effect.acting_columns(replace(self._rows(sampled, model), torque=torque))
        source = self._source(sampled, effect)
        # Of a candidate, what the windows of one recording ask for one after the other.
        place = ("whole", effect if effect in model.effects else None, source.key)
        if place not in kept or kept[place][0] != effect:
            block = self._block(effect, source, model, values)
            kept[place] = effect, source.sampled.filtered(effect.acting_columns(block))
        return kept[place][1][source.rows]

    def _plain(
        self, effects: Sequence[Effect], every: Sequence[Sampled], model: Model
    ) -> list[list[np.ndarray]]:
        """Columns that follow from the motion alone, of one effect with any number of shapes.

        For each recording: those of each shape.
        """
        sources = [self._source(one, effects[0]) for one in every]
        keys = {model.known_by(effect): effect for effect in effects}
        places = {source.key: source for source in sources}
        found = {place: self._looked_up(source, keys, model) for place, source in places.items()}
        missing = {place: tuple(key for key in keys if key not in found[place]) for place in places}
        for new in dict.fromkeys(missing.values()):
            some = [place for place in places if missing[place] == new]
            if not new:
                continue
            tried = [keys[key] for key in new]
            evaluated = self._evaluated(tried, [places[place].sampled for place in some], model)
            for place, columns in zip(some, evaluated, strict=True):
                known = self._known(places[place])
                for key, effect, one in zip(new, tried, columns, strict=True):
                    found[place][key] = one
                    if effect in self._kept or effect in model.effects:
                        known[key] = one
                    else:
                        self.cache.tried.put((place, key), one)
        wanted = [model.known_by(effect) for effect in effects]
        return [[found[source.key][key][source.rows] for key in wanted] for source in sources]

    def _looked_up(self, source: Source, keys: Mapping[Hashable, Effect], model: Model) -> Kept:
        """What is known already of some effects along a motion."""
        known, tried = self._known(source), self.cache.tried
        at_once = self._evaluated_at_once(source.sampled)
        if any(key not in known and effect in at_once for key, effect in keys.items()):
            # Many a friction width is tried without a look at the candidates.
            own = all(effect in model.effects for effect in keys.values())
            self._pass_through(source, model, model.effects if own else at_once)
        found = {key: known[key] for key in keys if key in known}
        for key in keys:
            if key not in found and (latest := tried.get((source.key, key))) is not None:
                found[key] = latest
        return found

    def _evaluated(
        self, effects: Sequence[Effect], every: Sequence[Sampled], model: Model
    ) -> list[list[np.ndarray]]:
        """Columns that follow from the motion alone, all in one pass through each recording."""
        if effects[0].is_instantaneous:
            return decimate_each(
                every, model, lambda one, raw: self._loaded(effects, one, raw, model)
            )
        whole = slice(None)
        return [one.filtered_each(self._loaded(effects, one, whole, model)) for one in every]

    def _loaded(
        self, effects: Sequence[Effect], sampled: Sampled, raw: slice, model: Model
    ) -> list[np.ndarray]:
        """Columns that follow from the motion alone, with the payload on board.

        The latest block of a recording is kept, and the directions of motion in it: whoever seeks
        a shape asks for it again and again, where the recording is so short that it is one block.
        """
        known, asked = self.cache.rows_of(sampled), (raw.start, raw.stop, *model.friction_widths)
        of, block = known.get("latest block", (None, None))
        if of != asked:
            block = replace(sampled.block(model, raw), carries_payload=True)
            known["latest block"] = asked, block
        return [one.acting_columns(self.model.ready(one, block, None)) for one in effects]

    def _rigid(self, sampled: Sampled, model: Model) -> RigidColumns:
        source = self._source(sampled)
        known = self._known(source)
        if self.model.robot not in known:
            self._pass_through(source, model, self._evaluated_at_once(source.sampled))
        return known[self.model.robot].among(source.rows)

    def _evaluated_at_once(self, sampled: Sampled) -> dict[Effect, None]:
        """Effects that need nothing but samples, as far as they are asked for along a motion."""
        if self.is_simulated and all(r.replicates[-1] is not sampled for r in self.runs):
            return {effect: None for effect in self._instantaneous if effect in self.model}
        return self._instantaneous

    @cached_property
    def _instantaneous(self) -> dict[Effect, None]:
        return {
            effect: None
            for effect in self._kept
            if effect.is_instantaneous and Needs.NUMBER not in effect.needs
        }

    def _pass_through(self, source: Source, model: Model, effects: Iterable[Effect]) -> None:
        """Evaluate the rigid body and many effects in one pass, as far as they are not known."""
        known, base = self._known(source), self.model.base.independent
        at_once = self._evaluated_at_once(source.sampled)
        wanted = [e for e in effects if e in at_once and model.known_by(e) not in known]
        new = self.model.robot not in known

        def evaluate(block: Block) -> list[np.ndarray]:
            loaded = replace(block, carries_payload=True)
            if new or any(effect.needs_regressor for effect in wanted):
                loaded = self.model.with_regressor(loaded)
            rigid = [] if loaded.rigid is None else [loaded.rigid[:, :, base]]
            return [*rigid, *(effect.acting_columns(loaded) for effect in wanted)]

        found = source.sampled.decimate(model, evaluate)
        if len(found) > len(wanted):
            known[self.model.robot] = RigidColumns.of(self.model.robot, base, found.pop(0))
        known.update(zip([model.known_by(effect) for effect in wanted], found, strict=True))

    def _together(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> dict[tuple[Effect, int], Signals]:
        """Responses of one effect with several shapes, walked through time at once."""
        first, new = variants[0], list(dict.fromkeys(variants))
        asked = [
            (run, self._source(one, first))
            for run in range(len(self.runs))
            for one in self._along(first, run, model)
        ]
        places = list({source.key: source for _, source in asked}.values())
        samples = max(source.sampled.motion.samples for source in places)
        step = max(1, _TOGETHER // (samples * len(new)))
        of_source: dict[Hashable, list[np.ndarray]] = {}
        for start in range(0, len(places), step):
            some = places[start : start + step]
            blocks = [self._block(first, source, model, values) for source in some]
            for source, each in zip(some, first.family(new, blocks), strict=True):
                of_source[source.key] = source.sampled.filtered_each(each)
        found: dict[tuple[Effect, int], Signals] = {
            (v, run): [] for v in new for run in range(len(self.runs))
        }
        for run, source in asked:
            for variant, columns in zip(new, of_source[source.key], strict=True):
                found[variant, run].append(columns[source.rows])
        return found

    # --- what they are made of ------------------------------------------------------------------

    @cached_property
    def _kept(self) -> dict[Effect, None]:
        return dict.fromkeys((*self.model.effects, *self.candidates))

    @cached_property
    def is_simulated(self) -> bool:
        """Whether columns are taken along simulated motions throughout."""
        return all(run.columns_from == "simulation" for run in self.runs)

    @cached_property
    def _sources(self) -> dict[Sampled, Source]:
        return sources(one for run in self.runs for one in run.replicates)

    def _source(self, sampled: Sampled, effect: Effect | None = None) -> Source:
        """Where columns are evaluated: what needs a recording's number is its own alone."""
        if effect is not None and Needs.NUMBER in effect.needs:
            return Source(sampled, slice(None))
        return self._sources[sampled]

    def _recorded(self, sampled: Sampled) -> Hashable:
        """A motion, which rows of it, and whether the payload was on board."""
        return Source(sampled, slice(None)).key

    def _known(self, source: Source) -> Kept:
        """What follows from a motion alone, of the rows of a source."""
        kept = source.sampled.kept
        return self.cache.along(source.sampled.motion).setdefault((kept.start, kept.stop), {})

    def _along(self, effect: Effect, run: int, model: Model) -> tuple[Sampled, ...]:
        """Replicates along which an effect's columns are taken."""
        every = self.runs[run].replicates
        if effect.is_dynamic_response and self.is_simulated and self.responses == "recording":
            # What rings has the phase of the true motion, which a loop without it does not have.
            every = (*every[:-1], every[0])
        # Of a simulated motion, candidates need no more than that one.
        return every[-1:] if self.is_simulated and effect not in model else every

    def _at(self, model: Model, values: np.ndarray) -> Kept:
        """What is kept of a linearisation."""
        widths = tuple(model.friction_widths)
        return self.cache.at((self.model.robot, widths, model.effects, values.tobytes()))

    def _block(self, effect: Effect, source: Source, model: Model, values: np.ndarray) -> Block:
        """A whole replicate with what an effect needs of the model; shared by many."""
        sampled = source.sampled
        kept, recorded = self._at(model, values), (source.key, Needs.NUMBER in effect.needs)
        key = (model.shares_block(effect), recorded)
        if key in kept:
            return kept[key]
        # One motion for all effects: what a robot does along it is then evaluated once.
        whole = kept.get(recorded)
        whole = sampled.block(model) if whole is None else whole
        block = whole
        if effect in model and effect.needs_torque:
            # The same for all effects that scale it, whatever else they need.
            torque = kept.get(("own torque", recorded))
            if torque is None:
                torque = self._own_torque(sampled, block, model, values)
            if sampled.motion.samples <= _SHARED:
                kept["own torque", recorded] = torque
            block = replace(block, torque=torque)
        block = model.ready(effect, block, values)
        if sampled.motion.samples <= _SHARED:
            kept[key], kept[recorded] = block, whole
        return block

    def _own_torque(
        self, sampled: Sampled, block: Block, model: Model, values: np.ndarray
    ) -> np.ndarray:
        """Torque at the full rate without what depends on it, for a model that has such an effect.

        Its fit asks again and again: the rigid body's columns are kept, of which the torque is a
        product, unless a recording is long.
        """
        if len(block.t) > _SHARED:
            return model.torque_without_loads(block, values)
        base, loads = list(model.base.independent), any(one.is_payload for one in model.effects)
        tip = 10 * (model.robot.tip % model.robot.n)
        known, key = self.cache.along(sampled.motion), (self.model.robot, "full rate", loads)
        if key not in known:
            whole = model.robot.regressor(block.q, block.v, block.a)
            wanted = [*base, *range(tip, tip + 10)] if loads else base
            known[key] = RigidColumns.of(model.robot, wanted, whole[:, :, wanted])
        at = np.zeros(known[key].size)
        at[: len(base)] = values[: len(base)]
        for one in model.effects:
            if one.is_payload and block.carries_payload:
                at[len(base) :] = values[model.slices[one.label]]
        torque = known[key].times(at)
        for one in model.effects:
            if one.is_payload or one.needs_torque:
                continue
            own = self._full_rate_columns(one, sampled, block, model, values)
            torque[:, list(one.acting_at(model.robot))] += own @ values[model.slices[one.label]]
        return torque

    def _full_rate_columns(
        self, effect: Effect, sampled: Sampled, block: Block, model: Model, values: np.ndarray
    ) -> np.ndarray:
        """Columns at the full rate; the latest of each effect that follow from the motion alone."""
        if effect.depends_on_fit or Needs.NUMBER in effect.needs:
            return effect.acting_columns(model.ready(effect, block, values))
        known, key = self.cache.along(sampled.motion), ("full rate", effect.label)
        by = model.known_by(effect)
        if key not in known or known[key][0] != by:
            known[key] = by, effect.acting_columns(model.ready(effect, block, values))
        return known[key][1]

    def _filtered_torque(self, sampled: Sampled, model: Model, values: np.ndarray) -> np.ndarray:
        """Decimated rows of the torque that the model predicts, but for effects that scale it."""
        kept, key = self._at(model, values), ("torque", self._recorded(sampled))
        if key not in kept:
            rigid = self._rigid(sampled, model)
            torque = rigid.times(values[: rigid.size])
            carried = bool(sampled.recording.payload)
            for joint in range(model.robot.n):
                acting = model.acting_at(joint, carries_payload=carried)
                _, *columns = self.plain_parts(sampled, model, joint)
                for (effect, _), one in zip(acting.plain, columns, strict=True):
                    torque[:, joint] += one @ values[model.slices[effect.label]]
                for effect, at in acting.dependent:
                    if not effect.needs_torque:
                        columns = self._of(effect, sampled, model, values)[:, at]
                        torque[:, joint] += columns @ values[model.slices[effect.label]]
            kept[key] = torque
        return kept[key]

    def _rows(self, sampled: Sampled, model: Model) -> Block:
        return model.block(sampled.t, sampled.q, sampled.v, sampled.a)
