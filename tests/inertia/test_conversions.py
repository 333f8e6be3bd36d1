"""The same body in other programs' and papers' forms: their numbers agree, and come back."""

from typing import Any

import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynident.errors import DynidentError, RobotError
from dynident.inertia import (
    PAPER_ORDER,
    PARAMETERS,
    from_drake,
    from_paper,
    from_pinocchio,
    from_pseudo_inertia,
    from_spatial_inertia_matrix,
    pseudo_inertia,
    spatial_inertia_matrix,
    to_drake,
    to_paper,
    to_pinocchio,
)
from inertia.bodies import assert_same, bodies, matter

pin: Any = pinocchio
seeds = st.integers(0, 2**32 - 1)
many = settings(max_examples=60)


@given(bodies())
@many
def test_there_and_back(body):
    phi, size = body.phi, body.size
    np.testing.assert_array_equal(from_paper(to_paper(phi)), phi)
    np.testing.assert_array_equal(from_spatial_inertia_matrix(spatial_inertia_matrix(phi)), phi)
    assert_same(from_pseudo_inertia(pseudo_inertia(phi)), phi, size, 1e-14)
    assert_same(from_pinocchio(to_pinocchio(phi)), phi, size, 1e-14)
    assert_same(from_drake(to_drake(phi)), phi, size, 1e-14)


@given(seeds)
@many
def test_there_and_back_for_numbers_that_are_no_body(seed):
    phi = np.random.default_rng(seed).normal(size=10)
    phi[0] += np.sign(phi[0])
    np.testing.assert_array_equal(from_spatial_inertia_matrix(spatial_inertia_matrix(phi)), phi)
    for back in (
        from_pseudo_inertia(pseudo_inertia(phi)),
        from_pinocchio(to_pinocchio(phi)),
        from_drake(to_drake(phi)),
    ):
        np.testing.assert_allclose(back, phi, rtol=0, atol=1e-13)


@given(bodies())
@many
def test_pseudo_inertia_is_the_second_moment_of_homogeneous_points(body):
    homogeneous = np.column_stack([body.points, np.ones(len(body.points))])
    second = homogeneous.T @ (body.masses[:, None] * homogeneous)
    assert_same(from_pseudo_inertia(second), body.phi, body.size, 1e-14)


@given(bodies(), seeds)
@many
def test_the_energy_of_motion_is_that_of_the_points(body, seed):
    rng = np.random.default_rng(seed)
    length = body.size[1] / body.size[0]
    omega, v = rng.normal(size=3), length * rng.normal(size=3)
    twist = np.concatenate([omega, v])
    want = body.kinetic_energy(omega, v)
    unit = body.size[4]
    energy = 0.5 * twist @ spatial_inertia_matrix(body.phi) @ twist
    assert abs(energy - want) < 1e-13 * unit
    theirs = 0.5 * to_pinocchio(body.phi).vtiv(pin.Motion(v, omega))
    assert abs(theirs - want) < 1e-13 * unit


@given(bodies())
@many
def test_their_own_matrices_agree(body):
    phi = body.phi
    root = np.repeat([body.size[4], body.size[0]], 3) ** 0.5
    unit = np.outer(root, root)
    ours = spatial_inertia_matrix(phi)
    drake = to_drake(phi).CopyToFullMatrix6()
    np.testing.assert_allclose(drake / unit, ours / unit, rtol=0, atol=1e-14)
    swap = [3, 4, 5, 0, 1, 2]  # Pinocchio puts the linear part first
    theirs = to_pinocchio(phi).matrix()[np.ix_(swap, swap)]
    np.testing.assert_allclose(theirs / unit, ours / unit, rtol=0, atol=1e-14)
    root = np.repeat([body.size[4], body.size[0]], [3, 1]) ** 0.5
    unit = np.outer(root, root)
    second = pin.PseudoInertia.FromDynamicParameters(phi).toMatrix()
    np.testing.assert_allclose(second / unit, pseudo_inertia(phi) / unit, rtol=0, atol=1e-14)


def test_papers_order_is_the_upper_triangle_row_by_row():
    assert PAPER_ORDER[4:] == ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
    named = dict(zip(PARAMETERS, range(10), strict=True))
    np.testing.assert_array_equal(to_paper(range(10)), [named[name] for name in PAPER_ORDER])
    stacked = np.arange(40.0).reshape(2, 2, 10)
    np.testing.assert_array_equal(from_paper(to_paper(stacked)), stacked)


def test_massless_bodies():
    inertia_only = np.array([0, 0, 0, 0, 2.0, 0.1, 3.0, 0.2, 0.3, 4.0])
    nothing = np.zeros(10)
    for phi in (inertia_only, nothing):
        np.testing.assert_array_equal(from_pinocchio(to_pinocchio(phi)), phi)
        np.testing.assert_allclose(from_drake(to_drake(phi)), phi, rtol=1e-15, atol=1e-12)


@pytest.mark.parametrize(("there", "name"), [(to_pinocchio, "Pinocchio"), (to_drake, "Drake")])
def test_what_they_cannot_hold_is_refused(there, name):
    phi = np.zeros(10)
    phi[1] = 1.0
    with pytest.raises(DynidentError, match=f"arm: has a first moment but no mass, which {name}"):
        there(phi, "arm")
    for value in (np.nan, np.inf):
        with pytest.raises(RobotError, match="arm: has inertial parameters that are not finite"):
            there(np.full(10, value), "arm")


def test_a_matrix_that_is_no_spatial_inertia_is_refused():
    M = spatial_inertia_matrix(matter(0, "solid", 2.0, 0.3).phi)
    swap = [3, 4, 5, 0, 1, 2]
    turned = M[np.ix_(swap, swap)]
    lopsided, heavy = M.copy(), M.copy()
    lopsided[0, 1] += 1e-3
    heavy[3, 3] *= 1.01
    for wrong in (turned, lopsided, heavy):
        with pytest.raises(RobotError, match="no spatial inertia"):
            from_spatial_inertia_matrix(wrong)


def test_wrong_shapes():
    for convert in (to_paper, from_paper, to_pinocchio, to_drake, spatial_inertia_matrix):
        with pytest.raises(ValueError, match="ten"):
            convert(np.zeros(9))
    with pytest.raises(ValueError, match="4x4"):
        from_pseudo_inertia(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="6x6"):
        from_spatial_inertia_matrix(np.zeros((4, 4)))
