"""Regressions under any gravity are those of the robot under it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from chains import chain
from dynident.wiring.regressions.any_gravity import AnyGravity
from dynident.wiring.regressions.wiring_regression import WiringRegression
from dynident.wiring.regressions.wiring_rows import rows_of
from study_files import recording, true_model
from synthetic import smooth_motion


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (-8.74, 2.0, -4.0)])
@pytest.mark.parametrize("joints", [2, 5])
def test_it_is_the_regression_of_the_robot_under_it(
    gravity: tuple[float, ...], joints: int
) -> None:
    if joints == 2:
        model, one = true_model(), recording(0)
    else:
        model = di.Model(chain(joints, 1))
        t, q, _, _ = smooth_motion(joints, 1, 100.0, 16.0, 8.0)
        tau = np.random.default_rng(0).normal(size=q.shape)
        one = di.Recording(t, q, tau, model.robot.names)
    rows = rows_of(di.Dataset((one,)), 100, 10.0)
    found = AnyGravity.of(model, rows).regression(np.array(gravity))
    under = replace(model, robot=model.robot.with_gravity(gravity))
    wanted = WiringRegression.of(under, rows)
    for name in ("gram", "cross", "power", "inertia_of", "friction_of"):
        mine, theirs = getattr(found, name), getattr(wanted, name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())
