"""Contacts in a diagnosis: found, left out of everything else, and told as steps of their own."""

from __future__ import annotations

from dataclasses import dataclass

from dynident.diagnose.contact import Bump, find_contacts, without
from dynident.diagnose.diagnosis import Candidate, Step
from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.held_out import on_recordings
from dynident.diagnose.present import Present
from dynident.effects import Effect, catalogue
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


def left_out(
    store: ColumnStore, held: ColumnStore | None, present: Present
) -> tuple[Disturbance, ...]:
    """Find contacts in the recordings, and leave their instants out of both stores.

    One disturbance a joint is told, the clearest; all are left out.

    Parameters
    ----------
    store, held : training and test recordings; their runs are replaced.
    present : the model as it fits the training recordings.
    """
    found: list[Disturbance] = []
    judged = held if held is not None else store
    for one in (store, held) if held is not None else (store,):
        for bump in find_contacts(one, present):
            before = on_recordings(judged, present).error
            here = one.runs[bump.run]
            one.runs = (*one.runs[: bump.run], without(here, [bump]), *one.runs[bump.run + 1 :])
            after = on_recordings(judged, present).error
            found.append(Disturbance(bump, before, after))
    clearest: dict[str, Disturbance] = {}
    for one in sorted(found, key=lambda d: d.bump.p_value):
        clearest.setdefault(one.bump.joint, one)
    return tuple(clearest.values())


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
