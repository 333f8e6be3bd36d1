"""A right angle written with some digits: the same parameters, in fits and in the diagnosis."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis import Diagnosis
from dynident.recording import Dataset, Recording
from dynident.robot import structural_base
from synthetic import smooth_motion

EXACT = repr(np.pi / 2)


def arm(right_angle: str) -> di.Robot:
    """Three joints: a vertical axis, and two horizontal ones that are parallel."""
    axes = ((f"{right_angle} 0 0", "0 1 0"), (f"-{right_angle} 0 0", "1 0 0"), ("0 0 0", "1 0 0"))
    parts = ['<robot name="arm"><link name="l0"/>']
    for k, (rpy, axis) in enumerate(axes, start=1):
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.02 0.1 0.01"/><mass value="{4 - k}"/>'
            '<inertia ixx="0.05" iyy="0.03" izz="0.04" ixy="0.001" ixz="0.002" iyz="0.001"/>'
            f'</inertial></link><joint name="j{k}" type="revolute"><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><origin xyz="0 0.3 0.1" rpy="{rpy}"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" velocity="3" effort="100"/></joint>'
        )
    return di.Robot.from_text("".join([*parts, "</robot>"]))


def recordings(robot: di.Robot, noise: float = 0.05) -> tuple[Dataset, Dataset]:
    """A recording to fit and one to judge by, of the arm as it truly is."""
    made = []
    for seed in (1, 2):
        t, q, v, a = smooth_motion(3, seed, 100.0, 16.0, 8.0, 0.5)
        tau = robot.inverse_dynamics(q, v, a)
        tau = tau + noise * np.random.default_rng(seed).normal(size=tau.shape)
        made.append(Dataset((Recording(t, q, tau, robot.names, period=8.0),)))
    return made[0], made[1]


@pytest.mark.parametrize("digits", ["1.5707963", "1.570796", "1.5708"])
def test_the_digits_of_a_right_angle_add_no_parameters(digits: str) -> None:
    robot = arm(digits)
    base, exact = structural_base(robot), structural_base(arm(EXACT))
    assert base.independent == exact.independent
    assert {"mx.l1", "mz.l1"} <= set(base.nearly_hidden)
    assert exact.nearly_hidden == ()
    # What is left out makes no torque worth the name.
    q, v, a = robot.random_motion(5, 50)
    Y = robot.regressor(q, v, a)
    tau = base.reduce(Y) @ base.coordinates(robot.theta)
    np.testing.assert_allclose(tau, Y @ robot.theta, atol=1e-4 * np.abs(Y @ robot.theta).max())


@cache
def fitted_and_told(right_angle: str) -> tuple[di.Estimate, Diagnosis]:
    """What is said of the arm by a description with these digits."""
    train, test = recordings(arm(EXACT))
    fitted = di.fit(di.Model(arm(right_angle)), train)
    return fitted, di.diagnose(fitted, train, test)


@pytest.mark.parametrize("digits", ["1.5707963", "1.5708"])
@pytest.mark.slow
def test_fit_and_diagnosis_say_the_same_whatever_the_digits(digits: str) -> None:
    (of_exact, told_exact), (of_written, told_written) = map(fitted_and_told, (EXACT, digits))
    for exact, written in ((of_exact, of_written), (told_exact.after, told_written.after)):
        assert written.basis.rank == exact.basis.rank
        assert written.model.names == exact.model.names
        sigma = np.sqrt(np.diag(exact.covariance))
        np.testing.assert_allclose(np.sqrt(np.diag(written.covariance)), sigma, rtol=1e-2)
        assert np.all(np.abs(written.values - exact.values) < 0.1 * sigma)
    for notes in (of_written.notes, told_written.notes):
        (said,) = [note for note in notes if note.startswith("Left as described")]
        assert "mx.l1" in said
    assert not any(note.startswith("Left as") for note in of_exact.notes)


def test_an_axis_that_truly_leans_is_no_rounding() -> None:
    """By 3 mrad it does: gravity turns the first link, and nothing is left out."""
    leaning, upright = structural_base(arm("1.5738")), structural_base(arm(EXACT))
    assert leaning.rank == upright.rank + 2
    assert leaning.nearly_hidden == ()


@pytest.mark.slow
def test_one_number_decides_for_structure_fit_and_diagnosis() -> None:
    fitted, told = fitted_and_told(EXACT)
    tolerances = {fitted.model.base.tolerance, fitted.basis.tolerance, told.after.basis.tolerance}
    assert len(tolerances) == 1
