"""An effect through files: into a study and an estimate, and back."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from dynident.effect_contract.crane import CRANE, crane, places, random_values, recorded_motion
from dynident.effects import Effect
from dynident.fitting import load_estimate
from dynident.fitting.given import given_estimate
from dynident.model import Model
from dynident.recording import Recording, write
from dynident.study import add_effects, load

_STUDY = """robot = "crane.urdf"
[[recordings]]
file = "run.npz"
"""


def studies_keep_it(kind: type[Effect]) -> Iterator[str]:
    """Written into a study's list and read again, it is the same at every place."""
    if not kind.in_catalogue:  # a study does not know it by its name alone
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(_STUDY)
        path.with_name("crane.urdf").write_text(CRANE)
        write(_recording(), path.with_name("run.npz"))
        add_effects(path, places(kind))
        found = load(path).model.effects
    if found != places(kind):
        said = ", ".join(f"{one.label} {one.shape}" for one in found)
        yield f"read back from a study it is {said or 'nothing'}"


def estimates_keep_it(kind: type[Effect]) -> Iterator[str]:
    """Saved in an estimate and loaded again it has its place, its shape and its point."""
    if not kind.in_catalogue:
        return
    given = tuple(
        one.shaped(*(shape.grid[-1] for shape in one.shape_parameters(crane())))
        .on(crane())
        .at(random_values(one, 13).tolist())
        for one in places(kind)
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "estimate.json"
        given_estimate(crane(), Model(crane(), given)).save(path)
        found = load_estimate(path).model
    if found.effects != given:
        yield f"read back from an estimate it is {found.effects} where {given} was saved"


@cache
def _recording() -> Recording:
    t, q, v, a = recorded_motion(0)
    return Recording(t, np.asarray(q), crane().inverse_dynamics(q, v, a), crane().names)
