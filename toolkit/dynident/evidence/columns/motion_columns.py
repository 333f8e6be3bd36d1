"""Columns that follow from a motion alone: of the rigid body and of most effects."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.effects import Block, Effect, Needs
from dynident.evidence.columns.column_cache import ColumnCache, Kept
from dynident.evidence.columns.joint_columns import RigidColumns
from dynident.evidence.columns.windows import Source, sources
from dynident.fitting.sampling import Sampled, decimate_each
from dynident.model import Model


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionColumns:
    """Columns along recordings that are the same whatever is fitted.

    Attributes
    ----------
    model : whose base parameters are fitted; its effects are kept.
    candidates : further effects whose columns are kept.
    every : the recordings, with all that is compared with them.
    asked_along : those along which candidates are asked for; None for all.
    cache : of columns.
    """

    model: Model
    candidates: tuple[Effect, ...]
    every: tuple[Sampled, ...]
    asked_along: Collection[Sampled] | None
    cache: ColumnCache

    def rigid(self, sampled: Sampled) -> RigidColumns:
        """Columns of the base parameters."""
        source = self.source(sampled)
        known = self._known(source)
        if self.model.robot not in known:
            self._pass_through(source, self.model, self._evaluated_at_once(source.sampled))
        return known[self.model.robot].among(source.rows)

    def parts(self, sampled: Sampled, model: Model, joint: int) -> tuple[np.ndarray, ...]:
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
            rigid = self.rigid(sampled).rows[joint].T
            columns = (self.of([e], [sampled], model)[0][0][:, at] for e, at in acting.plain)
            known[key] = (rigid, *columns)
        return known[key]

    def of(
        self, effects: Sequence[Effect], every: Sequence[Sampled], model: Model
    ) -> list[list[np.ndarray]]:
        """Columns of one effect with any number of shapes.

        Parameters
        ----------
        effects : one effect at one place, with any number of shapes.
        every : recordings.
        model : that asks for them.

        Returns
        -------
        For each recording, for each shape: (T, J, k).
        """
        found_at = [self.source(one, effects[0]) for one in every]
        keys = {model.known_by(effect): effect for effect in effects}
        places = {source.key: source for source in found_at}
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
        return [[found[source.key][key][source.rows] for key in wanted] for source in found_at]

    def source(self, sampled: Sampled, effect: Effect | None = None) -> Source:
        """Where columns are evaluated: what needs a recording's number is its own alone."""
        if effect is not None and Needs.NUMBER in effect.needs:
            return Source(sampled, slice(None))
        return self._sources[sampled]

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
        """Columns of shapes, all in one pass through each recording."""
        if effects[0].is_instantaneous:
            return decimate_each(
                every, model, lambda one, raw: self._loaded(effects, one, raw, model)
            )
        whole = slice(None)
        return [one.filtered_each(self._loaded(effects, one, whole, model)) for one in every]

    def _loaded(
        self, effects: Sequence[Effect], sampled: Sampled, raw: slice, model: Model
    ) -> list[np.ndarray]:
        """Columns with the payload on board.

        The latest block of a recording is kept, and the directions of motion in it: whoever seeks
        a shape asks for it again and again, where the recording is so short that it is one block.
        """
        known, asked = self.cache.rows_of(sampled), (raw.start, raw.stop, *model.friction_widths)
        of, block = known.get("latest block", (None, None))
        if of != asked:
            block = replace(sampled.block(model, raw), carries_payload=True)
            known["latest block"] = asked, block
        return [one.acting_columns(self.model.ready(one, block, None)) for one in effects]

    def _evaluated_at_once(self, sampled: Sampled) -> dict[Effect, None]:
        """Effects that need nothing but samples, as far as they are asked for along a motion."""
        if self.asked_along is not None and sampled not in self.asked_along:
            return {effect: None for effect in self._instantaneous if effect in self.model}
        return self._instantaneous

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

    def _known(self, source: Source) -> Kept:
        """What follows from a motion alone, of the rows of a source."""
        kept = source.sampled.kept
        return self.cache.along(source.sampled.motion).setdefault((kept.start, kept.stop), {})

    @cached_property
    def _sources(self) -> dict[Sampled, Source]:
        return sources(self.every)

    @cached_property
    def _kept(self) -> dict[Effect, None]:
        return dict.fromkeys((*self.model.effects, *self.candidates))

    @cached_property
    def _instantaneous(self) -> dict[Effect, None]:
        return {
            effect: None
            for effect in self._kept
            if effect.is_instantaneous and Needs.NUMBER not in effect.needs
        }
