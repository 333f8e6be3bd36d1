"""Links in dead zones: several walked through together move as each alone, compiled or not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.batch.compiler import compiler
from dynident.effects.transmissions.dead_zone import DeadZoneLink, Transmitting, through_dead_zones

STEP, STEPS = 1e-3, 4000


def links_of_several_lengths() -> list[DeadZoneLink]:
    rng = np.random.default_rng(0)
    links = []
    for resonance in (15.0, 40.0):
        for gap in (1e-3, 1e-2, 5e-2):
            gear = Transmitting.of(0.1, (resonance, 0.1, 0.3), gap)
            # Of other lengths and steps, as recordings are.
            t = STEP * rng.uniform(0.5, 1.0) * np.arange(STEPS - rng.integers(500))
            m = 0.07 * (1.0 + 0.2 * np.sin(t)) * rng.uniform(0.8, 1.2)
            load = np.sin(7.0 * t) + 0.1 * rng.standard_normal(len(t))
            c, g = 0.01 * np.cos(t), 0.1 * np.sin(2.0 * t)
            a = rng.standard_normal(len(t))
            motion = {"whole": m, "needed": load, "a": a, "c": c, "g": g, "step": t[1]}
            links.append(DeadZoneLink(gear=gear, least=0.035, **motion))
    return links


def first_steps(link: DeadZoneLink, steps: int) -> DeadZoneLink:
    signals = ("whole", "needed", "a", "c", "g")
    return replace(link, **{name: getattr(link, name)[:steps] for name in signals})


def equation_of_motion(link: DeadZoneLink, d: np.ndarray) -> np.ndarray:
    """What a deflection (S,) leaves of m d'' + c d' + g d + transmitted = load, by differences."""
    now, gear = d[1:-1], link.gear
    m, c, g, load = (x[1:-1] for x in (link.m, link.c, link.g, link.load))
    rate, bend = (d[2:] - d[:-2]) / (2.0 * link.step), (d[2:] - 2.0 * now + d[:-2]) / link.step**2
    beyond = now - np.clip(now, -gear.half_gap, gear.half_gap)
    transmitted = gear.stiffness * beyond + gear.damping * rate * (beyond != 0.0)
    return m * bend + c * rate + g * now + transmitted - load


@pytest.mark.parametrize("wish", ["never", "auto"])
def test_several_gaps_at_once_are_each_gap_alone(wish, monkeypatch) -> None:
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    links = links_of_several_lengths()
    for link, together in zip(links, through_dead_zones(links), strict=True):
        (alone,) = through_dead_zones([link])
        np.testing.assert_allclose(together.d, alone.d, rtol=1e-6, atol=1e-9)
        # Free inside its gap, held by the transmission beyond it.
        left = equation_of_motion(link, alone.d)
        assert np.abs(left).max() < 1e-6 * np.abs(link.load).max()
        assert 0.05 < np.abs(alone.side).mean() < 1.0


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_compiled_is_the_replay_to_the_bit(monkeypatch) -> None:
    """For more links of one length than walk together, and for some of other lengths."""
    links = links_of_several_lengths()
    links += [
        replace(links[0], needed=scale * links[0].needed) for scale in np.linspace(0.5, 2.0, 9)
    ]
    # Some end long before the others, and about where a part of the steps does.
    links += [first_steps(links[1], steps) for steps in (2, 3, 512, 513, 514, 700, 1025)]
    compiled = through_dead_zones(links)
    monkeypatch.setenv("DYNIDENT_COMPILE", "never")
    for one, replayed in zip(compiled, through_dead_zones(links), strict=True):
        np.testing.assert_array_equal(one.d, replayed.d)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_one_link_that_leans_on_no_side_is_the_replay_to_the_bit(monkeypatch) -> None:
    """At rest without load it touches its edge, and no more."""
    link = replace(links_of_several_lengths()[2], a=np.zeros(STEPS), least=1e-3)
    t = STEP * np.arange(STEPS)
    motion = {"whole": np.full(STEPS, 0.1), "needed": np.sin(7.0 * t) ** 3}
    link = replace(link, c=np.zeros(STEPS), g=np.zeros(STEPS), step=STEP, **motion)
    (compiled,) = through_dead_zones([link])
    monkeypatch.setenv("DYNIDENT_COMPILE", "never")
    (replayed,) = through_dead_zones([link])
    np.testing.assert_array_equal(compiled.d, replayed.d)
    assert np.ptp(compiled.side) == 2.0


@pytest.mark.parametrize("wish", ["never", "auto"])
def test_a_link_that_runs_away_does_so_quietly(wish, monkeypatch) -> None:
    """Hanging upside down on a spring too weak to hold it, with hardly any inertia."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    m, load, still = np.full(STEPS, 1e-6), np.ones(STEPS), np.zeros(STEPS)
    gears = [Transmitting.of(1e-6, (15.0, 0.1, 0.3), gap) for gap in (1e-3, 1e-2)]
    motion = {"whole": m, "needed": load, "a": still, "c": still, "g": still - 5.0, "step": STEP}
    links = [DeadZoneLink(gear=one, least=1e-9, **motion) for one in gears]
    for walked in through_dead_zones(links):
        assert not np.isfinite(walked.d).all()
