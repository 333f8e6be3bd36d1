"""Where nothing repeats: the simulated loop in place of repetitions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.closed_loop import Controller, Experiment, Fourier, Sensors, TrueEffect
from dynident.closed_loop import ExperimentRun as Motion
from dynident.diagnosis import diagnose
from dynident.effects import effects_of
from dynident.effects.transmissions.along import mean_inertia
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.model_columns import model_columns
from dynident.evidence.runs import gather
from dynident.evidence.simulated_motion import motion_of_loop
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm

CONTROLLER = Controller(
    kind="pd", rate_hz=500.0, kp=(400.0, 40.0), kd=(30.0, 2.5), derivative_cutoff_hz=80.0
)
FRICTION = {"viscous_friction": (1.2, 0.5), "coulomb_friction": (1.0, 0.6)}
NOISY = Sensors(position_std=1e-3, torque_std=0.05)


def known() -> list[TrueEffect]:
    robot = arm()
    return [
        one
        for name, values in FRICTION.items()
        for joint, value in zip(robot.names, values, strict=True)
        for one in TrueEffect.of(f"{name}@{joint}", robot, [value])
    ]


def recordings(
    seed: int, count: int, hidden: tuple[TrueEffect, ...] = (), sensors: Sensors = NOISY
) -> Dataset:
    """Closed-loop recordings of no period, encoders noisy enough to mislead least squares."""
    robot = arm()
    motions = tuple(
        Motion(
            trajectory=Fourier.random(robot, 9.7 + r, [seed, r], amplitude=1.6, speed=3.0),
            duration=9.0,
            file=f"run{r}.csv",
        )
        for r in range(count)
    )
    made = Experiment(
        robot=robot,
        controller=CONTROLLER,
        runs=motions,
        effects=(*known(), *hidden),
        sensors=sensors,
        seed=seed,
    ).run()
    return Dataset(tuple(one.replace(period=None) for one in made))


def model() -> Model:
    return Model(arm(), tuple(one.effect for one in known()))


@pytest.fixture(scope="module")
def healthy() -> Dataset:
    return recordings(2, 2)


@pytest.mark.slow
def test_noise_halves_inertias_of_least_squares_and_not_those_of_simulated_instruments(
    healthy: Dataset,
) -> None:
    plain = diagnose(model(), healthy, most=1)
    found = diagnose(model(), healthy, controller=CONTROLLER)
    for answer in (plain, found):
        assert answer.verdict == "nothing_missing" and not answer.steps
    # What passes by its figures is seen to be noise behind lower filters.
    assert (plain.candidates[0].p_value or 1.0) < 1e-6
    assert "changes with the filter" in plain.candidates[0].remark
    at = model().names.index("Izz.fore")
    true = model().given_values()[at]
    assert abs(plain.before.values[at] / true - 1.0) > 0.4
    assert abs(found.before.values[at] / true - 1.0) < 0.05
    assert "simulated" in found.before.method
    assert any("simulated closed loop" in note for note in found.notes)


def test_moved_torque_makes_plain_regression_instrumental(healthy: Dataset) -> None:
    loop = motion_of_loop(model(), healthy, CONTROLLER)
    evidence = Evidence(model(), loop.runs)
    fitted = fit_evidence(evidence, evidence.model)
    # V' (y - W x), both whitened as the fit has it, over the norms of what is multiplied.
    V, e = [], []
    for r, run in enumerate(evidence.runs):
        for j, noise in enumerate(fitted.noise):
            measured, simulated = model_columns(evidence, evidence.model, r, j, fitted.values)
            residual = measured @ np.append(-fitted.values, 1.0)
            speed = run.replicates[-1].v[:, j]
            e.append(noise.whiten(residual[:, None], speed)[run.index[0], 0])
            V.append(noise.whiten(simulated[:, :-1], speed)[run.index[0]])
    V, e = np.concatenate(V), np.concatenate(e)
    correlation = (V.T @ e) / (np.linalg.norm(V, axis=0) * np.linalg.norm(e))
    assert np.abs(correlation).max() < 1e-4
    truth = [v for values in FRICTION.values() for v in values]
    assert np.allclose(fitted.values[-4:], truth, atol=0.12)


@pytest.mark.slow
def test_a_hidden_offset_is_found(healthy: Dataset) -> None:
    hidden = TrueEffect.of("torque_offset@elbow", arm(), [0.5], hidden=True)
    found = diagnose(model(), recordings(0, 2, hidden), controller=CONTROLLER)
    assert [step.effect.label for step in found.steps] == ["torque_offset@elbow"]
    assert found.steps[0].values == pytest.approx([0.5], abs=0.05)
    assert found.verdict == "explained"


def test_without_references_least_squares_and_why(healthy: Dataset) -> None:
    blind = replace(
        healthy, recordings=tuple(one.replace(q_ref=None) for one in healthy.recordings)
    )
    loop = motion_of_loop(model(), blind, CONTROLLER)
    assert not loop.runs and "q_ref" in loop.notes[0]
    assert not motion_of_loop(model(), healthy, None).notes


def test_what_rings_is_taken_along_the_measured_motion(healthy: Dataset) -> None:
    """In a loop that does not know of the spring nothing rings."""
    loop = motion_of_loop(model(), healthy, CONTROLLER)
    assert loop.measured is not None
    simulated, measured = (Evidence(model(), runs) for runs in (loop.runs, gather(loop.measured)))
    values = fit_evidence(simulated, model()).values
    (spring,) = effects_of("joint_elasticity@shoulder", arm())
    (drag,) = effects_of("quadratic_drag@shoulder", arm())
    (along,) = simulated.of(spring, 0, model(), values)
    np.testing.assert_allclose(along, measured.of(spring, 0, model(), values)[0])
    (along,) = simulated.of(drag, 0, model(), values)
    assert not np.allclose(along, measured.of(drag, 0, model(), values)[0], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("position_std", [1e-4, 3e-4])
def test_noise_of_positions_makes_no_spring(position_std: float) -> None:
    """Columns of noisy positions explain their noise, on held-out data too."""
    made = recordings(2, 3, (), Sensors(position_std=position_std, torque_std=0.05))
    training, held_out = (Dataset(some) for some in (made.recordings[:2], made.recordings[2:]))
    found = diagnose(model(), training, held_out, controller=CONTROLLER)
    assert not found.steps
    springs = [one for one in found.candidates if one.effect.name == "joint_elasticity"]
    assert min(one.p_value or 1.0 for one in springs) < 1e-3
    assert any("no noise of positions" in one.remark for one in springs)


@pytest.mark.slow
def test_a_hidden_spring_is_found_along_the_measured_motion() -> None:
    robot, shape = arm(), (9.0, 0.08, 0.3)
    compliance = 1.0 / ((2.0 * np.pi * shape[0]) ** 2 * mean_inertia(robot, 0))
    hidden = TrueEffect.of("joint_elasticity@shoulder", robot, [compliance], shape)
    made = recordings(5, 3, hidden, Sensors(position_std=2e-5, torque_std=0.05))
    training, held_out = (Dataset(some) for some in (made.recordings[:2], made.recordings[2:]))
    found = diagnose(model(), training, held_out, controller=CONTROLLER)
    assert found.best is not None and found.best.effect.label == "joint_elasticity@shoulder"
    assert found.best.effect.shape[0] == pytest.approx(shape[0], rel=0.1)
    assert found.test_error.after < 0.6 * found.test_error.before
    assert any("along the measured one" in note for note in found.caveats)
