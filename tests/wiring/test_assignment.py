"""Columns in the order and scale of joints, and the motors that turn these."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dynident.wiring.assignment import Assignment

N = 4


@given(st.permutations(range(N)), st.integers(0, 2**32 - 1))
def test_motors_turn_as_they_did_whatever_joints_are_called(order: list[int], seed: int) -> None:
    """Exchanged and rescaled with their joints, motors make the same turns of the same motion."""
    rng = np.random.default_rng(seed)
    scale = rng.choice([-1.0, 1.0], N) * rng.uniform(0.02, 50.0, N)
    one = Assignment(
        position_of=np.array(order),
        torque_of=np.array(order),
        position_scale=scale,
        torque_scale=1.0 / scale,
    )
    recorded = np.eye(N) + rng.standard_normal((N, N))
    q = rng.standard_normal(N)
    np.testing.assert_allclose(one.motors(recorded) @ (one.change @ q), one.change @ recorded @ q)
    assert np.array_equal(one.motors(np.eye(N)), np.eye(N))
