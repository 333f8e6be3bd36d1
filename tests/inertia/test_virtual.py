"""Virtual parameters: every choice is semi-consistent, and every such body has its choice."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dynident.errors import ConsistencyError
from dynident.inertia import (
    VIRTUAL,
    from_paper,
    from_virtual,
    inertia_matrix,
    margins,
    pseudo_inertia,
    spatial_inertia_matrix,
    virtual,
    virtual_entries,
    virtual_jacobian,
)
from inertia.bodies import assert_same, bodies

many = settings(max_examples=60)
WEAKER = np.array([1, 0, 0, 0, 1, 0, 0, 1, 0, np.sqrt(3), 0])


@st.composite
def choices(draw):
    """Eleven free numbers, in units from 1e-9 to 1e6 kg and from 0.1 mm to 1 km; zeros too."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    root = 10.0 ** draw(st.floats(-4.5, 3))
    length = 10.0 ** draw(st.floats(-4, 3))
    h = rng.normal(size=11) * np.repeat([root, length, root * length, 1.0], [1, 3, 6, 1])
    h[draw(st.lists(st.integers(0, 10), max_size=4))] = 0.0
    return h


def size_of(h):
    """Of mass, first moment and inertia (10,), as sums of the magnitudes that enter them."""
    mass, length = h[0] ** 2, np.linalg.norm(h[1:4])
    inertia = mass * length**2 + np.sum(h[4:10] ** 2)
    tiny = np.finfo(float).tiny
    return np.repeat([mass, mass * length, inertia], [1, 3, 6]) + tiny


@given(choices())
@many
def test_every_choice_is_semi_consistent(h):
    body = from_virtual(h)
    report = margins(body.phi)
    assert report.semi_consistent and report.mass >= 0 and body.viscous >= 0
    size = size_of(h)
    assert report.inertia_com_min_eig >= -1e-14 * size[4]
    root = np.sqrt(np.where(size < 1e-250, 1.0, size)[[4, 4, 4, 0, 0, 0]])
    unit = np.outer(root, root)
    assert np.linalg.eigvalsh(spatial_inertia_matrix(body.phi) / unit)[0] >= -1e-13


@given(choices())
@many
def test_the_parallel_axis_theorem(h):
    """Mass, centre of mass and the inertia about it are what the parameters are named for."""
    body = from_virtual(h)
    L = np.array([[h[4], 0, 0], [h[5], h[7], 0], [h[6], h[8], h[9]]])
    c = h[1:4]
    about_com = inertia_matrix(body.phi) - h[0] ** 2 * (c @ c * np.eye(3) - np.outer(c, c))
    np.testing.assert_allclose(about_com, L @ L.T, rtol=0, atol=1e-14 * size_of(h)[4])
    np.testing.assert_allclose(body.phi[:4], h[0] ** 2 * np.array([1, *c]), rtol=1e-15)
    assert body.viscous == h[10] * h[10]


# A thin body far out along an axis: about that axis its inertia is a difference of nothing.
@example(np.array([1.7e-4, -0.2515, 161.6175, 0.0, 0.058, 0.0, 0.0023, 0.0, 0.047, 0.0, -0.7]))
@given(choices())
@many
def test_jacobian_is_that_of_automatic_differentiation(h):
    symbols = ca.SX.sym("h", 11)
    entries = ca.vertcat(*virtual_entries(symbols))
    both = ca.Function("both", [symbols], [entries, ca.jacobian(entries, symbols)])
    values, jacobian = (np.array(one.full()) for one in both(h))
    body = from_virtual(h)
    np.testing.assert_allclose(body.phi, from_paper(values.ravel()[:10]), rtol=1e-15)
    largest = np.max(np.abs(jacobian), axis=1, keepdims=True) + np.finfo(float).tiny
    ours = virtual_jacobian(h)
    np.testing.assert_allclose(ours / largest, jacobian / largest, rtol=0, atol=1e-14)


@given(bodies(), st.floats(0, 1e3))
@many
def test_every_body_has_its_choice_points_and_rods_too(body, viscous):
    h = virtual(body.phi, viscous)
    assert np.all(h[[0, 4, 7, 9, 10]] >= 0), "the signs are chosen"
    back = from_virtual(h)
    assert_same(back.phi, body.phi, body.size, 1e-14)
    assert back.viscous == pytest.approx(viscous, rel=1e-15)


@given(choices())
@many
def test_a_body_that_only_the_paper_allows_has_its_choice(h):
    if h[0] == 0.0:
        h[1:4] = 0.0
    body = from_virtual(h)
    back = from_virtual(virtual(body.phi, body.viscous))
    assert_same(back.phi, body.phi, size_of(h), 1e-13)
    assert back.viscous == pytest.approx(body.viscous, rel=1e-15)


@given(st.integers(0, 2**32 - 1))
@many
def test_the_choice_is_unique_up_to_signs(seed):
    rng = np.random.default_rng(seed)
    h = rng.uniform(-1, 1, 11)
    diagonal = [0, 4, 7, 9, 10]
    h[diagonal] = rng.uniform(0.5, 2.0, 5)
    body = from_virtual(h)
    np.testing.assert_allclose(virtual(body.phi, body.viscous), h, rtol=0, atol=1e-13)


def test_equation_5_is_weaker_than_physics():
    assert len(VIRTUAL) == 11
    phi = from_virtual(WEAKER).phi
    np.testing.assert_allclose(inertia_matrix(phi), np.diag([1, 1, 3]), atol=1e-15)
    report = margins(phi)
    assert report.semi_consistent and not report.consistent
    assert np.linalg.eigvalsh(pseudo_inertia(phi))[0] == pytest.approx(-0.5)
    assert np.linalg.eigvalsh(spatial_inertia_matrix(phi))[0] > 0
    np.testing.assert_allclose(virtual(phi), WEAKER, atol=1e-15)


def test_a_massless_body_with_an_inertia():
    phi = np.array([0, 0, 0, 0, 2.0, 0.1, 3.0, 0.2, 0.3, 4.0])
    h = virtual(phi)
    np.testing.assert_array_equal(h[:4], 0.0)
    np.testing.assert_allclose(from_virtual(h).phi, phi, atol=1e-15)


def test_arrays_of_bodies_in_one_call():
    h = np.random.default_rng(0).normal(size=(11, 5))
    together = from_paper(np.array(virtual_entries(h))[:10].T)
    np.testing.assert_allclose(together, [from_virtual(one).phi for one in h.T], rtol=1e-14)


@pytest.mark.parametrize(
    ("phi", "viscous", "rule"),
    [
        ([-1, 0, 0, 0, 1, 0, 1, 0, 0, 1], 0.0, r"the mass is negative \(-1 kg\)"),
        ([1, 0, 0, 0, 1, 0, 1, 0, 0, -2], 0.0, r"smallest principal moment -2 kg m\^2"),
        ([1, 5, 0, 0, 1, 0, 1, 0, 0, 1], 0.0, "the inertia about the centre of mass"),
        ([0, 1, 0, 0, 1, 0, 1, 0, 0, 1], 0.0, "a first moment but no mass"),
        ([1, 0, 0, 0, 1, 0, 1, 0, 0, 1], -0.5, r"the viscous friction is negative \(-0.5\)"),
        ([1, 0, 0, 0, np.nan, 0, 1, 0, 0, 1], 0.0, "not finite"),
        ([1, 0, 0, 0, 1, 0, 1, 0, 0, 1], np.nan, "not finite"),
    ],
)
def test_what_breaks_a_rule_is_refused_by_its_name(phi, viscous, rule):
    with pytest.raises(ConsistencyError, match=f"arm: is not semi-consistent.*{rule}"):
        virtual(phi, viscous, "arm")
    with pytest.raises(ValueError, match="eleven"):
        from_virtual(np.zeros(10))
