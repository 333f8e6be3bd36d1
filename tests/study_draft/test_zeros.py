"""Zeros of joints a quarter turn off: found by fits, or by the bodies as they are described."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot
from dynident.study_draft.guesses.file_reading import Reading
from dynident.study_draft.guesses.zeros import ZerosGuess, guess_zeros
from dynident.wiring.regressions.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows
from synthetic import smooth_motion

TX40 = Path(__file__).parents[2] / "problems" / "staubli_tx40" / "tx40.urdf"


def fitted(robot: Robot, rows: WiringRows) -> TorqueFit:
    return WiringRegression.of(Model(robot), rows).fit(np.arange(robot.n), np.ones(robot.n))


def guessed(quarters: tuple[int, ...], seed: int) -> ZerosGuess:
    """Bodies that are not quite as described, friction, and a ripple that no model has."""
    described = Robot.from_file(TX40)
    rng = np.random.default_rng(seed)
    theta = described.theta.reshape(described.n, -1).copy()
    theta *= np.exp(0.3 * rng.standard_normal((described.n, 1)))
    theta[:, 1:4] += 0.02 * theta[:, :1] * rng.standard_normal((described.n, 3))
    true = described.with_theta(theta.ravel())
    t, q, v, a = smooth_motion(described.n, seed, 100.0, 8.0, 8.0)
    tau = true.inverse_dynamics(q, v, a)
    size = tau.std(axis=0)
    tau = tau + size * (0.4 * np.tanh(v / 0.05) + 0.1 * np.sin(7 * q) + 0.1 * np.sin(3 * v))
    off = np.pi / 2 * np.array(quarters)
    one = Recording(t, q - off, tau, described.names)
    rows = Reading(robot=described, columns={}).rows((one,))
    assert rows is not None
    return guess_zeros(described, rows, fitted)


@pytest.mark.parametrize("quarters", [(0, -1, 1, 0, 0, 0), (0, 0, 1, 0, 0, 0), (0, 0, 0, 0, 1, 0)])
def test_zeros_of_one_joint_and_of_a_folded_arm_are_found(quarters: tuple[int, ...]) -> None:
    assert guessed(quarters, 1).quarters == quarters


@pytest.mark.parametrize("seed", range(4))
def test_bodies_that_are_not_as_described_move_no_zero(seed: int) -> None:
    assert guessed((0,) * 6, seed).quarters == (0,) * 6
