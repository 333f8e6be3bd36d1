"""Contacts in a diagnosis: found, left out of everything else, and told as steps of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from dynident.diagnosis.nuisances.pulse_search import Bump, find_contacts, without
from dynident.diagnosis.result import Candidate, Step
from dynident.diagnosis.verdict import RESOLUTION
from dynident.effects import Effect, catalogue
from dynident.evidence.column_store import ColumnStore
from dynident.evidence.evidence_fit import Present
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import Run
from dynident.model import Model


@dataclass(frozen=True)
class Disturbance:
    """A contact, with the held-out error before and after it is left out."""

    bump: Bump
    error_before: float
    error_after: float

    def effect(self, model: Model) -> Effect:
        """Return it as the effect of the catalogue that was found in repetitions."""
        kind = catalogue()["contact"]
        shape = (float(self.bump.number), self.bump.time, self.bump.width)
        return kind(self.bump.joint, None, shape).on(model.robot)

    def step(self, model: Model) -> Step:
        """Return it as a step of the diagnosis."""
        values = (self.bump.amplitude,)
        return Step(
            self.effect(model), values, self.error_before, self.error_after, (), self.bump.p_value
        )


@dataclass(frozen=True)
class Contacts:
    """The contacts in the recordings of a diagnosis.

    Attributes
    ----------
    store, held : training and test recordings; `held` is None where there are none.
    whole, whole_held : their runs with nothing left out.
    bumps, bumps_held : what was found in them.
    """

    store: ColumnStore
    held: ColumnStore | None
    whole: tuple[Run, ...]
    whole_held: tuple[Run, ...]
    bumps: tuple[Bump, ...]
    bumps_held: tuple[Bump, ...]

    @classmethod
    def leave_out(cls, store: ColumnStore, held: ColumnStore | None, present: Present) -> Contacts:
        """Find contacts in the recordings and leave their instants out of both stores.

        Parameters
        ----------
        store, held : their runs are replaced.
        present : the model as it fits the training recordings.
        """
        whole, whole_held = store.runs, held.runs if held is not None else ()
        bumps = _resolved(store, present, find_contacts(store, present))
        bumps_held = (
            _resolved(held, present, find_contacts(held, present)) if held is not None else ()
        )
        found = cls(store, held, whole, whole_held, bumps, bumps_held)
        found._leave(bumps, bumps_held)
        return found

    def confirmed(self, present: Present) -> Contacts:
        """Keep the contacts that a better model still shows, and leave only these out.

        What a poor model lacks is not quite the same in every repetition, as motions are not, and
        may look like a contact.
        """
        if not (self.bumps or self.bumps_held):
            return self
        self._leave((), ())
        again = find_contacts(self.store, present) if self.bumps else ()
        again_held = ()
        if self.held is not None and self.bumps_held:
            again_held = find_contacts(self.held, present)
        bumps, bumps_held = _common(again, self.bumps), _common(again_held, self.bumps_held)
        self._leave(bumps, bumps_held)
        return replace(self, bumps=bumps, bumps_held=bumps_held)

    def told(self, present: Present) -> tuple[Disturbance, ...]:
        """One disturbance a joint, the clearest, with the error before and after it is left out."""
        judged = self.held or self.store
        clearest: dict[str, Bump] = {}
        for bump in sorted((*self.bumps, *self.bumps_held), key=lambda one: one.p_value):
            clearest.setdefault(bump.joint, bump)
        if not clearest:
            return ()
        self._leave((), ())
        before = on_recordings(judged, present).error
        self._leave(self.bumps, self.bumps_held)
        after = on_recordings(judged, present).error
        told = []
        for bump in clearest.values():
            told.append(Disturbance(bump, before, after))
            before = after
        return tuple(told)

    def _leave(self, bumps: Sequence[Bump], bumps_held: Sequence[Bump]) -> None:
        self.store.runs = _masked(self.store.runs, self.whole, bumps)
        if self.held is not None:
            self.held.runs = _masked(self.held.runs, self.whole_held, bumps_held)


def _masked(
    runs: tuple[Run, ...], whole: tuple[Run, ...], bumps: Sequence[Bump]
) -> tuple[Run, ...]:
    """Runs as they are now, with these bumps and no others left out."""
    found = []
    for r, (run, original) in enumerate(zip(runs, whole, strict=True)):
        again = replace(run, index=original.index, edges=original.edges, left_out=None)
        found.append(without(again, [bump for bump in bumps if bump.run == r]))
    return tuple(found)


def _resolved(store: ColumnStore, present: Present, bumps: Sequence[Bump]) -> tuple[Bump, ...]:
    """Bumps at joints whose residual is more than what differentiation and filters leave."""
    if not bumps:
        return ()
    judged = on_recordings(store, present)
    names = present.model.robot.names
    matters = judged.residual_rms > RESOLUTION * judged.torque_rms
    return tuple(bump for bump in bumps if matters[names.index(bump.joint)])


def _common(bumps: Sequence[Bump], others: Sequence[Bump]) -> tuple[Bump, ...]:
    """Bumps that are among others too, at about the same time."""
    return tuple(
        one
        for one in bumps
        if any(
            (one.run, one.joint, one.repetition) == (two.run, two.joint, two.repetition)
            and abs(one.time - two.time) <= 2.0 * (one.width + two.width)
            for two in others
        )
    )


def contact_candidates(
    model: Model, store: ColumnStore, found: tuple[Disturbance, ...]
) -> tuple[Candidate, ...]:
    """Return what is to be said of contacts at every joint."""
    repeats = any(run.kind == "repeated" for run in store.runs)
    by_joint = {one.bump.joint: one for one in found}
    candidates = []
    for effect in catalogue()["contact"].candidates(model.robot):
        effect = effect.on(model.robot)
        one = by_joint.get(str(effect.joint))
        if one is not None:
            gain = one.error_before - one.error_after
            candidates.append(
                Candidate(
                    one.effect(model), "material", one.bump.p_value, gain, (one.bump.amplitude,)
                )
            )
        elif repeats:
            remark = "no burst differs from one repetition to another"
            candidates.append(Candidate(effect, "not_material", 1.0, 0.0, (), remark))
        else:
            candidates.append(Candidate(effect, "absorbed", None, 0.0, (), effect.advice))
    return tuple(candidates)
