"""What Python prints of results, and how it warns: to be read at a prompt and in a notebook."""

from __future__ import annotations

import re
import sys
import warnings
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.errors import DynidentWarning, warn, without_warnings
from dynident.recording import Dataset, Recording
from dynident.tables import Shown
from synthetic import arm, smooth_motion


def _every_kind(kind: type) -> list[type]:
    return [one for each in kind.__subclasses__() for one in (each, *_every_kind(each))]


def test_what_can_be_shown_is_printed_as_its_tables():
    for file in Path(di.__path__[0]).rglob("*.py"):
        if re.search(r"\bShown\b", file.read_text()):
            inside = file.relative_to(di.__path__[0]).with_suffix("").parts
            import_module(".".join(("dynident", *inside)))
    every = _every_kind(Shown)
    assert {"Diagnosis", "Estimate", "Comparison", "Check"} <= {kind.__name__ for kind in every}
    for kind in every:
        assert kind.__repr__ is Shown.__repr__ and kind.__str__ is object.__str__, kind


def _jittered(seed: int = 0) -> Recording:
    t, q, _, _ = smooth_motion(2, seed, 200.0, 10.0, 5.0)
    t = t.copy()
    t[1:-1] += np.random.default_rng(seed).uniform(-1e-3, 1e-3, len(t) - 2)
    tau = np.random.default_rng(seed).normal(size=q.shape)
    return Recording(t, q, tau, ("shoulder", "elbow"), name=f"jittered {seed}")


def test_a_recording_is_warned_of_once_at_the_line_of_the_user():
    model = di.Model(arm()) + "viscous_friction"
    data = Dataset((_jittered(0), _jittered(1)))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        fit = di.fit(model, data)
        di.compare(fit, data)
        print(fit.summary(), file=sys.stderr)
    ours = [one for one in said if one.category is DynidentWarning]
    assert sorted(str(one.message).split(":")[0] for one in ours) == ["jittered 0", "jittered 1"]
    assert {one.filename for one in ours} == {__file__}


def test_nothing_is_said_of_what_is_only_tried():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with without_warnings():
            assert not warn("tried")
        with pytest.raises(DynidentWarning, match="meant"):
            warn("meant")


def test_a_study_prints_its_effects_and_recordings_in_a_few_lines():
    model = di.Model(arm()) + "coulomb_friction"
    data = Dataset((_jittered(2),))
    assert "coulomb_friction@shoulder, coulomb_friction@elbow" in repr(model)
    assert "jittered 2" in repr(data)
    assert len(repr(model)) < 250 and len(repr(data)) < 250
