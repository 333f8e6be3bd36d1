"""The search that SLSQP is given: its rows are the limits, and its slopes are those of its rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import OptimizeResult, minimize

from chains import chain_text
from dynident.experiment_design import MotionLimits
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.geometry.workspace import RoomCut
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_solver import (
    DesignedMotion,
    MotionSolver,
    _Program,
)
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.experiment_design.motions.limited_motions import torque_shares
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.experiment_design.motions.spline_motions import SplineMotions
from dynident.model import Model
from dynident.robot import Robot
from synthetic import true_values

ROBOT = Robot.from_text("prismatic".join(chain_text(3).rsplit("revolute", 1)))
"""Three joints, the last of which slides."""
MODEL = Model(ROBOT) + "viscous_friction"
COLUMNS = ColumnFunction.of(MODEL, true_values(MODEL))
LIMITS = replace(MotionLimits.of(ROBOT), jerk=np.array([np.inf, 30.0, np.inf]))
FAMILIES: tuple[MotionFamily, ...] = (
    FourierMotions(limits=LIMITS, period=4.0, harmonics=3),
    SplineMotions(limits=LIMITS, period=4.0, intervals=8),
)
CUTS = [RoomCut(1.3, np.array([0.2, -0.5, 0.1]), -0.4)]
PEAKS = [(0.5, 1), (0.5, 2), (3.1, 0)]
MOST = np.array([3.0, 20.0, np.inf])
"""N m, N m, N."""

all_families = pytest.mark.parametrize("family", FAMILIES, ids=lambda one: type(one).__name__)


def information(last: int) -> Information:
    return Information(
        columns=COLUMNS,
        mix=np.eye(COLUMNS.count),
        last=last,
        weight=np.array([2.0, 5.0, 1.0]),
        prior=np.eye(COLUMNS.count),
        scale=np.ones(COLUMNS.count),
    )


def solver_of(
    family: MotionFamily, asked: int = 1, instants: tuple[int, int, int] = (25, 12, 1)
) -> MotionSolver:
    every = tuple(information(k + 1) for k in range(asked))
    return MotionSolver.of(family, every, instants, 60, torque_shares(COLUMNS.torque, MOST))


def differences(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Slopes of a function of variables, (r, u)."""
    ways = 1e-6 * np.eye(at.size).reshape(-1, *at.shape)
    return np.column_stack([(function(at + way) - function(at - way)) / 2e-6 for way in ways])


@all_families
def test_slopes_are_those_of_the_values(family: MotionFamily) -> None:
    room = np.linspace(0.6, 0.9, family.n)
    solver, x = solver_of(family, 3).limiting(PEAKS, room), 0.2 * family.random(5)
    assert solver.torque is not None
    for rows in (solver.found_losses, solver.torque.rows):
        plain = differences(lambda at, rows=rows: rows(at).values, x)
        np.testing.assert_allclose(rows(x).slopes, plain, atol=1e-6 * np.abs(plain).max())


@all_families
@pytest.mark.parametrize("asked", [1, 3])
def test_what_slsqp_is_given_has_the_slopes_of_its_values(family: MotionFamily, asked: int) -> None:
    solver, start = solver_of(family, asked).limiting(PEAKS), 0.2 * family.random(5)
    program = _Program(solver, start)
    x = np.append(start.ravel(), [0.3] * program.several)
    _, slopes = program.objective(x)
    plain = differences(lambda at: np.array([program.objective(at)[0]]), x)
    np.testing.assert_allclose(slopes, plain[0], atol=1e-6 * np.abs(plain).max())
    plain = differences(program.left, x)
    np.testing.assert_allclose(program.slopes_left(x), plain, atol=1e-6 * np.abs(plain).max())


@all_families
def test_rows_leave_what_the_limits_leave(family: MotionFamily) -> None:
    solver, x, t = solver_of(family), 0.1 * family.random(3), family.times(12)
    q, v, a = family.trajectory(x).at(t)
    half = (LIMITS.upper - LIMITS.lower) / 2
    jerk = family.jerk(x, family.to_the_end(12))[:, 1] / LIMITS.jerk[1]
    shares = [(q - LIMITS.lower) / half - 1.0, v / LIMITS.speed, a / LIMITS.acceleration]
    whole = np.concatenate([*(one.T.ravel() for one in shares), jerk])
    left, found = np.concatenate([1 - whole, 1 + whole]), solver.limits.at(x.ravel())
    # Rows that no variable moves, as of the speed where a motion begins, may be left out.
    left, found = (np.sort(one[np.abs(one - 1.0) > 1e-9]) for one in (left, found))
    np.testing.assert_allclose(found, left, atol=1e-9)


@all_families
def test_limits_may_be_those_of_some_instants_and_of_where_these_turn_out_too_few(
    family: MotionFamily,
) -> None:
    solver = solver_of(family, instants=(25, 14 * family.waves, 3))
    assert solver_of(family).imposed.all()
    x = family.random(3).ravel()
    rows, imposed = solver.limits, np.count_nonzero(solver.imposed)
    assert imposed == pytest.approx(len(rows.values) / 3, rel=0.12)
    assert len(solver.linear.values) == imposed
    # Between them no limit is exceeded by much.
    some = [family.random(seed).ravel() for seed in range(20)]
    least = [rows.at(one / (1.0 - solver.linear.at(one).min())).min() for one in some]
    assert 1.0 - 1.0 / np.cos(3.0 * np.pi / 14.0) < min(least) < -0.01
    x *= 0.99 / (1.0 - rows.at(x).min())
    within = x.reshape(family.n, -1)
    assert solver.imposing(within) is solver
    more = solver.imposing(1.05 * within)
    # With them all those that the motion comes near to.
    assert np.all(more.imposed[rows.at(1.05 * x) < 0.15])
    left = rows.at(1.05 * x)
    assert more.linear.at(1.05 * x).min() == pytest.approx(left.min())
    assert left.min() < 0.0
    # Nothing is left to impose there: it is itself.
    assert more.imposing(1.05 * within) is more


@all_families
def test_cuts_and_limited_torques_are_rows_at_their_instants(family: MotionFamily) -> None:
    x = 0.1 * family.random(3)
    solver = solver_of(family).limiting(PEAKS)
    (cut,), motion = CUTS, family.trajectory(x)
    left = cut.slope @ motion.at(np.array([cut.t]))[0][0] - cut.least
    cutting = solver.cut(CUTS, x)
    assert cutting.linear.at(x.ravel())[-1] == pytest.approx(left, abs=1e-12)
    assert len(cutting.linear.values) == len(solver.linear.values) + 1
    # A bound that a motion within the workspace does not meet is moved to where it does.
    strict = [replace(cut, least=cut.least + left + 0.3)]
    assert solver.cut(strict, x).linear.at(x.ravel())[-1] == pytest.approx(0.0, abs=1e-12)
    assert cutting.cut([], x).cuts is None
    assert solver.torque is not None
    t, joints = (np.array(one) for one in zip(*PEAKS, strict=True))
    share = (COLUMNS.torque_along(t, *motion.at(t)) / MOST)[np.arange(len(t)), joints]
    expected = np.concatenate([1 - share, 1 + share])
    np.testing.assert_allclose(solver.torque.rows(x).values, expected, atol=1e-12)
    assert solver.limiting([]).torque is None


@all_families
@pytest.mark.parametrize("asked", [1, 2])
def test_a_search_ends_lower_and_within_its_rows(family: MotionFamily, asked: int) -> None:
    solver, start = solver_of(family, asked), 0.05 * family.random(4)
    ended = solver.ended(start)
    assert solver.linear.at(ended.variables.ravel()).min() > -1e-6
    before, after = (solver.found_losses(x).values.max() for x in (start, ended.variables))
    assert after < before - 1.0
    torque = COLUMNS.torque_along(t := family.times(12), *family.trajectory(ended.variables).at(t))
    most = 0.8 * np.abs(torque).max(axis=0)
    every = [(float(one), joint) for one in t for joint in range(3)]
    limited = replace(solver, shares=torque_shares(COLUMNS.torque, most)).limiting(every)
    kept = limited.ended(ended.variables)
    assert limited.torque is not None
    assert limited.torque.rows(ended.variables).values.min() < -0.1
    assert limited.torque.rows(kept.variables).values.min() > -1e-3


def test_where_slsqp_fails_it_begins_anew_at_the_best_motion_so_far(monkeypatch) -> None:
    solver, begins = replace(solver_of(FAMILIES[0]), iterations=200), []

    def failing(function, begin, *, options, **given):
        begins.append(np.array(begin))
        if len(begins) > 1:
            return minimize(function, begin, options=options, **given)
        found = minimize(function, begin, options={**options, "maxiter": 2}, **given)
        return OptimizeResult(found, x=np.full_like(begin, np.nan), success=False)

    start = 0.05 * FAMILIES[0].random(4)
    plain = solver.ended(start)
    monkeypatch.setattr("scipy.optimize.minimize", failing)
    ended = solver.ended(start)
    assert len(begins) == 2 and ended.settled
    assert np.all(np.isfinite(ended.variables))
    losses = [
        float(solver.found_losses(x.reshape(start.shape)).values.max())
        for x in (*begins, ended.variables)
    ]
    assert losses == sorted(losses, reverse=True) and losses[1] < losses[0] - 0.5
    assert ended.loss == pytest.approx(plain.loss, abs=0.2)
    assert ended.iterations > 2


def test_a_motion_that_was_made_smaller_is_called_no_optimum() -> None:
    """Whatever the solver said of the larger one."""
    status = "Optimization terminated successfully"
    ended = DesignedMotion(
        variables=np.zeros((1, 2)), loss=0.0, status=status, iterations=7, settled=True
    )
    assert "at a local optimum (SLSQP: " in ended.ended_in_words
    smaller = replace(ended, settled=False).ended_in_words
    assert "short of a local optimum" in smaller and "made smaller" in smaller
