"""The nearest possible body: possible, near, and whatever the units and axes."""

from __future__ import annotations

import numpy as np
import pytest

from chains import clipped, least
from dynident.errors import FitError
from dynident.inertia import distance_rows, frame_change, from_com, reference_body
from dynident.nlp import nearest_body

# --- nearest_body --------------------------------------------------------------------------------


@pytest.mark.parametrize("consistency", ["full", "semi"])
@pytest.mark.slow
def test_nearest_bodies_of_any_size_are_consistent_and_near(consistency) -> None:
    rng = np.random.default_rng(8)
    for _ in range(40):
        mass, length = 10.0 ** rng.uniform(-3, 3, 2)
        size = mass * length ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
        phi = rng.normal(size=10) * size
        phi[0] = abs(phi[0])
        found = nearest_body(phi, length, consistency, mass)
        assert least(found, consistency) >= 0
        rows = distance_rows(reference_body(phi, mass, length))
        moved = np.linalg.norm(rows @ (found - phi))
        best = np.linalg.norm(rows @ (clipped(phi, reference_body(phi, mass, length)) - phi))
        assert moved <= best * (1 + 1e-6)
        if consistency == "full":
            assert moved >= best * (1 - 1e-6)
        # The same body in g.
        np.testing.assert_allclose(
            rows @ nearest_body(1e3 * phi, length, consistency, 1e3 * mass),
            rows @ found * 1e3,
            atol=1e-2 * np.max(np.abs(rows @ found)),
        )


def test_the_nearest_body_does_not_depend_on_the_axes() -> None:
    phi = from_com(2.0, [0.1, 0.0, 0.05], np.diag([0.01, 0.02, 0.05]))
    R = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn = frame_change(R * np.linalg.det(R), np.zeros(3))
    np.testing.assert_allclose(
        nearest_body(turn @ phi, 0.3), turn @ nearest_body(phi, 0.3), atol=1e-8
    )


def test_a_consistent_body_comes_back_as_a_copy_of_itself() -> None:
    phi = from_com(2.0, [0.1, 0.0, 0.2], np.diag([0.02, 0.03, 0.05]))
    found = nearest_body(phi, 0.3)
    np.testing.assert_array_equal(found, phi)
    assert found is not phi
    for broken in (np.full(10, np.nan), np.ones(9)):
        with pytest.raises(FitError, match="ten finite"):
            nearest_body(broken, 0.3)
