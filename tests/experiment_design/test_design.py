"""Designed recordings: limits hold, columns are the model's, more is told than by chance."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chains import chain
from dynident.effects import Law, effects_of, law_effect
from dynident.errors import DesignError
from dynident.experiment_design import (
    DesignTask,
    MotionLimits,
    design,
    design_question,
    motion_program,
)
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.columns.predicted_torque import PredictedTorque
from dynident.experiment_design.information import Information, LossAlong, Objective
from dynident.experiment_design.motion_program import FINER, MotionProgram, instants_of
from dynident.experiment_design.motion_solver import MotionSolver
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.experiment_design.telling.separation import DECIDES
from dynident.fitting.fit_model import fit
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from synthetic import ARM, arm, synthetic, true_values

ROBOT = arm()
MODEL = Model(ROBOT) + "viscous_friction" + "coulomb_friction"
SPRING = "joint_spring@elbow"
EVERY_INSTANT = (
    "viscous_friction@elbow",
    "coulomb_friction@shoulder",
    "stribeck_friction@elbow",
    "joint_spring@elbow",
    "torque_ripple@elbow",
    "quadratic_drag@elbow",
    "drive_gain@elbow",
    "load_friction@elbow",
    "joint_zero@shoulder",
    "base_tilt",
    "rotor_inertia@elbow",
    "joint_coupling@elbow:shoulder",
)


def recorded(model: Model = MODEL, **effects: float) -> Dataset:
    values = true_values(model, **effects)
    return Dataset((synthetic(model, values, 1, torque_std=0.05),))


def motions(harmonics: int = 5) -> FourierMotions:
    limits = MotionLimits.of(ROBOT)
    return FourierMotions(limits=limits, period=10.0, harmonics=harmonics)


@pytest.mark.parametrize("harmonics", [2, 5, 12])
def test_motions_begin_and_end_at_rest(harmonics: int) -> None:
    some = motions(harmonics)
    variables = some.random(3)
    q, v, a = some.trajectory(variables).at(np.array([0.0, 10.0, 20.0]))
    assert np.ptp(q, axis=0).max() < 1e-12
    assert np.abs(v).max() < 1e-12 and np.abs(a).max() < 1e-10
    t = some.times(300)
    motion = some.trajectory(variables)
    for basis, found in zip(some.bases(t)[:3], motion.at(t), strict=True):
        linear = some.limits.speed * (basis @ variables.T)
        found = found - (some.centre(variables) if basis is some.bases(t)[0] else 0.0)
        moved = found - found[0] + linear[0]
        np.testing.assert_allclose(moved, linear, atol=1e-10)
    later, earlier = (motion.at(t + step)[2] for step in (1e-5, -1e-5))
    np.testing.assert_allclose(some.jerk(variables, t), (later - earlier) / 2e-5, rtol=1e-5)


@pytest.mark.parametrize("label", EVERY_INSTANT)
def test_columns_are_those_of_the_model(label: str) -> None:
    base = Model(ROBOT)
    values = true_values(MODEL)[: base.size]
    (effect,) = effects_of(label, ROBOT)
    columns = ColumnFunction.of(base, values, (effect,))
    q, v, a = ROBOT.random_motion(4, 30)
    t = np.linspace(0, 3, 30)
    block = base.block(t, q, v, a)
    expected = np.concatenate(
        [base.columns(block), effect.columns(base.ready(effect, block, values))], axis=2
    )
    scale = np.abs(expected).max()
    np.testing.assert_allclose(columns.along(t, q, v, a), expected, atol=2e-7 * scale)
    torque = columns.torque_along(t, q, v, a)
    np.testing.assert_allclose(torque, base.torque(block, values), atol=1e-9 * scale)


def test_the_loss_of_a_search_is_the_loss_and_has_its_slopes() -> None:
    columns = ColumnFunction.of(MODEL, true_values(MODEL))
    count, some = columns.count, motions()
    rng = np.random.default_rng(0)
    prior = np.diag(rng.uniform(0.1, 2.0, count))
    asked: list[tuple[Objective, int]] = [("D", count), ("D", 3), ("A", 4)]
    for objective, last in asked:
        information = Information(
            columns=columns,
            mix=np.eye(count),
            last=last,
            weight=np.array([2.0, 5.0]),
            prior=prior,
            scale=rng.uniform(0.5, 2.0, count),
            objective=objective,
        )
        t = some.times(40)
        q, v, a = some.trajectory(some.random(1) * 0.2).at(t)
        inputs = np.hstack([q, v, a, t[:, None]])
        along = LossAlong(information, len(t))
        loss, slopes = along(inputs)
        assert loss == pytest.approx(information.loss(information.matrix(t, (q, v, a))), rel=1e-6)
        for _ in range(5):
            way = rng.standard_normal(inputs.shape)
            ahead, behind = (along(inputs + step * way)[0] for step in (1e-5, -1e-5))
            assert (ahead - behind) / 2e-5 == pytest.approx(float(np.sum(slopes * way)), rel=1e-4)


def test_what_nothing_shows_leaves_the_loss_of_a_search_finite() -> None:
    columns = ColumnFunction.of(MODEL, true_values(MODEL))
    count = columns.count
    information = Information(
        columns=columns,
        mix=np.eye(count),
        last=count,
        weight=np.ones(2),
        prior=np.zeros((count, count)),
        scale=np.ones(count),
    )
    loss, slopes = LossAlong(information, 2)(np.full((2, 7), 0.1))  # fewer rows than columns
    assert np.isfinite(loss) and np.all(np.isfinite(slopes))


@pytest.mark.parametrize(("position", "known"), [(np.nan, 0.0), (1e80, 0.0), (0.3, -1e3)])
def test_the_loss_of_no_information_is_no_number(position: float, known: float) -> None:
    columns = ColumnFunction.of(MODEL, true_values(MODEL))
    count = columns.count
    information = Information(
        columns=columns,
        mix=np.eye(count),
        last=1,
        weight=np.ones(2),
        prior=known * np.eye(count),
        scale=np.ones(count),
    )
    loss, slopes = LossAlong(information, 5)(np.full((5, 7), position))
    assert np.isnan(loss) and np.all(np.isnan(slopes))


def test_predicted_sigma_is_that_of_the_regression() -> None:
    task = DesignTask(duration=8.0, repeat=2, harmonics=4, starts=1)
    found = design(MODEL, recorded(), task)
    program = found.program
    nothing = replace(program.information, prior=np.zeros_like(program.information.prior))
    t = program.motions.times(FINER * program.instants)
    motion = found.trajectory.at(t)
    weight = np.sqrt(nothing.weight / len(t))[None, :, None]
    columns = MODEL.columns(MODEL.block(t, *motion)) * weight
    rows = columns.reshape(-1, MODEL.size)
    expected = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    alone = replace(found, program=replace(program, informations=(nothing,)))
    np.testing.assert_allclose(alone.sigma(found.motion.variables), expected, rtol=1e-3)


@pytest.mark.slow
def test_it_tells_more_than_many_random_motions_within_the_limits() -> None:
    task = DesignTask(duration=10.0, repeat=1, harmonics=5, starts=2)
    found = design(MODEL, recorded(), task)
    program = found.program
    some = (program.within(program.motions.random(500 + k)) for k in range(200))
    losses = [program.loss(one) for one in some if one is not None]
    assert found.motion.loss < min(losses)
    count = program.information.last
    # Geometric mean of the standard deviations against the best and the median of them.
    assert np.exp((found.motion.loss - min(losses)) / (2 * count)) < 0.9
    assert np.exp((found.motion.loss - np.median(losses)) / (2 * count)) < 0.8


@pytest.mark.parametrize(
    ("pair", "times"),
    [
        (("torque_offset@shoulder", "base_tilt"), 1.5),
        (("joint_zero@shoulder", "joint_spring@shoulder"), 1.2),
        (("stribeck_friction@elbow", "viscous_friction@elbow"), 1.2),
    ],
)
@pytest.mark.slow
def test_pairs_are_told_apart_better_than_by_any_of_many_motions(pair, times: float) -> None:
    base = Model(ROBOT) + "coulomb_friction"
    (first,), (second,) = (effects_of(label, ROBOT) for label in pair)
    truth = base + first
    data = recorded(truth, Fc__elbow=1.0, **{truth.names[-1].replace("@", "__"): 0.1})
    task = DesignTask(duration=8.0, repeat=1, harmonics=5, tell=((first, second),), starts=1)
    found = design(base, data, task)
    (one,), program = found.separations, found.program
    nothing = program.information

    def phi(variables: np.ndarray) -> float:
        return float(nothing.about(program.told(nothing, variables))[0, 0])

    some = (program.within(program.motions.random(900 + k)) for k in range(100))
    best = max(phi(each) for each in some if each is not None)
    assert phi(found.motion.variables) > 1.1 * best
    assert one.worth > times
    assert one.designed > one.recorded
    # So many times a usual motion separate as far; so many times the designed one decide.
    usual, ours = (program.told(nothing, x) for x in (found.usual, found.motion.variables))
    for times_, matrix, wanted in ((one.worth, usual, one.designed), (one.enough, ours, DECIDES)):
        if 0 < times_ < 1000:
            reached = np.sqrt(nothing.about(times_ * matrix)[0, 0])
            assert reached == pytest.approx(wanted, rel=1e-6)
    assert "standard deviations" in found.sentence


@pytest.mark.slow
def test_of_several_pairs_the_one_told_least_counts() -> None:
    base = Model(ROBOT) + "viscous_friction" + "coulomb_friction"
    labels = (
        ("torque_offset@shoulder", "base_tilt"),
        ("quadratic_drag@elbow", "joint_spring@elbow"),
    )
    pairs = tuple(tuple(effects_of(one, ROBOT)[0] for one in pair) for pair in labels)
    data = recorded(base + pairs[0][0] + pairs[1][0])
    whole = base + pairs[0][0] + pairs[1][0]
    task = DesignTask(duration=6.0, repeat=1, harmonics=4, tell=pairs)
    both = design(whole, data, task)
    assert [one.first for one in both.separations] == [first.title for first, _ in pairs]
    program = both.program

    def told(variables: np.ndarray) -> list[float]:
        return [
            float(one.about(program.told(one, variables))[0, 0]) for one in program.informations
        ]

    def least(variables: np.ndarray) -> float:
        return min(told(variables))

    reached = least(both.motion.variables)
    some = (program.within(program.motions.random(900 + k)) for k in range(100))
    assert reached > max(least(one) for one in some if one is not None)
    found = [one.designed for one in both.separations]
    assert min(found) == pytest.approx(np.sqrt(reached))
    logarithms = np.log(told(both.motion.variables))
    assert -both.motion.loss == pytest.approx(logarithms.min() + 0.2 * logarithms.mean(), rel=1e-3)
    assert both.sentence.count("standard deviations") >= 2


@pytest.mark.slow
def test_a_pair_that_nothing_tells_hides_no_other() -> None:
    """From as many begins as a design has: of few the best may end in a worse motion."""
    law = law_effect(Law(name="again", torque="c*v"))("elbow").on(ROBOT)
    (viscous,), (drag,), (spring,) = (
        effects_of(one, ROBOT) for one in ("viscous_friction@elbow", "quadratic_drag@elbow", SPRING)
    )
    model = Model(ROBOT) + "coulomb_friction" + viscous + drag
    task = DesignTask(starts=1, harmonics=3, tell=((viscous, law), (drag, spring)))
    found = design(model, recorded(model, Fv__elbow=0.3, Fq__elbow=0.05), task)
    hopeless, told = found.separations
    assert hopeless.designed < 1e-3 < 1.0 < told.designed
    assert "No motion within the limits" in found.sentence


@pytest.mark.slow
def test_several_effects_are_shown_together() -> None:
    effects = tuple(effects_of(one, ROBOT)[0] for one in ("torque_offset@shoulder", "base_tilt"))
    found = design(MODEL, recorded(), DesignTask(show=effects, starts=1, harmonics=4))
    together, before = found.sigma(found.motion.variables), found.sigma(None)
    # The arm is plane: of the two tilts of its base one moves no load.
    assert found.labels[-len(before) :] == ("offset@shoulder", "base_tilt.ry")
    assert np.all(together < before)


@pytest.mark.slow
def test_parameters_of_a_joint_alone_are_told_better_than_beside_all_others() -> None:
    task = DesignTask(repeat=1, harmonics=3, starts=1)
    every = design(MODEL, recorded(), task)
    found = design(MODEL, recorded(), replace(task, joints=("elbow",)))
    own = [name for name in every.labels if name.endswith(("@elbow", ".fore"))]
    last = len(own)
    assert 0 < last < len(every.labels) and set(found.labels[-last:]) == set(own)
    assert "standard deviations of the parameters of elbow are" in found.sentence
    sigma = dict(zip(every.labels, every.sigma(every.motion.variables), strict=True))
    beside = dict(zip(found.labels[-last:], found.sigma(every.motion.variables), strict=True))
    np.testing.assert_allclose([beside[one] for one in own], [sigma[one] for one in own], rtol=1e-6)
    # The volume of their confidence region, all others estimated too.
    assert found.motion.loss < found.program.loss(every.motion.variables, FINER) - 0.1


def test_joints_that_are_misspelt_are_refused_by_name() -> None:
    with pytest.raises(DesignError, match=r"no joint 'elbov'.*did you mean 'elbow'"):
        design(MODEL, recorded(), DesignTask(joints=("elbov",)))


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=pytest.mark.slow if k > 1 else ()) for k in range(12)]
)
def test_no_limit_is_exceeded_on_a_fine_grid(seed: int) -> None:
    robot = chain(1 + seed % 4, seed)
    rng = np.random.default_rng(seed)
    plain = MotionLimits.of(robot)
    limits = replace(
        plain,
        speed=plain.speed * rng.uniform(0.2, 1.0, robot.n),
        acceleration=plain.acceleration * rng.uniform(0.2, 1.0, robot.n),
        torque=np.full(robot.n, np.inf),
        jerk=np.where(rng.random(robot.n) < 0.5, 3.0 * plain.acceleration, np.inf),
    )
    model = Model(robot)
    values = model.given_values()
    data = Dataset((synthetic(model, values, seed, torque_std=0.01),))
    task = DesignTask(duration=6.0, repeat=1, harmonics=4, starts=1)
    found = design(model, data, task, limits=limits)
    some = found.program.motions
    t = np.linspace(0, 6.0, 10 * FINER * instants_of(some))
    q, v, a = found.trajectory.at(t)
    small = 1e-9
    span = limits.upper - limits.lower
    assert np.all(q >= limits.lower - small * span) and np.all(q <= limits.upper + small * span)
    assert np.all(np.abs(v) <= (1 + small) * limits.speed)
    assert np.all(np.abs(a) <= (1 + small) * limits.acceleration)
    jerk = np.diff(a, axis=0) / np.diff(t)[:, None]  # a mean, between two instants
    assert np.all(np.abs(jerk) <= (1 + 1e-6) * limits.jerk)


@pytest.mark.parametrize("kind", [{"harmonics": 4}, {"intervals": 8}])
@pytest.mark.slow
def test_a_limit_of_jerk_is_used_and_kept(kind: dict[str, Any], tmp_path: Path) -> None:
    limits = tmp_path / "limits.toml"
    limits.write_text("[joints.shoulder]\njerk = 12.0\n")
    task = DesignTask(duration=6.0, repeat=1, starts=1, **kind)
    free, held = (
        design(MODEL, recorded(), task, limits=some)
        for some in (None, MotionLimits.from_file(limits, ROBOT))
    )
    t = np.linspace(0, 6.0, 60_000)
    jerks = [
        np.abs(np.diff(one.trajectory.at(t)[2], axis=0) / np.diff(t)[:, None])
        for one in (free, held)
    ]
    assert jerks[0].max(axis=0)[0] > 15.0
    assert 11.0 < jerks[1].max(axis=0)[0] <= 12.0
    assert "jerk" in str(held.limit_table()) and "jerk" not in str(free.limit_table())


def test_torque_limits_hold() -> None:
    plain = MotionLimits.of(ROBOT)
    limits = replace(plain, torque=np.array([45.0, 12.0]))
    task = DesignTask(duration=8.0, repeat=1, harmonics=4, starts=1)
    found = design(MODEL, recorded(), task, limits=limits)
    t = np.linspace(0, 8.0, 20_000)
    torque = found.program.torque.along(t, *found.trajectory.at(t))
    assert np.all(np.abs(torque).max(axis=0) <= limits.torque)
    assert np.abs(torque).max() > 10.0


def test_torques_that_turn_out_too_large_are_limited_then(monkeypatch) -> None:
    """And little is lost by making the motion smaller, which is all that is left without that."""
    plain = replace(MotionLimits.of(ROBOT), torque=np.full(2, np.inf))
    free = design(MODEL, recorded(), DesignTask(starts=1, harmonics=2), limits=plain)
    t = free.program.motions.times(2000)
    most = np.abs(free.program.torque.along(t, *free.trajectory.at(t))).max(axis=0)
    limits = replace(plain, torque=np.array([np.inf, 0.8 * most[1]]))
    program = replace(free.program, motions=replace(free.program.motions, limits=limits))
    start = program.within(free.motion.variables)
    assert start is not None
    (ended,) = program.ends(program.solver(), start)
    torque = program.torque.along(t, *program.motions.trajectory(ended.variables).at(t))
    assert np.all(np.abs(torque).max(axis=0) <= limits.torque)
    assert ended.settled and ended.iterations > 0
    monkeypatch.setattr(MotionSolver, "limiting", lambda solver, *_: solver)
    # Of the motion without limits, at an optimum, what is made smaller is at none.
    assert free.motion.settled
    (whole,), (part,) = (one._within(free.motion) for one in (free.program, program))
    assert whole.settled and not part.settled
    smaller = program.ends(program.solver(), start)
    worse = min([program.loss(start), *(one.loss for one in smaller)])
    assert ended.loss < worse - 0.1


def test_limits_that_a_search_begins_without_come_in_where_they_are_exceeded(monkeypatch) -> None:
    whole = design(MODEL, recorded(), DesignTask(starts=1, harmonics=4))
    monkeypatch.setattr(motion_program, "_MANY", 0)
    program, start = whole.program, whole.usual
    solver = program.solver()
    assert not solver.imposed.all() and solver.imposed.any()
    (ended,) = program.ends(solver, start)
    assert program.excess(ended.variables, program.motions.times(2000)) <= 1.0
    monkeypatch.setattr(MotionSolver, "imposing", lambda solver, _: solver)
    (shrunk,) = program.ends(solver, start)
    assert ended.loss < shrunk.loss - 0.5
    assert ended.loss < whole.motion.loss + 1.0


@pytest.mark.slow
def test_loads_share_the_fit_of_what_was_recorded(recorded_fits: list[Model]) -> None:
    design(MODEL, recorded(), DesignTask(starts=1, harmonics=2, loads=(0.0, 1.0)))
    assert len(recorded_fits) == 1


@pytest.fixture
def recorded_fits(monkeypatch) -> list[Model]:
    """Models that are fitted for a design."""
    found: list[Model] = []

    def noted(model: Model, data: Dataset):
        found.append(model)
        return fit(model, data)

    monkeypatch.setattr(design_question, "fit", noted)
    return found


def test_the_next_recording_complements_those_so_far() -> None:
    """What is known already counts: without it the sigmas are larger."""
    task = DesignTask(duration=8.0, repeat=1, harmonics=3, starts=1)
    found = design(MODEL, recorded(), task)
    so_far, together = found.sigma(None), found.sigma(found.motion.variables)
    assert np.all(together < so_far)


@pytest.mark.parametrize(
    ("task", "says"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": float("nan")}, "duration"),
        ({"duration": 1e9}, "duration"),
        ({"harmonics": 1}, "at rest"),
        ({"repeat": 0}, "repeat"),
        ({"starts": 0}, "starts"),
    ],
)
def test_impossible_tasks_are_refused(task, says: str) -> None:
    with pytest.raises(DesignError, match=says):
        design(MODEL, recorded(), DesignTask(**task))


def test_effects_of_the_past_are_refused_by_name() -> None:
    (first,) = effects_of("backlash@elbow", ROBOT)
    with pytest.raises(DesignError, match="backlash@elbow"):
        design(MODEL, recorded(), DesignTask(show=(first,)))


@pytest.mark.slow
def test_limits_without_a_motion_are_refused() -> None:
    limits = replace(MotionLimits.of(ROBOT), torque=np.array([1e-3, 1e-3]))
    with pytest.raises(DesignError, match="within the limits"):
        design(MODEL, recorded(), DesignTask(starts=1, harmonics=2), limits=limits)


def test_limits_by_file(tmp_path) -> None:
    path = tmp_path / "limits.toml"
    path.write_text("[joints.elbow]\nlower = -0.5\nupper = 0.25\ntorque = 9.0\n")
    limits = MotionLimits.from_file(path, ROBOT)
    assert (limits.lower[1], limits.upper[1], limits.torque[1]) == (-0.5, 0.25, 9.0)
    path.write_text("[joints.elbw]\nlower = -0.5\n")
    with pytest.raises(DesignError, match="did you mean 'elbow'"):
        MotionLimits.from_file(path, ROBOT)
    path.write_text("[joints.elbow]\nlower = 2.0\nupper = 1.0\n")
    with pytest.raises(DesignError, match="lower below upper"):
        MotionLimits.from_file(path, ROBOT)


@pytest.mark.slow
def test_what_no_motion_tells_is_infinite_and_named() -> None:
    """Beside viscous friction the law c v has no sigma; rivals that are the same are not told."""
    law = law_effect(Law(name="again", torque="c*v"))("elbow").on(ROBOT)
    with pytest.raises(DesignError, match="cannot be told from the model"):
        design(MODEL, recorded(), DesignTask(show=(law,), starts=1, harmonics=3))
    (viscous,) = effects_of("viscous_friction@elbow", ROBOT)
    base = Model(ROBOT) + "coulomb_friction"
    task = DesignTask(tell=((viscous, law),), starts=1, harmonics=3)
    found = design(base, recorded(base + viscous), task)
    assert found.separations[0].designed < 1e-3
    assert "No motion within the limits" in found.sentence
    assert "usual motion" not in found.sentence
    with pytest.raises(DesignError, match="from itself"):
        DesignTask(tell=((viscous, viscous),))


def test_torques_that_are_no_numbers_are_within_no_limit() -> None:
    root = law_effect(Law(name="root", torque="c*sqrt(q + 2.0)"))("elbow").on(ROBOT)
    model = Model(ROBOT) + root
    columns = ColumnFunction.of(model, np.append(Model(ROBOT).given_values(), 0.5))
    some = motions()
    information = Information(
        columns=columns,
        mix=np.eye(columns.count),
        last=columns.count,
        weight=np.ones(2),
        prior=np.eye(columns.count),
        scale=np.ones(columns.count),
    )
    known = PredictedTorque(
        model=model,
        columns=columns,
        values=np.zeros(columns.count),
        factor=1e-3 * np.eye(columns.count),
    )
    program = MotionProgram(informations=(information,), motions=some, torque=known)
    variables = some.random(0) * 5.0
    assert program.excess(variables, some.times(500)) == np.inf
    found = program.within(variables)
    assert found is None or program.excess(found, some.times(5000)) <= 1.0


@pytest.mark.parametrize("label", ["torque_drift@elbow", "thermal_friction@elbow"])
def test_effects_of_the_hour_are_refused_by_name(label: str) -> None:
    (effect,) = effects_of(label, ROBOT)
    with pytest.raises(DesignError, match=label):
        design(MODEL, recorded(), DesignTask(show=(effect,), starts=1))


def test_ranges_with_one_end_or_none() -> None:
    given = 'lower="-2.5" upper="2.5" velocity="6" effort="200"'
    text = ARM.replace(given, 'lower="0.2" upper="1e20" velocity="0" effort="0"')
    limits = MotionLimits.of(Robot.from_text(text))
    assert 0.2 < limits.lower[0] < limits.upper[0] < 1.2
    assert limits.torque[0] == np.inf


@pytest.fixture
def interrupts() -> Iterator[None]:
    """Ctrl-C raises, as it does at a terminal; what runs in the background may ignore it."""
    seen = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, seen)


@pytest.mark.slow
def test_ctrl_c_arrives_whenever_it_is_pressed(interrupts: None) -> None:
    """Within CasADi it is another error, or none. From begin to end of a design."""
    data, task = recorded(), DesignTask(duration=4.0, starts=1, harmonics=2)
    design(MODEL, data, task)  # the first one makes what the others find
    began = time.perf_counter()
    design(MODEL, data, task)
    for delay in np.linspace(0.02, 1.0, 20) * (time.perf_counter() - began):
        timer = threading.Timer(delay, os.kill, (os.getpid(), signal.SIGINT))
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            for _ in range(5):
                design(MODEL, data, task)
            timer.join()
