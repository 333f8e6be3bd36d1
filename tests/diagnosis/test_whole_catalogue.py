"""Effects with a memory, of the session's time, and of the whole robot, found by the diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident import diagnose as find
from dynident.diagnosis import Diagnosis
from dynident.effects import effects_of
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording
from synthetic import arm, smooth_motion

NAMES = ("shoulder", "elbow")
RATE, PERIOD, RUNS = 250.0, 8.0, 4
HANGING = np.array([-np.pi / 2.0, 0.0])
"""About which the arm swings, so that its loads change sign."""
NOISE = np.array([0.12, 0.05])
FRICTION = {"viscous_friction": (1.2, 0.5), "coulomb_friction": (1.5, 0.6)}
PLAIN = Model(arm()) + "viscous_friction" + "coulomb_friction"


def truth(
    label: str, values: tuple[float, ...], shape: tuple[float, ...]
) -> tuple[Model, np.ndarray]:
    """The model with a hidden effect on board, and its parameters."""
    (effect,) = effects_of(label, PLAIN.robot)
    full = PLAIN + (effect.shaped(*shape) if shape else effect).at(values)
    theta = full.given_values()
    for name, of_joints in FRICTION.items():
        for joint, value in zip(NAMES, of_joints, strict=True):
            theta[full.slices[f"{name}@{joint}"]] = value
    theta[full.slices[label]] = values
    return full, theta


def recordings(full: Model, theta: np.ndarray, runs: int = RUNS) -> list[Recording]:
    """Runs of a session, one after the other, every motion twice; torques are the model's."""
    made = []
    for seed in range(runs):
        rng = np.random.default_rng([seed, 3])
        t, q, v, a = smooth_motion(2, seed, RATE, 2.0 * PERIOD, PERIOD)
        q, start = q + HANGING, 20.0 * seed
        block = full.block(t + start, q, v, a, number=seed + 1)
        block = replace(block, period=PERIOD, body=full.robot, rotor=np.zeros(2))
        tau = full.torque(block, theta) + NOISE * rng.normal(size=q.shape)
        made.append(
            Recording(
                t, q, tau, NAMES, period=PERIOD, start=start, number=seed + 1, name=f"run {seed}"
            )
        )
    return made


def diagnosed(label: str, values: tuple[float, ...], shape: tuple[float, ...] = ()) -> Diagnosis:
    made = recordings(*truth(label, values, shape), runs=3)
    return find(PLAIN, Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:])))


def first_named(found: Diagnosis) -> set[str]:
    assert found.best is not None
    return {found.best.effect.label, *(e.label for e in found.best.indistinguishable)}


@pytest.mark.parametrize(
    ("label", "values", "shape"),
    [
        ("base_tilt", (0.0, 0.2), ()),
        ("torque_delay", (0.006,), ()),
        ("load_friction@shoulder", (0.15,), ()),
        ("presliding@elbow", (0.5,), (0.03,)),
        ("thermal_friction@shoulder", (0.8, 0.9), (30.0,)),
        ("torque_drift@elbow", (0.01,), ()),
        ("joint_elasticity@shoulder", (2e-3,), (9.0, 0.08, 0.3)),
        ("backlash@shoulder", (0.003,), (20.0, 0.1, 0.3)),
    ],
)
@pytest.mark.slow
def test_a_hidden_effect_is_found(
    label: str, values: tuple[float, ...], shape: tuple[float, ...]
) -> None:
    found = diagnosed(label, values, shape)
    assert label in first_named(found)
    assert found.verdict == "explained"
    assert found.test_error.noise_floor is not None
    assert found.test_error.before > 1.05 * found.test_error.after
    assert found.test_error.after < 1.15 * found.test_error.noise_floor


@pytest.mark.slow
@pytest.mark.parametrize("edge_s", [0.05, 0.1])
def test_a_spring_is_found_whose_resonance_the_data_do_not_tell(edge_s: float) -> None:
    """The stiffness says all: that the best resonance lies above what samples tell is no reason."""
    made = recordings(*truth("joint_elasticity@shoulder", (2e-3,), (9.0, 0.08, 0.3)))
    settings = Filter(
        position_cutoff_hz=80.0, cutoff_hz=18.0, rate_hz=50.0, edge_s=(edge_s, edge_s)
    )
    found = find(PLAIN, Dataset(tuple(made[:-1]), settings), Dataset(tuple(made[-1:]), settings))
    assert found.verdict == "explained"
    assert [step.effect.label for step in found.steps] == ["joint_elasticity@shoulder"]
    assert found.steps[0].values[0] == pytest.approx(2e-3, rel=0.05)


@pytest.mark.slow
def test_a_shape_that_is_given_is_refined_though_it_is_one_that_is_screened() -> None:
    made = recordings(*truth("joint_elasticity@shoulder", (2e-3,), (9.0, 0.08, 0.3)))
    (given,) = effects_of("joint_elasticity@shoulder", PLAIN.robot)
    found = find(PLAIN + given, Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:])))
    assert found.verdict == "nothing_missing"
    assert found.test_error.noise_floor is not None
    assert found.test_error.before < 1.15 * found.test_error.noise_floor


@pytest.mark.slow
@pytest.mark.parametrize(("gap", "shape"), [(0.003, (20.0, 0.1, 0.3)), (0.004, (36.0, 0.2, 0.5))])
def test_a_gap_that_is_given_is_sought_beyond_the_grid(
    gap: float, shape: tuple[float, float, float]
) -> None:
    """From the few shapes of the grid gaps of 3.2 and 3.6 mrad come out, with 0.02 and 0.008."""
    made = recordings(*truth("backlash@shoulder", (gap,), shape))
    train, test = Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:]))
    found = find(PLAIN + "backlash@shoulder", train, test, most=0, propose="never")
    assert found.test_error.before < 0.006
    before = found.before
    assert before.values[before.names.index("gap@shoulder")] == pytest.approx(gap, rel=0.05)


@pytest.mark.slow
def test_a_gap_that_was_found_is_sought_about_its_shape() -> None:
    """Bursts have many optima near each other: the first one leaves three halves of the noise."""
    made = recordings(*truth("backlash@shoulder", (0.0015,), (40.0, 0.073, 0.388)))
    found = find(PLAIN, Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:])), propose="never")
    assert found.verdict == "explained"
    assert [step.effect.label for step in found.steps] == ["backlash@shoulder"]
    assert found.after.effect_values("backlash@shoulder")[0] == pytest.approx(0.0015, rel=0.05)
    assert found.test_error.noise_floor is not None
    assert found.test_error.after < 1.15 * found.test_error.noise_floor


@pytest.mark.slow
def test_a_gap_is_found_by_its_bursts_where_no_noise_is_known() -> None:
    hidden = truth("backlash@shoulder", (0.0008,), (24.0, 0.5, 0.5))
    made = [one.replace(period=None) for one in recordings(*hidden)]
    found = find(PLAIN, Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:])))
    assert [step.effect.label for step in found.steps] == ["backlash@shoulder"]
    assert found.steps[0].values[0] == pytest.approx(0.0008, rel=0.05)
    assert found.test_error.after < 0.5 * found.test_error.before


@pytest.mark.slow
def test_a_wide_gap_is_found_by_its_bursts_and_kept_beside_another_effect() -> None:
    hidden = truth("backlash@shoulder", (0.006,), (38.0, 0.48, 0.54))
    made = [one.replace(period=None) for one in recordings(*hidden)]
    model = PLAIN - effects_of("viscous_friction@elbow", PLAIN.robot)[0]
    found = find(model, Dataset(tuple(made[:-1])), Dataset(tuple(made[-1:])))
    added = {step.effect.label: step for step in found.steps}
    assert set(added) == {"viscous_friction@elbow", "backlash@shoulder"}
    assert added["backlash@shoulder"].values[0] == pytest.approx(0.006, rel=0.05)
    assert found.test_error.after < 0.5 * found.test_error.before
    (note,) = (one for one in found.notes if "not tried" in one)
    assert note.startswith("Joint elasticity was not tried") and "Backlash was sought only" in note
