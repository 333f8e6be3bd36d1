"""A joint that is faster than it can be, while others show that limits are those of the drives."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.wiring.speed_limits import over_speed
from synthetic import arm

LIMIT = 6.0
"""rad/s, of both joints of the arm."""
_TIME = np.linspace(0.0, 20.0, 5000)


def speeds(*largest: float) -> np.ndarray:
    return np.stack([x * np.sin(_TIME + k) for k, x in enumerate(largest)], axis=1)


def test_one_joint_beyond_its_limit_beside_one_that_keeps_it() -> None:
    found = over_speed(arm(), speeds(LIMIT, 1.2 * LIMIT))
    assert found is not None and (found.joint, found.at_limit) == ("elbow", ("shoulder",))
    assert found.reached == pytest.approx(1.2 * LIMIT, rel=1e-3)
    assert "20 % over its limit" in found.sentence
    assert "shoulder comes near its own and keeps it" in found.sentence


@pytest.mark.parametrize(
    "largest",
    [
        pytest.param((LIMIT, LIMIT), id="both keep theirs"),
        pytest.param((0.5 * LIMIT, 1.2 * LIMIT), id="limits that nothing comes near"),
        pytest.param((1.2 * LIMIT, 1.2 * LIMIT), id="limits that nobody keeps"),
    ],
)
def test_nothing_is_said_where_limits_tell_nothing(largest: tuple[float, float]) -> None:
    assert over_speed(arm(), speeds(*largest)) is None


def test_a_single_row_is_no_speed() -> None:
    v = speeds(LIMIT, LIMIT)
    v[100, 1] = 3.0 * LIMIT
    assert over_speed(arm(), v) is None
