"""Designs from a description that is 20 % wrong, and against rivals whose shape is not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.effects import effects_of
from dynident.errors import DesignError
from dynident.experiment_design import DesignTask, MotionLimits, design
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.design_question import DesignQuestion, RecordedFits
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, true_values

ROBOT = arm()
WRONG = ROBOT.with_theta(np.repeat([1.2, 0.8], 10) * ROBOT.theta)
(OFFSET,), (TILT,) = (effects_of(one, ROBOT) for one in ("torque_offset@shoulder", "base_tilt"))
(DRAG,), (STRIBECK,) = (
    effects_of(one, ROBOT) for one in ("quadratic_drag@elbow", "stribeck_friction@elbow")
)


def small_motion(model: Model, values: np.ndarray) -> Dataset:
    """Four seconds, of a hundredth of a radian."""
    t, w = np.arange(400) / 100.0, np.array([2.0, 3.0])
    q, v = 0.01 * np.sin(np.outer(t, w)), 0.01 * w * np.cos(np.outer(t, w))
    torque = model.torque(model.block(t, q, v, -(w**2) * q), values)
    torque = torque + 0.05 * np.random.default_rng(0).normal(size=torque.shape)
    return Dataset((Recording(t, q, torque, ROBOT.names),))


def phi(program, information, variables: np.ndarray) -> float:
    return float(information.about(program.told(information, variables))[0, 0])


@pytest.mark.slow
def test_a_description_that_is_wrong_costs_little() -> None:
    truth = Model(ROBOT) + OFFSET
    data = small_motion(truth, true_values(truth, **{"offset__shoulder": 2.0}))
    task = DesignTask(duration=6.0, repeat=1, harmonics=4, tell=((OFFSET, TILT),), starts=1)
    found = design(Model(WRONG), data, task)
    program, bare = found.program, Model(ROBOT)
    columns = ColumnFunction.of(bare, bare.given_values(), (TILT, OFFSET.on(ROBOT)))
    true = replace(program.information, columns=columns)
    knowing = replace(program, informations=(true,)).solved(1, 0)
    ours = phi(program, true, found.motion.variables)
    assert ours > 0.9 * phi(program, true, knowing.variables)
    assert found.separations[0].designed == pytest.approx(np.sqrt(ours), rel=0.2)


def test_a_rival_whose_shape_is_not_known_has_several_columns() -> None:
    truth = Model(ROBOT) + DRAG
    data = small_motion(truth, true_values(truth, **{"Fq__elbow": 1.0}))
    task = DesignTask(duration=6.0, harmonics=4, tell=((DRAG, STRIBECK),))
    motions = FourierMotions(limits=MotionLimits.of(ROBOT), period=6.0, harmonics=4)
    question = DesignQuestion.of(Model(ROBOT), RecordedFits(data), task, motions, task.tell[0])
    asked = question.asked(data, motions).information
    name = STRIBECK.parameter_name(STRIBECK.parameters(ROBOT)[0].name)
    shapes = [k for k, one in enumerate(asked.columns.labels) if one == name]
    assert len(shapes) > 2
    # Other shapes imitate what one alone does not.
    t = motions.times(200)
    whole = asked.matrix(t, motions.trajectory(motions.random(1) * 0.3).at(t))
    kept = np.delete(np.arange(len(whole)), shapes[1:])
    one = replace(
        asked,
        mix=asked.mix[:, kept],
        prior=asked.prior[np.ix_(kept, kept)],
        scale=asked.scale[kept],
    )
    few = one.about(whole[np.ix_(kept, kept)])[0, 0]
    assert 0 < asked.about(whole)[0, 0] < 0.999 * few


@pytest.mark.parametrize(
    ("upper_arm", "torque", "remedy"),
    [(0.0, 0.9, "widen them"), (1.5, 1.3, "add recordings that tell more of it")],
)
def test_limits_refused_for_what_is_not_known_say_so(upper_arm, torque, remedy) -> None:
    """Stretched out the recordings know what it weighs; upright, the description alone does."""
    model, pose = Model(ROBOT), np.array([upper_arm, 0.0])
    still = np.zeros((1, 2))
    rest = np.abs(ROBOT.inverse_dynamics(pose[None], still, still))[0]
    limits = MotionLimits.of(ROBOT)
    tight = replace(limits, lower=pose - 0.05, upper=pose + 0.05, torque=torque * rest + 0.02)
    task = DesignTask(duration=4.0, repeat=1, harmonics=3, starts=1)
    with pytest.raises(DesignError, match=remedy):
        design(model, small_motion(model, true_values(model)), task, limits=tight)
