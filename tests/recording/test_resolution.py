"""Steps of encoders, as they are seen in positions."""

from __future__ import annotations

import numpy as np

from dynident.recording import resolution

MOTION = np.sin(np.linspace(0.0, 7.0, 4000))


def test_positions_on_a_lattice_show_its_step_wherever_it_lies() -> None:
    rng = np.random.default_rng(0)
    noisy = MOTION + 3e-5 * rng.standard_normal(MOTION.shape)
    columns = [np.round(noisy / step) * step + 0.123 for step in (1e-4, 2.0 * np.pi / 8192)]
    np.testing.assert_allclose(
        resolution(np.stack(columns, axis=1)), [1e-4, 2.0 * np.pi / 8192], rtol=1e-6
    )


def test_positions_on_no_lattice_have_none() -> None:
    rng = np.random.default_rng(1)
    still, noisy = np.full_like(MOTION, 0.3), MOTION + 1e-5 * rng.standard_normal(MOTION.shape)
    two_steps = np.round(MOTION, 2) + np.where(MOTION > 0, 0.0037, 0.0)
    np.testing.assert_array_equal(
        resolution(np.stack([MOTION, still, noisy, two_steps], axis=1)), np.zeros(4)
    )
