"""A residual map names a shape that is there, and none in what merely lasts in time."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.evidence.maps import residual_maps
from dynident.model import Model
from slides import gantry
from synthetic import arm

MODEL = Model(arm()) + "viscous_friction" + "coulomb_friction"
T = np.arange(400) / 50.0


def motion(stream: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of two joints, a sum of five waves in 8 s."""
    w = 2 * np.pi / 8.0 * np.arange(1, 6)
    q, v, a = (np.zeros((len(T), 2)) for _ in range(3))
    for j in range(2):
        size, phase = stream.normal(0.0, 0.4, 5), stream.uniform(0.0, 2 * np.pi, 5)
        angle = np.outer(T, w) + phase
        q[:, j] = np.sin(angle) @ size
        v[:, j] = np.cos(angle) @ (size * w)
        a[:, j] = -np.sin(angle) @ (size * w**2)
    return q, v, a


def lasting(stream: np.random.Generator, memory: float) -> np.ndarray:
    """Noise (T, 2) of unit variance that forgets within `memory` rows."""
    kept, found = np.exp(-1.0 / memory), stream.standard_normal((len(T), 2))
    for k in range(1, len(found)):
        found[k] = kept * found[k - 1] + np.sqrt(1.0 - kept**2) * found[k]
    return found


def judged(seed: int, memory: float, drag: float = 0.0, size: float = 1.0) -> HeldOut:
    """A model that leaves noise, and a drag in units of the noise at the largest speed."""
    stream = np.random.default_rng(seed)
    q, v, a = motion(stream)
    shape = drag * np.abs(v) * v / np.abs(v).max(axis=0) ** 2
    for j in range(2):  # what viscous and dry friction make of it, a fit has taken away
        known = np.column_stack([v[:, j], np.sign(v[:, j]), np.ones(len(T))])
        shape[:, j] -= known @ np.linalg.lstsq(known, shape[:, j])[0]
    predicted = 20.0 * np.sin(q)
    run = HeldOutRun(
        name="run",
        certain=np.ones(q.shape, dtype=bool),
        t=T,
        q=q,
        v=v,
        a=a,
        measured=predicted + size * (lasting(stream, memory) + shape),
        predicted=predicted,
        block=np.arange(len(T)) * 20 // len(T),
    )
    return HeldOut(runs=(run,), noise_std=None, ratio=None, least_ratio=None, inflation=np.ones(2))


def sentences(one: HeldOut) -> list[str]:
    return [m.sentence for m in residual_maps(MODEL, one, one) if m.sentence]


@pytest.mark.parametrize("memory", [2.0, 5.0])
def test_what_lasts_in_time_is_no_shape(memory: float) -> None:
    """The noise is unknown; of 2 x 5 maps of 60 records hardly one may be named by chance."""
    assert sum(len(sentences(judged(seed, memory))) for seed in range(60)) <= 3


def test_a_shape_that_is_there_is_named_all_the_same() -> None:
    found = [sentences(judged(seed, 2.0, drag=8.0)) for seed in range(20)]
    assert np.mean([any("drag" in one for one in each) for each in found]) >= 0.9


def test_a_shape_upside_down_is_not_that_of_an_effect_without_negative_values() -> None:
    """Friction that grows less with speed is no drag, which only ever brakes."""
    found = [sentences(judged(seed, 2.0, drag=-8.0)) for seed in range(20)]
    assert not any("drag" in one for each in found for one in each)


def test_a_residual_that_no_processing_resolves_has_no_name() -> None:
    assert sentences(judged(1, 2.0, drag=8.0))
    assert sentences(judged(1, 2.0, drag=8.0, size=1e-5)) == []


def on_a_slide(cycles: float) -> HeldOut:
    """A wave over the 1 m that a slide travels, and a little noise."""
    stream = np.random.default_rng(0)
    q = 0.5 * np.stack([np.sin(0.7 * T), np.sin(1.1 * T)], axis=1)
    rest = np.zeros_like(q)
    rest[:, 1] = np.sin(2 * np.pi * cycles * q[:, 1])
    still = np.zeros_like(q)
    run = HeldOutRun(
        name="run",
        certain=np.ones(q.shape, dtype=bool),
        t=T,
        q=q,
        v=np.gradient(q, T, axis=0),
        a=still,
        measured=rest + 0.01 * stream.standard_normal(q.shape),
        predicted=still,
        block=np.arange(len(T)) * 20 // len(T),
    )
    noise = np.full(2, 0.01)
    return HeldOut(runs=(run,), noise_std=noise, ratio=None, least_ratio=None, inflation=np.ones(2))


def test_a_line_along_a_slide_is_in_cycles_per_metre() -> None:
    def lines(one: HeldOut) -> list[tuple[str, str]]:
        every = residual_maps(gantry(), one, one)
        return [(m.joint, m.sentence) for m in every if m.against == "cycles per metre"]

    assert lines(on_a_slide(16.0)) == [("x", ""), ("y", "a line at 16 cycles per metre: ripple")]
    assert lines(on_a_slide(1.5)) == [("x", ""), ("y", "")]  # a spring or a load
