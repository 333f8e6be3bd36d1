"""Base parameters: rank, combinations, and what they are for."""

import csv
import os
import re
from pathlib import Path

import numpy as np
import pytest
from random_trees import random_tree, urdf

from dynident.errors import FitError
from dynident.robot import Robot, base_parameters, structural_base

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("DYNIDENT_DATA") or ROOT.parent / "shared" / "data")


def panda():
    """The chain of modified Denavit-Hartenberg parameters; joint frames are its link frames."""
    a = [0, 0, 0, 0.0825, -0.0825, 0, 0.088]
    alpha = np.deg2rad([0, -90, 90, 90, -90, 90, 90])
    d = [0.333, 0, 0.316, 0, 0.384, 0, 0]
    out = ['<robot name="panda"><link name="0"/>']
    for i in range(7):
        y, z = float(-np.sin(alpha[i]) * d[i]), float(np.cos(alpha[i]) * d[i])
        out.append(
            f'<link name="{i + 1}"/><joint name="joint{i + 1}" type="revolute">'
            f'<parent link="{i}"/><child link="{i + 1}"/>'
            f'<origin xyz="{a[i]} {y!r} {z!r}" rpy="{float(alpha[i])!r} 0 0"/>'
            '<axis xyz="0 0 1"/><limit lower="-2.8" upper="2.8" effort="80" velocity="2"/></joint>'
        )
    return Robot.from_text("".join([*out, "</robot>"]))


def published(robot):
    path = DATA / "panda" / "published_base_parameters.csv"
    if not path.exists():
        pytest.skip(f"no measured data: {path} is absent (set DYNIDENT_DATA)")
    columns = {name.replace(".", ""): k for k, name in enumerate(robot.parameter_names)}
    rows = []
    with path.open() as handle:
        for line in csv.DictReader(handle):
            row = np.zeros(len(columns))
            for term in line["combination"].split(" + "):
                match = re.fullmatch(r"(\S+)\*(\S+)", term)
                assert match
                row[columns[match[2]]] += float(match[1])
            rows.append(row)
    return np.array(rows)


def test_panda_has_43_and_they_are_the_published_ones():
    robot = panda()
    base = structural_base(robot)
    assert base.rank == 43
    assert base.gap > 1e10
    combinations = published(robot)
    assert combinations.shape == (43, 70)
    assert np.linalg.matrix_rank(combinations) == 43
    # Each published row is a combination of ours, exactly: the two row spaces are one.
    scale = np.where(base.scale > 0, base.scale, 1.0)
    ours, theirs = base.combination / scale, combinations / scale
    residual = theirs - theirs @ np.linalg.pinv(ours) @ ours
    norms = np.linalg.norm(theirs, axis=1)
    assert np.max(np.linalg.norm(residual, axis=1) / norms) < 1e-10


@pytest.mark.parametrize("seed", range(6))
def test_base_values_reproduce_the_torque(seed):
    robot = Robot.from_text(urdf(random_tree(seed, moving=4)))
    base = structural_base(robot)
    q, v, a = robot.random_motion(99, 30)
    Y = robot.regressor(q, v, a)
    tau = Y @ robot.theta
    values = base.coordinates(robot.theta)
    np.testing.assert_allclose(base.reduce(Y) @ values, tau, atol=1e-9 * np.max(np.abs(tau)))
    np.testing.assert_allclose(base.combination @ robot.theta, values, atol=1e-12)
    stacked = base.reduce(Y).reshape(-1, base.rank)
    assert np.linalg.matrix_rank(stacked / np.linalg.norm(stacked, axis=0)) == base.rank


@pytest.mark.parametrize("seed", range(4))
def test_lift_meets_the_values_and_is_nearest(seed):
    robot = Robot.from_text(urdf(random_tree(seed)))
    base = structural_base(robot)
    rng = np.random.default_rng(seed)
    values = base.coordinates(robot.theta) + rng.normal(size=base.rank) * 0.1
    theta = base.lift(values, robot.theta)
    np.testing.assert_allclose(base.coordinates(theta), values, atol=1e-13)
    # What is already right stays; what nothing shows stays.
    same = base.lift(base.coordinates(robot.theta), robot.theta)
    np.testing.assert_allclose(same, robot.theta, atol=1e-13)
    hidden = [robot.parameter_names.index(name) for name in base.unidentifiable]
    np.testing.assert_array_equal(theta[hidden], robot.theta[hidden])
    # Nearest: no step along the null space shortens the scaled correction.
    correction = base.scale * (theta - robot.theta)
    for _ in range(20):
        step = rng.normal(size=theta.size)
        null = step - base.lift(base.coordinates(step), np.zeros(theta.size))
        null[hidden] = 0.0
        slope = correction @ (base.scale * null)
        assert abs(slope) < 1e-8 * np.linalg.norm(correction) * np.linalg.norm(base.scale * null)


def test_units_do_not_decide():
    robot = Robot.from_text(urdf(random_tree(0)))
    X = robot.regressor(*robot.random_motion(0, 60)).reshape(-1, 10 * robot.n)
    base = base_parameters(X, robot.parameter_names)
    units = 10.0 ** np.random.default_rng(0).integers(-3, 4, X.shape[1])
    other = base_parameters(X * units, robot.parameter_names)
    assert other.independent == base.independent
    kept, rest = list(base.independent), list(base.dependent)
    np.testing.assert_allclose(other.K * units[kept][:, None] / units[rest], base.K, atol=1e-9)


def test_a_matrix_and_its_r_factor_say_the_same():
    robot = Robot.from_text(urdf(random_tree(2)))
    X = robot.regressor(*robot.random_motion(0, 60)).reshape(-1, 10 * robot.n)
    R = np.linalg.qr(X, mode="r")
    a, b = (base_parameters(M, robot.parameter_names) for M in (X, R))
    assert a.rank == b.rank
    np.testing.assert_allclose(a.combination @ robot.theta, a.coordinates(robot.theta))
    np.testing.assert_allclose(b.scale, a.scale, rtol=1e-10, atol=1e-10)
    null = np.linalg.svd(a.combination)[2][a.rank :]
    assert np.max(np.abs(b.combination @ null.T)) < 1e-9


def test_any_columns_and_their_expressions():
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 50))
    X = np.column_stack([10 * x, 2.5 * x, np.zeros(50), y, 1e-17 * y, -(x + y)])
    base = base_parameters(X, ["a", "b", "none", "c", "rounding", "d"])
    assert base.rank == 2
    assert set(base.unidentifiable) == {"none", "rounding"}
    theta = np.array([1.0, 2.0, np.nan, 3.0, np.nan, 4.0])
    values = base.coordinates(theta)
    known = np.where(np.isnan(theta), 0.0, theta)
    np.testing.assert_allclose(base.reduce(X) @ values, X @ known, atol=1e-12)
    single = base_parameters(X[:, :2], ["Izz.link1", "m.link2"])
    assert single.expressions == ("Izz.link1 + 0.25 m.link2",) or single.expressions == (
        "m.link2 + 4 Izz.link1",
    )


def test_degenerate_regressors():
    nothing = base_parameters(np.zeros((5, 2)), ["a", "b"])
    assert nothing.rank == 0 and nothing.unidentifiable == ("a", "b")
    np.testing.assert_array_equal(nothing.lift(np.zeros(0), [1.0, 2.0]), [1.0, 2.0])
    assert base_parameters(np.ones((1, 2)), ["a", "b"]).rank == 1
    with pytest.raises(FitError, match="column 'b'"):
        base_parameters([[1.0, np.inf]], ["a", "b"])
    with pytest.raises(FitError, match="does not fit 1 parameter names"):
        base_parameters(np.ones((3, 2)), ["a"])
    with pytest.raises(FitError, match="theta has shape"):
        nothing.coordinates([1.0])
