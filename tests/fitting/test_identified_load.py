"""A load as it was identified: what is told apart, and the nearest body that can exist."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.fitting.loads.identified_load import QUANTITIES, IdentifiedLoad
from dynident.fitting.loads.load import Load
from dynident.fitting.loads.nearest_possible import nearest_possible
from dynident.inertia import PARAMETERS, from_com, pseudo_inertia


def test_what_a_planar_arm_tells_of_a_load_is_said() -> None:
    """About a vertical axis mz and five second moments make no torque; Izz rests on none."""
    phi = from_com(2.2, [0.03, -0.05, 0.12], np.diag([0.006, 0.009, 0.007]))
    whole = IdentifiedLoad(load=Load(name="crate"), phi=phi, covariance=np.eye(10), acting=phi)
    planar = np.where([n in ("m", "mx", "my", "Izz") for n in PARAMETERS], phi, np.nan)
    part = replace(whole, phi=planar)
    known = [QUANTITIES.index(one) for one in ("mass", "x", "y", "Izz")]
    np.testing.assert_allclose(part.values[known], whole.values[known], rtol=1e-12)
    np.testing.assert_allclose(part.sigma[known], whole.sigma[known], rtol=1e-9)
    assert np.isnan(np.delete(part.values, known)).all()
    np.testing.assert_allclose(part.values[QUANTITIES.index("Izz")], 0.007)


@pytest.mark.parametrize("spread", [1e-5, 1e-3, 0.1])
def test_the_nearest_body_keeps_a_centre_that_is_given(spread: float) -> None:
    """Three combinations of the parameters have no variance, however much the others have."""
    centre = np.array([0.03, -0.05, 0.12])
    phi = from_com(2.2, centre, np.diag([0.006, 0.02, 0.007]))  # no body: 0.02 > 0.013
    free = np.zeros((10, 7))
    free[:, 0] = from_com(1.0, centre, np.zeros((3, 3)))
    free[4:, 1:] = np.eye(6)
    sigma = spread * np.array([1e-3, *([1.0] * 6)])
    found = nearest_possible(phi, free @ np.diag(sigma**2) @ free.T)
    np.testing.assert_allclose(found.phi[1:4] / found.phi[0], centre, atol=1e-4)
    assert np.linalg.eigvalsh(pseudo_inertia(found.phi)).min() > -1e-9
