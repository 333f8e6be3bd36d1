"""What columns are, and what they may depend on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import numpy as np

from dynident.closed_loop import Mechanism, TrueEffect
from dynident.effect_contract.crane import (
    ARRAYS,
    block_of,
    crane,
    motion,
    places,
    random_values,
    warm,
)
from dynident.effect_contract.disagreement import differs
from dynident.effects import Effect, Needs, effects_of
from dynident.effects.soundness import unsound_columns
from dynident.model import Model

_VARIANTS = 3


def blocks_stay_as_they_are(effect: Effect) -> Iterator[str]:
    """Columns and forces are read off a block, which is everybody's."""
    block, twin = warm(block_of(effect, 2)), warm(block_of(effect, 2))
    effect.columns(block)
    effect.simulated_force(tuple(random_values(effect, 0)), block)
    for name in ARRAYS:
        yield from differs(
            f"block.{name}, changed by it,", getattr(block, name), getattr(twin, name)
        )


def columns_are_finite(effect: Effect) -> Iterator[str]:
    """Double precision, one for each parameter, at every joint and sample."""
    block = block_of(effect, 0)
    for samples in (block, warm(block)):
        yield from unsound_columns(effect, samples, crane())


def one_sample_is_as_many(effect: Effect) -> Iterator[str]:
    """Unless they need what went before, columns of a sample do not depend on the others."""
    if effect.needs_recording:
        return
    block = warm(block_of(effect, 1))
    one = replace(block, **{name: getattr(block, name)[7:8] for name in ARRAYS})
    many = effect.columns(block)[7:8]
    yield from differs("the column of a sample alone", effect.columns(one), many, absolute=1e-13)


def needs_no_more_than_it_says(effect: Effect) -> Iterator[str]:
    """What an effect does not say that it needs may be missing, and changes nothing."""
    block = warm(block_of(effect, 9))
    carried = {"rigid": Needs.REGRESSOR, "torque": Needs.TORQUE, "body": Needs.BODIES}
    spared = {name: None for name, need in carried.items() if need not in effect.needs}
    found = effect.columns(replace(block, **spared))
    yield from differs(
        f"a column without {', '.join(spared)} in the block", found, effect.columns(block)
    )


def traits_agree(effect: Effect) -> Iterator[str]:
    """What is asked of it follows from its needs."""
    needs_values = effect.depends_on_fit or effect.nonlinear
    if Model(crane(), (effect,)).needs_values != needs_values:
        yield f"depends_on_fit or nonlinear is {needs_values}, and its model says otherwise"
    past = Needs.TORQUE | Needs.BODIES | Needs.RECORDING
    if effect.is_instantaneous != (not effect.needs & past):
        yield f"is_instantaneous = {effect.is_instantaneous} with {effect.needs}"
    if effect.is_dynamic_response != (Needs.BODIES | Needs.RECORDING in effect.needs):
        yield f"is_dynamic_response = {effect.is_dynamic_response} with {effect.needs}"


def acts_where_it_says(effect: Effect) -> Iterator[str]:
    """Columns are zero at other joints than `acting_at`, and `acting_columns` at these."""
    block = block_of(effect, 0)
    columns, acting = effect.columns(block), list(effect.acting_at(crane()))
    yield from differs("acting_columns", effect.acting_columns(block), columns[:, acting])
    others = [j for j in range(crane().n) if j not in acting]
    if np.any(columns[:, others]):
        yield "columns are not zero at joints that acting_at does not name"


def families_are_their_variants(effect: Effect) -> Iterator[str]:
    """Columns of several shapes at once are those of one after the other."""
    block = block_of(effect, 0)
    variants = list(islice(effect.variants(crane()), _VARIANTS))
    (found,) = effect.family(variants, [block])
    for one, columns in zip(variants, found, strict=True):
        expected = one.columns(block)
        room = 1e-9 * np.abs(expected).max()
        what = f"the column in family() at the shape {one.shape}"
        yield from differs(what, columns, expected, absolute=room)


def payload_acts_on_board_only(effect: Effect) -> Iterator[str]:
    """A payload acts in the recordings that carry it, every other effect in all."""
    without = effect.columns(block_of(effect, 4, carries_payload=False))
    if not effect.is_payload:
        yield from differs(
            "a column without the payload", without, effect.columns(block_of(effect, 4))
        )
        return
    if np.any(without):
        yield "columns are not zero where the payload is not on board"
    t, q, v, a = motion(4)
    truth = TrueEffect(effect, tuple(random_values(effect, 4)))
    bare = Mechanism.of(crane(), [truth], carries_payload=False)
    rigid = crane().inverse_dynamics(q, v, a)
    yield from differs("the simulated torque without it", bare.command(t, q, v, a), rigid)


def contained_effects_are_in_it(kind: type[Effect]) -> Iterator[str]:
    """Each effect that it `contains` is a combination of its columns."""
    for effect in places(kind):
        block = block_of(effect, 5)
        wide = effect.columns(block).reshape(block.q.size, -1)
        for name in kind.contains:
            (simple,) = effects_of(f"{name}@{effect.joint}", crane())
            narrow = simple.columns(block).reshape(block.q.size, -1)
            rest = narrow - wide @ np.linalg.lstsq(wide, narrow, rcond=None)[0]
            if not np.abs(rest).max() < 1e-10:
                yield f"{name} is no combination of its columns: {np.abs(rest).max():.3g} is left"
