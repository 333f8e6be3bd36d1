"""Responses of links and Dahl's state: what they say of a motion is what the closed loop shows."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.signal import butter, filtfilt
from tests.synthetic import arm, smooth_motion

from dynident.closed_loop import ClosedLoop, Controller, Fourier, Mechanism, Task, TrueEffect
from dynident.effects import Block, Effect, effects_of
from dynident.effects.transmissions import along
from dynident.effects.transmissions.along import mean_inertia
from dynident.effects.transmissions.backlash import Backlash

ROBOT = arm()
ROTORS = (0.1, 0.07)
KNOWN = {"viscous_friction": (1.2, 0.5), "coulomb_friction": (1.5, 0.6), "rotor_inertia": ROTORS}
PD = Controller(
    kind="pd", rate_hz=1000.0, kp=(1500.0, 600.0), kd=(80.0, 30.0), derivative_cutoff_hz=80.0
)
RATE = 1000.0


def known() -> list[TrueEffect]:
    return [
        one
        for name, values in KNOWN.items()
        for joint, value in zip(ROBOT.names, values, strict=True)
        for one in TrueEffect.of(f"{name}@{joint}", ROBOT, [value])
    ]


def share(joint: str) -> float:
    j = ROBOT.names.index(joint)
    return ROTORS[j] / (ROTORS[j] + mean_inertia(ROBOT, j))


def compliance(joint: str, resonance: float) -> float:
    inertia = mean_inertia(ROBOT, ROBOT.names.index(joint))
    return 1.0 / (inertia * (2.0 * np.pi * resonance) ** 2)


def explained(effect: Effect, value: float) -> np.ndarray:
    """What the column at the truth leaves of the effect in a simulated command, per joint.

    Below 30 Hz: a command is held from sample to sample, and its mean is known to a sample.
    """
    hidden = TrueEffect(effect, (value,))
    trajectory = Fourier.random(ROBOT, 4.0, 5, amplitude=[1.0, 1.2], speed=[2.5, 3.0])
    task = Task(Mechanism.of(ROBOT, [*known(), hidden]), trajectory, 2.0)
    (found,) = ClosedLoop(accuracy=1e-4).simulate([task], PD, lead_in=0.5)
    a = np.gradient(found.v, found.t, axis=0)
    rest = found.torque - Mechanism.of(ROBOT, known()).command(found.t, found.q, found.v, a)
    block = Block(
        found.t, found.q, found.v, a, names=ROBOT.names, body=ROBOT, rotor=np.array(ROTORS)
    )
    model = effect.at([value]).columns(block)[:, :, 0] * value
    b, a = cast(Any, butter(3, 30.0, fs=RATE))
    # The first motion rings from a start that is not known.
    kept = slice(700, -150)
    rest, model = (filtfilt(b, a, x, axis=0)[kept] for x in (rest, model))
    acting = [ROBOT.names.index(str(effect.joint))]
    acting = acting if effect.name == "presliding" else [0, 1]
    return ((rest - model).std(axis=0) / rest.std(axis=0))[acting]


@pytest.mark.parametrize(
    ("joint", "resonance", "damping"), [("elbow", 8.0, 0.1), ("shoulder", 16.0, 0.2)]
)
def test_elasticity_is_what_the_loop_shows(joint: str, resonance: float, damping: float) -> None:
    (effect,) = effects_of(f"joint_elasticity@{joint}", ROBOT)
    effect = effect.shaped(resonance, damping, share(joint))
    assert (explained(effect, compliance(joint, resonance)) < 0.03).all()


@pytest.mark.parametrize(("joint", "gap"), [("elbow", 6e-3), ("shoulder", 1e-2)])
@pytest.mark.slow
def test_backlash_is_what_the_loop_shows(joint: str, gap: float) -> None:
    (effect,) = effects_of(f"backlash@{joint}", ROBOT)
    assert (explained(effect.shaped(30.0, 0.15, share(joint)), gap) < 0.05).all()


def test_presliding_is_what_the_loop_shows() -> None:
    (effect,) = effects_of("presliding@elbow", ROBOT)
    assert (explained(effect.shaped(5e-3), 0.4) < 0.005).all()


def block(seed: int, rate: float = 500.0) -> Block:
    t, q, v, a = smooth_motion(2, seed, rate, 1.0, 2.0)
    return Block(t, q, v, a, names=ROBOT.names, body=ROBOT, rotor=np.array(ROTORS))


@pytest.mark.parametrize("label", ["joint_elasticity@shoulder", "backlash@elbow"])
def test_sensitivities_are_exact_while_no_contact_changes(label: str) -> None:
    (effect,) = effects_of(label, ROBOT)
    if isinstance(effect, Backlash):
        effect = effect.at([1e-4])
    effect, samples = effect.shaped(12.0, 0.2, 0.3), block(1)
    found = effect.sensitivities(samples)
    assert found is not None
    for k in range(3):
        ends = []
        for step in (1e-6, -1e-6):
            shape = list(effect.shape)
            shape[k] *= np.exp(step)
            ends.append(effect.shaped(*shape).columns(samples))
        expected = (ends[0] - ends[1]) / 2e-6
        limit = 1e-5 * np.abs(expected).max()
        np.testing.assert_allclose(found[..., k], expected, atol=limit)


@pytest.mark.parametrize("gap", [1e-3, 5e-3])
def test_the_slope_at_a_gap_is_exact_while_no_contact_changes(gap: float) -> None:
    (effect,) = effects_of("backlash@elbow", ROBOT)
    effect, samples, step = effect.shaped(12.0, 0.2, 0.3), block(1), 1e-6 * gap
    found = effect.at([gap]).point_slope(samples)
    assert found is not None
    ends = [g * effect.at([g]).columns(samples) for g in (gap + step, gap - step)]
    expected = (ends[0] - ends[1]) / (2 * step)
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("wish", ["never", "auto"])
@pytest.mark.parametrize("name", ["joint_elasticity", "backlash"])
def test_a_link_without_inertia_has_no_response_to_follow(
    name: str, wish: str, monkeypatch
) -> None:
    """A wrong estimate may take all inertia from a joint: nothing small enough would follow it."""
    monkeypatch.setenv("DYNIDENT_COMPILE", wish)
    inertia = mean_inertia(ROBOT, 1)
    (effect,) = effects_of(f"{name}@elbow", ROBOT)
    variants = [effect, *effect.variants(ROBOT)]
    for rotor, moves in ((0.0, True), (-inertia, False)):
        samples = replace(block(2), rotor=np.array([0.0, rotor]))
        (each,) = cast(Any, effect).family(variants, [samples])
        for columns in (effect.columns(samples), *each):
            assert columns.shape == (len(samples.t), 2, 1)
            assert np.any(columns) == moves


@pytest.mark.parametrize("name", ["joint_elasticity", "backlash"])
def test_shapes_of_unlike_steps_and_run_ups_are_each_shape_alone(name: str) -> None:
    """Where a motion repeats, what rings long is run through two periods before it begins."""
    (effect,) = effects_of(f"{name}@elbow", ROBOT)
    shapes = [(f, d, 0.3) for f in (3.0, 11.0, 40.0, 150.0) for d in (0.03, 0.4)]
    variants = [effect.shaped(*shape).at([0.002] * len(effect.point)) for shape in shapes]
    samples = replace(block(4, 250.0), period=0.4)
    (together,) = cast(Any, effect).family(variants, [samples])
    for one, found in zip(variants, together, strict=True):
        alone = one.columns(replace(samples, q=samples.q.copy()))
        np.testing.assert_array_equal(found, alone)


def test_a_response_does_not_depend_on_the_rate_of_the_samples() -> None:
    (effect,) = effects_of("joint_elasticity@elbow", ROBOT)
    effect = effect.shaped(40.0, 0.1, 0.3)
    coarse, fine = (effect.columns(block(3, rate)) for rate in (250.0, 2000.0))
    late = slice(100, -2)  # when the start has rung down
    error = coarse[late] - fine[::8][late]
    assert error.std() < 0.02 * fine[::8][late].std()


@pytest.mark.parametrize(
    ("label", "shape"),
    [
        ("joint_elasticity@elbow", (8.0, 0.05, 0.3)),
        ("backlash@elbow", (8.0, 0.05, 0.3)),
        ("presliding@elbow", (0.3,)),
    ],
)
def test_a_motion_that_repeats_has_no_start_to_settle_from(
    label: str, shape: tuple[float, ...]
) -> None:
    (effect,) = effects_of(label, ROBOT)
    effect = effect.shaped(*shape)
    t, q, v, a = smooth_motion(2, 5, 500.0, 8.0, 2.0)
    alone = Block(t, q, v, a, names=ROBOT.names, body=ROBOT, rotor=np.array(ROTORS))
    first, third = slice(0, 1000), slice(2000, 3000)
    rings, steady = (effect.columns(one)[..., 0] for one in (alone, replace(alone, period=2.0)))
    assert unlike(rings[first], rings[third]) > 0.1
    assert unlike(steady[first], steady[third]) < 0.05
    assert unlike(rings[third], steady[third]) < 0.05


@pytest.mark.parametrize("label", ["joint_elasticity@elbow", "backlash@elbow", "presliding@elbow"])
def test_a_record_shorter_than_its_period_starts_at_rest(label: str) -> None:
    (effect,) = effects_of(label, ROBOT)
    t, q, v, a = smooth_motion(2, 5, 500.0, 1.9, 2.0)
    alone = Block(t, q, v, a, names=ROBOT.names, body=ROBOT, rotor=np.array(ROTORS))
    short = effect.columns(replace(alone, period=2.0))
    if label.startswith("presliding"):
        assert np.isfinite(short).all()
    else:
        np.testing.assert_array_equal(short, effect.columns(alone))


def unlike(x: np.ndarray, y: np.ndarray) -> float:
    """Difference of two signals, relative to the latter (root mean squares)."""
    return float(np.linalg.norm(x - y) / np.linalg.norm(y))


def test_derivatives_between_samples_are_those_at_them() -> None:
    """Splines give them at a high rate; at a low one every sample has its own."""
    samples = block(3, 2000.0)
    _, fine = along.along_motion(samples)
    exact = ROBOT.torque_derivatives(samples.q, samples.v, samples.a)
    for joint in range(ROBOT.n):
        found = fine.by(joint)
        for one, every in ((found.by_q, exact.by_q), (found.by_v, exact.by_v)):
            error = 1e-5 * np.abs(every).max()
            np.testing.assert_allclose(one, every[:, :, joint], atol=error)


@pytest.mark.slow
def test_what_is_kept_of_a_motion_goes_with_it() -> None:
    samples = block(3)
    along.along_motion(samples)[1].by(0)
    held = weakref.ref(samples.q)
    del samples
    gc.collect()
    assert held() is None


def test_a_link_goes_with_the_response_that_it_keeps() -> None:
    """Without the collector of cycles, which does not see how large it is."""
    effect = Backlash("elbow").shaped(20.0, 0.3, 0.3).at([0.01])
    one = block(3)
    effect.columns(one)
    made = along.along_motion(one)[1]
    assert made.latest is not None
    link = weakref.ref(made.latest[1])
    gc.disable()
    try:
        made.latest = None
        assert link() is None
    finally:
        gc.enable()


def test_screened_shapes_share_the_dynamics_of_a_joint() -> None:
    (effect,) = effects_of("joint_elasticity@elbow", ROBOT)
    samples = block(4)
    variants = list(effect.variants(ROBOT))
    assert 5 <= len(variants) <= 20
    variants[0].columns(samples)
    robot = samples.body
    assert robot is not None
    samples = replace(samples, body=robot.with_theta(robot.theta))  # the same, made again
    kept = along._ALONG[id(samples.q)][3]
    for one in variants:
        assert np.isfinite(one.columns(samples)).all()
    assert along._ALONG[id(samples.q)][3] is kept


def test_dahls_state_is_the_sign_of_a_long_motion_and_a_spring_at_a_reversal() -> None:
    (effect,) = effects_of("presliding@elbow", ROBOT)
    effect = effect.shaped(1e-2)
    t = np.linspace(0.0, 1.0, 2001)
    q = np.zeros((2001, 2))
    q[:, 1] = np.where(t < 0.5, t, 1.0 - t)
    v = np.zeros((2001, 2))
    v[:, 1] = np.where(t < 0.5, 1.0, -1.0)
    z = effect.columns(Block(t, q, v, 0 * q, names=ROBOT.names))[:, 1, 0] + np.sign(v[:, 1])
    assert np.abs(z[:1000] - 1.0).max() < 1e-12
    back = np.abs(q[:, 1] - 0.5)
    expected = -1.0 + 2.0 * np.exp(-back / 1e-2)
    np.testing.assert_allclose(z[1001:], expected[1001:], atol=1e-9)
