"""p values in words: nobody knows the tail of a test to thirty digits."""

import pytest

from dynident.tables import p_value


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (None, "-"),
        (float("nan"), "-"),
        (0.0, "< 0.001"),
        (9.5e-27, "< 0.001"),
        (1e-3, "0.001"),
        (0.0123, "0.012"),
        (1.0, "1"),
    ],
)
def test_small_p_values_are_below_a_thousandth(value: float | None, said: str) -> None:
    assert p_value(value) == said
