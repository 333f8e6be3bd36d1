"""Loads on the last link: their columns, what a recording tells of them, and which one to carry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.cli import main
from dynident.effects import Law, effects_of, law_effect
from dynident.errors import DesignError
from dynident.experiment_design import DesignTask, MotionLimits, design
from dynident.experiment_design.carried_load import payload_effect, usual_load
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.design_files import write_design
from dynident.experiment_design.telling.imitations import Imitations
from dynident.experiment_design.virtual_recording import record_virtually
from dynident.experiment_design.written_design import read_design
from dynident.fitting import fit
from dynident.inertia import pseudo_inertia
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

ROBOT = arm()
MODEL = Model(ROBOT) + "viscous_friction" + "coulomb_friction"
PAYLOAD = payload_effect(ROBOT)
MASS, NOISE = 1.5, 0.05
SHORT = {"harmonics": 3, "starts": 1, "duration": 6.0, "repeat": 2}
PROBLEM = Path(__file__).resolve().parents[2] / "problems" / "hidden_effect"


def recorded(model: Model = MODEL) -> Dataset:
    return Dataset((synthetic(model, true_values(model), 1, torque_std=NOISE),))


@pytest.mark.parametrize("carries", [False, True])
@pytest.mark.parametrize("label", ["load_friction@elbow", "drive_gain@shoulder"])
def test_columns_with_a_load_are_those_of_the_model(label: str, carries: bool) -> None:
    model = MODEL + PAYLOAD
    values = true_values(model)
    values[model.slices["payload"]] = usual_load(ROBOT, MASS)
    (effect,) = effects_of(label, ROBOT)
    columns = ColumnFunction.of(model, values, (effect,), carries_payload=carries)
    q, v, a = ROBOT.random_motion(4, 30)
    t = np.linspace(0, 3, 30)
    block = model.block(t, q, v, a, carries_payload=carries)
    expected = np.concatenate(
        [model.columns(block, values), effect.columns(model.ready(effect, block, values))], axis=2
    )
    np.testing.assert_allclose(columns.along(t, q, v, a), expected, atol=1e-9)
    np.testing.assert_allclose(
        columns.torque_along(t, q, v, a), model.torque(block, values), atol=1e-9
    )


def test_a_usual_load_is_a_body_at_the_centre_of_the_last_link() -> None:
    load = usual_load(ROBOT, MASS)
    link = np.reshape(ROBOT.theta, (ROBOT.n, 10))[ROBOT.tip]
    assert np.linalg.eigvalsh(pseudo_inertia(load)).min() > 0
    np.testing.assert_allclose(load[1:4] / load[0], link[1:4] / link[0])


@pytest.mark.slow
def test_what_a_recording_is_to_tell_of_a_load_is_what_it_tells() -> None:
    """Least squares of all recordings has the sigma that is predicted."""
    data = recorded()
    found = design(MODEL, data, DesignTask(show=(PAYLOAD,), loads=(MASS,), **SHORT))
    model = MODEL + PAYLOAD
    values = true_values(model)
    values[model.slices["payload"]] = usual_load(ROBOT, MASS)
    rate = data.recordings[0].rate_hz
    t = np.arange(round(found.task.duration * found.task.repeat * rate)) / rate
    q, v, a = found.trajectory.at(t)
    block = model.block(t, q, v, a, carries_payload=True)
    noise = NOISE * np.random.default_rng(5).normal(size=q.shape)
    made = Recording(
        t, q, model.torque(block, values) + noise, ROBOT.names, payload=True, name="made"
    )
    both = Dataset((data.recordings[0].replace(payload=False), made))
    told = fit(model, both)
    names = found.labels[-len(found.sigma(None)) :]
    predicted = dict(zip(names, found.sigma(found.motion.variables), strict=True))
    known = [name for name in names if name in told.names and np.isfinite(predicted[name])]
    known = [name for name in known if told.identified[told.names.index(name)]]
    assert {"mass", "mx"} <= {name.rpartition(".")[2] for name in known}
    for name in known:
        sigma = told.sigma[told.names.index(name)]
        assert 0.75 < sigma / predicted[name] < 1.35, name
    assert "The last link carries 1.5 kg." in found.sentence
    assert not np.isfinite(found.sigma(None)).any()


@pytest.mark.slow
def test_of_several_loads_the_one_that_tells_most_is_carried() -> None:
    friction, dry = (
        effects_of(f"{x}@elbow", ROBOT)[0] for x in ("load_friction", "coulomb_friction")
    )
    true = MODEL - "coulomb_friction@elbow" + friction
    values = true_values(true, mu__elbow=0.1)
    data = Dataset((synthetic(true, values, 1, torque_std=NOISE),))
    loads = (0.0, 3.0, 1000.0)
    limits = MotionLimits.of(ROBOT)
    limits.torque[:] = 120.0, 40.0
    task = DesignTask(tell=((friction, dry),), loads=loads, **SHORT)
    found = design(MODEL - "coulomb_friction@elbow", data, task, limits=limits)
    tried = {one.mass: one for one in found.loads_tried}
    assert tuple(tried) == loads
    assert tried[1000.0].tells is None and "1000 kg on the last link" in tried[1000.0].why
    apart = {mass: one.tells[1] for mass, one in tried.items() if one.tells}
    assert found.task.load == max(apart, key=lambda mass: apart[mass])
    assert apart[found.task.load] > apart[0.0]
    assert "1000" in str(found.load_table())


@pytest.mark.slow
def test_a_pair_that_no_motion_tells_does_not_choose_the_load() -> None:
    labels = "load_friction@elbow", "coulomb_friction@elbow", "viscous_friction@elbow"
    friction, dry, viscous = (effects_of(label, ROBOT)[0] for label in labels)
    same = law_effect(Law(name="same", torque="c*v"))("elbow").on(ROBOT)
    true = MODEL - "coulomb_friction@elbow" + friction
    data = Dataset((synthetic(true, true_values(true, mu__elbow=0.1), 1, torque_std=NOISE),))
    task = DesignTask(tell=((viscous, same), (friction, dry)), loads=(0.0, 3.0), **SHORT)
    found = design(true - "load_friction@elbow", data, task)
    tried = {one.mass: one.tells for one in found.loads_tried}
    assert [one[0] for one in tried.values() if one] == [1, 1]
    assert found.task.load == max(tried, key=lambda mass: tried[mass] or (0, 0.0))
    assert found.tells[1] > 1.0


def test_rivals_imitate_with_the_load_on_board() -> None:
    model = MODEL - "coulomb_friction@elbow" + PAYLOAD
    values = true_values(model)
    values[model.slices["payload"]] = usual_load(ROBOT, 3.0)
    dry, friction = (effects_of(f"{one}_friction@elbow", ROBOT)[0] for one in ("coulomb", "load"))
    q, v, a = ROBOT.random_motion(4, 200)
    t = np.linspace(0, 3, 200)
    for carries in (False, True):
        rivals = Imitations(
            model=model,
            values=values,
            columns=ColumnFunction.of(model, values, (dry,), carries_payload=carries),
            effect_values=np.array([0.5]),
            std=np.ones(2),
            rivals=(friction,),
            shapes=0,
            carries_payload=carries,
        )
        block = model.block(t, q, v, a, carries_payload=carries)
        own = friction.columns(model.ready(friction, block, values)).ravel()
        found = rivals.moments(t, (q, v, a)).own
        np.testing.assert_allclose(found.ravel(), own @ own, rtol=1e-9)


@pytest.mark.parametrize(("loads", "said"), [((), "payload"), ((2.0,), "payload")])
def test_a_payload_that_the_model_has_is_refused(loads: tuple[float, ...], said: str) -> None:
    """What the recordings carry would count as known, or for the next one's load."""
    with pytest.raises(DesignError, match=said):
        design(MODEL + PAYLOAD, recorded(), DesignTask(loads=loads, **SHORT))


def test_recordings_that_carry_a_load_are_refused_for_another() -> None:
    marked = Dataset(tuple(one.replace(payload=True) for one in recorded().recordings))
    with pytest.raises(DesignError, match="carries a payload"):
        design(MODEL, marked, DesignTask(loads=(2.0,), **SHORT))


@pytest.mark.slow
def test_limits_of_torque_leave_room_for_another_centre() -> None:
    limits = MotionLimits.of(ROBOT)
    limits.torque[:] = 120.0, 25.0
    found = design(MODEL, recorded(), DesignTask(loads=(3.0,), **SHORT), limits=limits)
    model, load = MODEL + PAYLOAD, usual_load(ROBOT, 3.0)
    values = true_values(model)
    q, v, a = found.trajectory.at(np.linspace(0.0, 6.0, 3001))
    block = model.block(np.linspace(0.0, 6.0, 3001), q, v, a, carries_payload=True)
    for shift in (0.1, -0.1):
        moved = load + np.eye(10)[1] * 3.0 * shift
        values[model.slices["payload"]] = moved
        torque = model.torque(block, values)
        assert np.all(np.abs(torque).max(axis=0) <= limits.torque)


@pytest.mark.slow
def test_files_say_what_is_carried(tmp_path: Path) -> None:
    import dynident as di
    from dynident.closed_loop import load_experiment

    study = di.load(PROBLEM / "study.toml")
    found = design(study.model, study.train, DesignTask(loads=(0.5,), **SHORT))
    write_design(found, tmp_path, 200.0, study.controller)
    assert read_design(tmp_path, study.robot.names).load == 0.5
    experiment = load_experiment(tmp_path / "experiment.toml")
    assert [run.payload for run in experiment.runs] == [True]
    (carried,) = (one for one in experiment.effects if one.effect.is_payload)
    assert carried.values[0] == pytest.approx(0.5)
    assert found.to_dict()["load"] == 0.5
    with pytest.raises(DesignError, match="payload"):  # this robot has none
        record_virtually(found, load_experiment(PROBLEM / "experiment.toml"), 1)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"loads": (-1.0,)}, "a load of -1 kg"),
        ({"loads": (np.inf,)}, "a load of inf kg"),
        ({"show": (PAYLOAD,)}, "state its mass"),
        ({"show": (PAYLOAD,), "loads": (0.0,)}, "state its mass"),
        ({"show": (PAYLOAD,), "loads": (1.0, 2.0)}, "and no other"),
        ({"tell": ((PAYLOAD, effects_of("drive_gain@elbow", ROBOT)[0]),)}, "a payload to tell"),
    ],
)
def test_what_cannot_be_asked_of_loads_is_a_line(settings: dict, said: str) -> None:
    with pytest.raises(DesignError, match=said):
        DesignTask(**settings)


def test_the_command_refuses_a_negative_load(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["design", str(PROBLEM / "study.toml"), "--load", "-2"])
    assert ended.value.code == 2
    assert "a load of -2 kg" in capsys.readouterr().err
