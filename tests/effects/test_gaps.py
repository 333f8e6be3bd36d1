"""Links in gaps: several walked through together move as each alone."""

from __future__ import annotations

import numpy as np

from dynident.effects.gaps import Transmitting, through_gaps

STEP, STEPS = 1e-3, 4000


def test_several_gaps_at_once_are_each_gap_alone() -> None:
    rng = np.random.default_rng(0)
    t = STEP * np.arange(STEPS)
    gears = [
        Transmitting.of(0.1, (resonance, 0.1, 0.3), gap)
        for resonance in (15.0, 40.0)
        for gap in (1e-3, 1e-2, 5e-2)
    ]
    m = 0.07 * (1.0 + 0.2 * np.sin(t))[:, None] * rng.uniform(0.8, 1.2, len(gears))
    load = np.sin(7.0 * t)[:, None] + 0.1 * rng.standard_normal((STEPS, len(gears)))
    c, g = 0.01 * np.cos(t), 0.1 * np.sin(2.0 * t)
    d, side = through_gaps(m, c, g, load, gears, STEP)
    for v, gear in enumerate(gears):
        alone, its_side = through_gaps(m[:, [v]], c, g, load[:, [v]], [gear], STEP)
        np.testing.assert_allclose(d[:, v], alone[:, 0], rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(side[:, v], its_side[:, 0])
    # Inside its gap a link touches nothing, beyond it it does.
    half = np.array([gear.half_gap for gear in gears])
    inner = slice(1, -1)
    np.testing.assert_array_equal(side[inner] != 0, np.abs(d[inner]) > half)
    assert (np.abs(side).mean(axis=0) > 0.05).all() and (np.abs(side).mean(axis=0) < 1.0).all()


def test_a_link_that_runs_away_does_so_quietly() -> None:
    """Hanging upside down on a spring too weak to hold it, with hardly any inertia."""
    gears = [Transmitting.of(1e-6, (15.0, 0.1, 0.3), gap) for gap in (1e-3, 1e-2)]
    still = np.zeros(STEPS)
    m, load = np.full((STEPS, 2), 1e-6), np.ones((STEPS, 2))
    d, side = through_gaps(m, still, still - 5.0, load, gears, STEP)
    assert not np.isfinite(d).all(axis=0).any()
    assert np.isin(side, (-1.0, 0.0, 1.0)).all()
