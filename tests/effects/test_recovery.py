"""Effects that depend on the present model, or on their own values, found again without noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chains import chain
from dynident.effects import effects_of
from dynident.fitting import fit, load_estimate
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording, central_difference
from synthetic import smooth_motion

ROBOT = chain(3, 1)
PLAIN = Model(ROBOT) + "viscous_friction" + "coulomb_friction"
VISCOUS, DRY = 0.3, 0.2
RATE = 200.0
BARE = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=None, ends="keep")


def exact(label: str, values: tuple[float, ...], t, q, v, a) -> np.ndarray:
    """Recorded torque of the robot with the effect on board, by what a simulator does."""
    (effect,) = effects_of(label, ROBOT)
    sign = np.tanh(v / PLAIN.friction_width)
    load = effect.simulated_robot(values, ROBOT).inverse_dynamics(q, v, a)
    load = load + VISCOUS * v + DRY * sign
    load = load + effect.simulated_loss(values, ROBOT) * np.abs(load) * sign
    late = np.rint(effect.simulated_delay(values, ROBOT) * RATE).astype(int)
    rows = np.maximum(np.arange(len(t))[:, None] - late, 0)
    return np.take_along_axis(load, rows, axis=0)


def recorded(label: str, values: tuple[float, ...]) -> Recording:
    """A recording whose rows are exact: its derivatives are those that a fit takes."""
    t, q, _, _ = smooth_motion(3, 0, RATE, 8.0, 8.0)
    v = central_difference(q, RATE)
    return Recording(t, q, exact(label, values, t, q, v, central_difference(v, RATE)), ROBOT.names)


@pytest.mark.parametrize(
    ("label", "values"),
    [
        ("base_tilt", (0.05, -0.03)),
        ("joint_zero@j1", (0.1,)),
        ("load_friction@j1", (0.1,)),
        ("torque_delay", (0.005,)),
        ("torque_delay@j1", (0.005,)),
    ],
)
def test_known_values_are_found_again(label: str, values: tuple[float, ...], tmp_path) -> None:
    model = PLAIN + label
    found = fit(model, Dataset((recorded(label, values),), BARE))
    np.testing.assert_allclose(found.effect_values(label), values, atol=1e-6)
    np.testing.assert_allclose(found.effect_values("viscous_friction@j0"), VISCOUS, atol=1e-5)
    np.testing.assert_allclose(found.effect_values("coulomb_friction@j2"), DRY, atol=1e-5)
    assert found.error < 1e-6
    assert not found.notes
    # Kept with the values at which its columns were taken.
    again = load_estimate(found.save(tmp_path / "estimate.json"))
    assert again.model.effects == found.model.effects
    effect = again.model.effects[-1]
    assert effect.point == (tuple(found.effect_values(label)) if effect.nonlinear else ())


def test_a_delay_between_samples_is_found_to_the_accuracy_of_a_spline() -> None:
    late = 0.0033
    t, q, _, _ = smooth_motion(3, 0, 500.0, 8.0, 8.0)
    torque = ROBOT.inverse_dynamics(*smooth_motion_at(t - late))
    recording = Recording(t, q, torque, ROBOT.names)
    ends = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=None, edge_s=(0.05, 0.05))
    found = fit(Model(ROBOT) + "torque_delay", Dataset((recording,), ends))
    np.testing.assert_allclose(found.effect_values("torque_delay"), late, rtol=1e-3)


def smooth_motion_at(t: np.ndarray) -> list[np.ndarray]:
    """The motion of seed 0 and period 8 s at other times: a Fourier series is known anywhere."""
    grid, *motion = smooth_motion(3, 0, 20.0, 8.0, 8.0)
    count = len(grid) - 1
    found = []
    for x in motion:
        c = np.fft.rfft(x[:-1], axis=0) / count
        k = 2j * np.pi * np.arange(len(c)) / 8.0
        wave = np.exp(np.multiply.outer(t, k))
        found.append(2 * np.real(wave[:, 1:] @ c[1:]) + np.real(c[0]))
    return found


def test_effects_of_the_bodies_build_on_each_other() -> None:
    """Base tilt and joint zero together are the robot with both of them."""
    tilt, zero = (0.2, 0.1), (0.3,)
    model = PLAIN + "base_tilt" + "joint_zero@j1"
    values = model.given_values()
    values[model.slices["base_tilt"]] = tilt
    values[model.slices["joint_zero@j1"]] = zero
    t, q, v, a = smooth_motion(3, 1, 20.0, 2.0, 2.0)
    both = ROBOT
    for effect, own in zip(model.effects[-2:], (tilt, zero), strict=True):
        both = effect.simulated_robot(own, both)
    found = model.at(values).torque(model.block(t, q, v, a), values)
    np.testing.assert_allclose(found, both.inverse_dynamics(q, v, a), atol=1e-12)


def test_columns_of_a_whole_recording_do_not_depend_on_its_blocks() -> None:
    from dynident.fitting import sampling

    model = (PLAIN + "torque_delay").at(np.zeros((PLAIN + "torque_delay").size))
    values = model.given_values()
    sampled = sampling.sample(recorded("torque_delay", (0.005,)), None)
    whole = np.concatenate(list(sampled.columns(model, values)))
    parts = list(replace(sampled, at_once=400).columns(model, values))
    assert len(parts) > 1
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-8)
