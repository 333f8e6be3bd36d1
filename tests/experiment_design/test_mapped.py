"""CasADi functions along a motion: the same numbers as instant by instant, and no others."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from dynident.experiment_design.columns.mapped import mapped

X, Y = ca.SX.sym("x", 3), ca.SX.sym("y", 2, 3)
FUNCTION = ca.Function("both", [X, Y], [Y @ ca.diag(X), ca.sin(X)])


@pytest.mark.parametrize("instants", [1, 5])
def test_it_is_the_function_at_each_instant(instants: int) -> None:
    rng = np.random.default_rng(0)
    x, y = rng.standard_normal((instants, 1, 3)), rng.standard_normal((instants, 3, 2))
    product, sine = mapped(FUNCTION, x, y)
    np.testing.assert_allclose(product, y * np.swapaxes(x, 1, 2), rtol=1e-15)
    np.testing.assert_allclose(sine, np.sin(x), rtol=1e-15)


def test_a_call_leaves_the_results_of_those_before() -> None:
    x, y = np.ones((2, 1, 3)), np.ones((2, 3, 2))
    first, _ = mapped(FUNCTION, x, y)
    mapped(FUNCTION, 2 * x, y)
    np.testing.assert_array_equal(first, y)


def test_what_may_not_be_written_to_is_read() -> None:
    x, y = np.ones((2, 1, 3)), np.broadcast_to(1.0, (2, 3, 2))
    x.flags.writeable = False
    product, _ = mapped(FUNCTION, x, y)
    np.testing.assert_array_equal(product, np.ones((2, 3, 2)))


def test_other_sizes_and_sparse_results_are_refused() -> None:
    x, y = np.ones((2, 1, 3)), np.ones((2, 3, 2))
    with pytest.raises(ValueError, match="both takes"):
        mapped(FUNCTION, x, y[:1])
    with pytest.raises(ValueError, match="both takes"):
        mapped(FUNCTION, x)
    with pytest.raises(ValueError, match="sparse"):
        mapped(ca.Function("diagonal", [X], [ca.diag(X)]), x)
    diagonal = ca.SX.sym("d", ca.Sparsity.diag(3))
    with pytest.raises(ValueError, match="sparse"):
        mapped(ca.Function("trace", [diagonal], [ca.trace(diagonal)]), np.ones((2, 3, 3)))
