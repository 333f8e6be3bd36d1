"""Columns that depend on a fitted model: on its torque, its bodies, or its values."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.effects import Block, Effect, Needs
from dynident.evidence.columns.column_cache import Kept
from dynident.evidence.columns.joint_columns import RigidColumns
from dynident.evidence.columns.motion_columns import MotionColumns
from dynident.evidence.columns.windows import Source
from dynident.fitting.sampling import Sampled
from dynident.model import Model

_SHARED = 50_000
"""Samples up to which a recording's torque and its derivatives are kept for several effects."""
_TOGETHER = 500_000
"""Samples, over all shapes, up to which responses in several recordings are evaluated at once."""


@dataclass(frozen=True, eq=False)
class FittedColumns:
    """Columns along recordings at a linearisation, a model and its values; the latest is kept.

    Attributes
    ----------
    motion : columns along the same recordings that follow from the motion alone.
    """

    motion: MotionColumns

    def of(self, effect: Effect, sampled: Sampled, model: Model, values: np.ndarray) -> np.ndarray:
        """Columns of any effect at the joints where it acts.

        Parameters
        ----------
        effect : of the model, or a candidate for it.
        sampled : the recording.
        model, values : (p,) whose torque and bodies some columns depend on.

        Returns
        -------
        (T, J, k).
        """
        if not effect.depends_on_fit:
            return self.motion.of([effect], [sampled], model)[0][0]
        kept, key = self.kept_at(model, values), (effect, recorded(sampled))
        if key in kept:
            return kept[key]
        if effect.linear_in_torque:
            torque = self._filtered_torque(sampled, model, values)
            rows = model.block(sampled.t, sampled.q, sampled.v, sampled.a)
            return effect.acting_columns(replace(rows, torque=torque))
        source = self.motion.source(sampled, effect)
        # Of a candidate, what the windows of one recording ask for one after the other.
        place = ("whole", effect if effect in model.effects else None, source.key)
        if place not in kept or kept[place][0] != effect:
            block = self._block(effect, source, model, values)
            kept[place] = effect, source.sampled.filtered(effect.acting_columns(block))
        return kept[place][1][source.rows]

    def together(
        self, variants: Sequence[Effect], every: Sequence[Sampled], model: Model, values: np.ndarray
    ) -> list[list[np.ndarray]]:
        """Responses of one effect with several shapes, walked through time at once.

        Parameters
        ----------
        variants : the effect with different shapes.
        every : recordings.
        model, values : as for `of`.

        Returns
        -------
        For each recording, for each variant: (T, J, k).
        """
        first = variants[0]
        asked = [self.motion.source(one, first) for one in every]
        places = list({source.key: source for source in asked}.values())
        samples = max(source.sampled.motion.samples for source in places)
        step = max(1, _TOGETHER // (samples * len(variants)))
        of_source: dict[Hashable, list[np.ndarray]] = {}
        for start in range(0, len(places), step):
            some = places[start : start + step]
            blocks = [self._block(first, source, model, values) for source in some]
            for source, each in zip(some, first.family(variants, blocks), strict=True):
                of_source[source.key] = source.sampled.filtered_each(each)
        return [[one[source.rows] for one in of_source[source.key]] for source in asked]

    def kept_at(self, model: Model, values: np.ndarray) -> Kept:
        """What is kept of a linearisation."""
        widths = tuple(model.friction_widths)
        robot = self.motion.model.robot
        return self.motion.cache.at((robot, widths, model.effects, values.tobytes()))

    def _block(self, effect: Effect, source: Source, model: Model, values: np.ndarray) -> Block:
        """A whole replicate with what an effect needs of the model; shared by many."""
        sampled = source.sampled
        kept, place = self.kept_at(model, values), (source.key, Needs.NUMBER in effect.needs)
        key = (model.shares_block(effect), place)
        if key in kept:
            return kept[key]
        # One motion for all effects: what a robot does along it is then evaluated once.
        whole = kept.get(place)
        whole = sampled.block(model) if whole is None else whole
        block = whole
        if effect in model and effect.needs_torque:
            # The same for all effects that scale it, whatever else they need.
            torque = kept.get(("own torque", place))
            if torque is None:
                torque = self._own_torque(sampled, block, model, values)
            if sampled.motion.samples <= _SHARED:
                kept["own torque", place] = torque
            block = replace(block, torque=torque)
        block = model.ready(effect, block, values)
        if sampled.motion.samples <= _SHARED:
            kept[key], kept[place] = block, whole
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
        given = self.motion.model
        base, loads = list(given.base.independent), any(one.is_payload for one in model.effects)
        tip = 10 * (model.robot.tip % model.robot.n)
        known, key = self.motion.cache.along(sampled.motion), (given.robot, "full rate", loads)
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
            own = self._full_rate(one, sampled, block, model, values)
            torque[:, list(one.acting_at(model.robot))] += own @ values[model.slices[one.label]]
        return torque

    def _full_rate(
        self, effect: Effect, sampled: Sampled, block: Block, model: Model, values: np.ndarray
    ) -> np.ndarray:
        """Columns at the full rate; the latest of each effect that follow from the motion alone."""
        if effect.depends_on_fit or Needs.NUMBER in effect.needs:
            return effect.acting_columns(model.ready(effect, block, values))
        known, key = self.motion.cache.along(sampled.motion), ("full rate", effect.label)
        by = model.known_by(effect)
        if key not in known or known[key][0] != by:
            known[key] = by, effect.acting_columns(model.ready(effect, block, values))
        return known[key][1]

    def _filtered_torque(self, sampled: Sampled, model: Model, values: np.ndarray) -> np.ndarray:
        """Decimated rows of the torque that the model predicts, but for effects that scale it."""
        kept, key = self.kept_at(model, values), ("torque", recorded(sampled))
        if key not in kept:
            rigid = self.motion.rigid(sampled)
            torque = rigid.times(values[: rigid.size])
            carried = bool(sampled.recording.payload)
            for joint in range(model.robot.n):
                acting = model.acting_at(joint, carries_payload=carried)
                _, *columns = self.motion.parts(sampled, model, joint)
                for (effect, _), one in zip(acting.plain, columns, strict=True):
                    torque[:, joint] += one @ values[model.slices[effect.label]]
                for effect, at in acting.dependent:
                    if not effect.needs_torque:
                        columns = self.of(effect, sampled, model, values)[:, at]
                        torque[:, joint] += columns @ values[model.slices[effect.label]]
            kept[key] = torque
        return kept[key]


def recorded(sampled: Sampled) -> Hashable:
    """Return a motion, which rows of it, and whether the payload was on board."""
    return Source(sampled, slice(None)).key
