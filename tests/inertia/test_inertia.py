"""Ten parameters: conversions, changes of frame, margins."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynident.inertia import (
    PARAMETERS,
    UNITS,
    frame_change,
    from_com,
    inertia_matrix,
    margins,
    pseudo_inertia,
    to_com,
)
from dynident.robot.formats.elements import from_rpy
from inertia.bodies import bodies

seeds = st.integers(0, 2**32 - 1)


def cloud(seed):
    """Point masses: phi by definition, and the points."""
    rng = np.random.default_rng(seed)
    points, masses = rng.normal(size=(7, 3)), rng.uniform(0.1, 2, 7)
    return points, masses, of_points(points, masses)


def of_points(points, masses):
    inertia = np.zeros((3, 3))
    for p, m in zip(points, masses, strict=True):
        inertia += m * (p @ p * np.eye(3) - np.outer(p, p))
    moment = masses @ points
    six = [inertia[i] for i in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.array([masses.sum(), *moment, *six])


def test_order_and_units():
    assert PARAMETERS == ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
    assert len(UNITS) == 10 and UNITS[0] == "kg" and UNITS[1] == "kg m" and UNITS[9] == "kg m^2"


@given(seeds)
@settings(max_examples=40)
def test_centre_of_mass_form_and_back(seed):
    points, masses, phi = cloud(seed)
    properties = to_com(phi)
    com = masses @ points / masses.sum()
    np.testing.assert_allclose(properties.com, com, atol=1e-12)
    about = of_points(points - com, masses)
    np.testing.assert_allclose(properties.inertia_com, inertia_matrix(about), atol=1e-11)
    back = from_com(properties.mass, properties.com, properties.inertia_com)
    np.testing.assert_allclose(back, phi, atol=1e-12 * np.max(np.abs(phi)))


@given(seeds)
@settings(max_examples=40)
def test_frame_change_moves_the_points(seed):
    points, masses, phi = cloud(seed)
    rng = np.random.default_rng(seed)
    R, p = from_rpy(rng.uniform(-3, 3, 3)), rng.normal(size=3)
    want = of_points(points @ R.T + p, masses)
    change = frame_change(R, p)
    np.testing.assert_allclose(change @ phi, want, atol=1e-11)
    back = frame_change(R.T, -R.T @ p)
    np.testing.assert_allclose(back @ change, np.eye(10), atol=1e-12)


@given(seeds)
@settings(max_examples=40)
def test_matter_is_consistent_in_any_frame(seed):
    points, masses, phi = cloud(seed)
    homogeneous = np.column_stack([points, np.ones(len(points))])
    want = homogeneous.T @ (masses[:, None] * homogeneous)
    np.testing.assert_allclose(pseudo_inertia(phi), want, atol=1e-11)
    report = margins(phi)
    assert report.consistent and report.worst[1] > 0
    assert report.mass == phi[0]


def test_a_point_mass_and_nothing_are_on_the_edge_and_consistent():
    for phi in (from_com(2.0, [1, 2, 3], np.zeros((3, 3))), np.zeros(10)):
        assert margins(phi).consistent


def test_the_papers_rule_is_weaker_than_physics():
    """I = diag(1, 1, 3): positive definite, but one moment exceeds the sum of the others."""
    report = margins([1, 0, 0, 0, 1, 0, 1, 0, 0, 3])
    assert not report.consistent
    assert report.triangle == pytest.approx(-1.0)
    assert report.pseudo_inertia_min_eig == pytest.approx(-0.5)
    assert report.inertia_com_min_eig > 0
    assert report.worst == ("triangle", report.triangle)


@pytest.mark.parametrize(
    "phi",
    [
        [-1, 0, 0, 0, 1, 0, 1, 0, 0, 1],
        [1, 0, 0, 0, 1, 0, 1, 0, 0, -1],
        [0, 1, 0, 0, 1, 0, 1, 0, 0, 1],
        [1, 5, 0, 0, 1, 0, 1, 0, 0, 1],
        [np.nan, 0, 0, 0, 1, 0, 1, 0, 0, 1],
        [1, 0, 0, 0, np.inf, 0, 1, 0, 0, 1],
    ],
)
def test_broken_bodies(phi):
    report = margins(phi)
    assert not report.consistent
    assert not report.worst[1] >= 0


def test_massless_with_a_first_moment_has_no_centre_of_mass():
    assert np.all(np.isnan(to_com([0, 1, 0, 0, 1, 0, 1, 0, 0, 1]).com))
    np.testing.assert_array_equal(to_com([0, 0, 0, 0, 1, 0, 1, 0, 0, 1]).com, np.zeros(3))
    with pytest.raises(ValueError, match="ten"):
        to_com(np.zeros(3))


@given(bodies())
@settings(max_examples=60)
def test_verdicts_do_not_depend_on_the_size_of_the_body(body):
    phi, length = body.phi, body.size[1] / body.size[0]
    report = margins(phi)
    assert report.consistent and report.semi_consistent and report.broken == ()
    # A hundredth of the inertia added about one axis, taken off about another, or no mass.
    unit = 1e-2 * report.inertia_scale
    plate = from_com(phi[0], phi[1:4] / phi[0], np.diag([1.0, 1.0, 2.01]) * unit)
    assert margins(plate).broken == ("triangle",)
    assert margins(plate).semi_consistent and not margins(plate).consistent
    negative = from_com(phi[0], phi[1:4] / phi[0], np.diag([1.0, 1.0, -0.01]) * unit)
    assert margins(negative).broken == ("inertia_com_min_eig", "triangle")
    assert not margins(negative).semi_consistent
    hollow = from_com(-phi[0], phi[1:4] / phi[0], np.eye(3) * phi[0] * length**2)
    assert "mass" in margins(hollow).broken and not margins(hollow).semi_consistent


@given(st.floats(1e-4, 1e3), st.floats(0, 1), st.floats(1e-9, 1e6))
@settings(max_examples=60)
def test_seven_digits_of_a_thin_plate_are_forgiven(width, ratio, mass):
    x, y = mass * width**2 / 12, mass * (ratio * width) ** 2 / 12
    written = [float(f"{moment:.7g}") for moment in (x, y, x + y)]
    assert margins(from_com(mass, np.zeros(3), np.diag(written))).consistent


def test_a_mass_lost_by_rounding_counts_as_none():
    """Its centre of mass could be anywhere, and the moments about it look right."""
    sound = np.array([0, 0, 0, 0, 1, 0, 1, 0, 0, 1.0])
    lost = sound - 1e-12 * np.eye(10)[0]
    for phi in (sound, lost, lost + 1e-15 * np.eye(10)[1]):
        assert margins(phi).consistent
    assert not margins(lost + 1e-3 * np.eye(10)[1]).semi_consistent
