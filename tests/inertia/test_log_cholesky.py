"""Log-Cholesky parameters: every choice is a possible body, and every body has its choice."""

from typing import Any

import casadi as ca
import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynident.errors import ConsistencyError
from dynident.inertia import (
    LOG_CHOLESKY,
    from_log_cholesky,
    log_cholesky,
    log_cholesky_entries,
    log_cholesky_jacobian,
    margins,
    pseudo_inertia,
)
from inertia.bodies import SINGULAR, assert_same, bodies, matter

pin: Any = pinocchio
many = settings(max_examples=60)


@st.composite
def choices(draw):
    """Ten free numbers, in units from 1e-9 to 1e6 kg and from 0.1 mm to 1 km."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    length = 10.0 ** draw(st.floats(-4, 3))
    eta = rng.normal(size=10)
    eta[0] = 0.5 * np.log(10.0) * draw(st.floats(-9, 6))
    eta[1:4] += np.log(length)
    eta[4:] *= length
    return eta


def size_of(eta):
    length = np.max([*np.exp(eta[1:4]), *np.abs(eta[4:])])
    return np.exp(2 * eta[0]) * np.repeat([1.0, length, length**2], [1, 3, 6])


@given(choices())
@many
def test_every_choice_is_a_fully_consistent_body(eta):
    phi = from_log_cholesky(eta)
    report = margins(phi)
    assert report.consistent and report.mass > 0
    assert report.triangle > 0 and report.inertia_com_min_eig > 0
    root = np.sqrt(size_of(eta)[[4, 4, 4, 0]])
    assert np.linalg.eigvalsh(pseudo_inertia(phi) / np.outer(root, root))[0] > 0


@given(choices())
@many
def test_names_say_what_they_are(eta):
    phi = from_log_cholesky(eta)
    named = dict(zip(LOG_CHOLESKY, eta, strict=True))
    np.testing.assert_allclose(phi[0], np.exp(2 * named["alpha"]), rtol=1e-15)
    com = [named["t1"], named["t2"], named["t3"]]
    np.testing.assert_allclose(phi[1:4] / phi[0], com, rtol=1e-14)


@given(choices())
@many
def test_pinocchio_has_the_same_map_and_jacobian(eta):
    theirs = pin.LogCholeskyParameters(eta)
    size = size_of(eta)
    assert_same(from_log_cholesky(eta), theirs.toDynamicParameters(), size, 1e-14)
    step = np.concatenate([np.ones(4), np.full(6, size[1] / size[0])])
    unit = size[:, None] / step
    ours = log_cholesky_jacobian(eta)
    np.testing.assert_allclose(ours / unit, theirs.calculateJacobian() / unit, rtol=0, atol=1e-13)


@given(choices())
@many
def test_jacobian_is_that_of_automatic_differentiation(eta):
    symbols = ca.SX.sym("eta", 10)
    entries = ca.vertcat(*log_cholesky_entries(symbols, ca.exp))
    both = ca.Function("both", [symbols], [entries, ca.jacobian(entries, symbols)])
    phi, jacobian = (np.array(one.full()) for one in both(eta))
    size = size_of(eta)
    assert_same(from_log_cholesky(eta), phi.ravel(), size, 1e-14)
    ours = log_cholesky_jacobian(eta)
    unit = size[:, None] / np.concatenate([np.ones(4), np.full(6, size[1] / size[0])])
    np.testing.assert_allclose(ours / unit, jacobian / unit, rtol=0, atol=1e-13)
    assert np.linalg.matrix_rank(ours / unit, tol=1e-14) == 10, "no direction is lost"


@given(bodies("solid"))
@many
def test_every_solid_has_its_choice(body):
    eta = log_cholesky(body.phi)
    assert_same(from_log_cholesky(eta), body.phi, body.size, 1e-14)


@given(st.integers(0, 2**32 - 1))
@many
def test_the_choice_is_unique(seed):
    eta = np.random.default_rng(seed).uniform(-1, 1, 10)
    np.testing.assert_allclose(log_cholesky(from_log_cholesky(eta)), eta, rtol=0, atol=1e-11)


def test_arrays_of_bodies_in_one_call():
    eta = np.random.default_rng(0).normal(size=(10, 5))
    together = np.array(log_cholesky_entries(eta, np.exp))
    alone = np.column_stack([from_log_cholesky(one) for one in eta.T])
    np.testing.assert_allclose(together, alone, rtol=1e-15)


@given(bodies(*SINGULAR))
@many
def test_bodies_without_extent_are_at_infinity(body):
    with pytest.raises(ConsistencyError, match="arm: is without mass or without extent"):
        log_cholesky(body.phi, "arm")


@pytest.mark.parametrize("phi", [np.zeros(10), [0, 0, 0, 0, 1, 0, 1, 0, 0, 1]])
def test_bodies_without_mass_are_at_infinity(phi):
    with pytest.raises(ConsistencyError, match="without mass"):
        log_cholesky(phi)


def test_what_breaks_a_rule_is_refused_by_its_name():
    phi = matter(1, "solid", 1.0, 1.0).phi
    for broken, rule in (
        ([1, 0, 0, 0, 1, 0, 1, 0, 0, 3], "triangle is -1"),
        ([-50, *phi[1:]], "mass is -50"),
        ([1, 0, 0, 0, np.nan, 0, 1, 0, 0, 1], "is nan"),
    ):
        with pytest.raises(ConsistencyError, match=rule):
            log_cholesky(broken)
    with pytest.raises(ValueError, match="ten"):
        from_log_cholesky(np.zeros(11))
