"""What the verdict may say: nothing is missing only where nothing is."""

from __future__ import annotations

import json

import numpy as np
import pytest

from brief_search import BRIEF
from dynident import diagnose as find
from dynident.criteria import DEFAULTS, Criteria
from dynident.evidence import compare_models
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def recordings(model: Model, **values: float) -> tuple[Recording, ...]:
    truth = true_values(model, **FRICTION, **values)
    return tuple(
        synthetic(model, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(4)
    )


def with_contact(recording: Recording, size: float) -> Recording:
    """A pulse of 0.4 s that returns in every period, at the elbow."""
    pulse = size * np.exp(-(((np.mod(recording.t, 8.0) - 3.0) / 0.15) ** 2))
    tau = np.array(recording.tau)
    tau[:, 1] += pulse
    return recording.replace(tau=tau)


@pytest.mark.parametrize(("size", "criteria"), [(1.0, BRIEF), (4.0, DEFAULTS)])
@pytest.mark.slow
def test_a_short_disturbance_that_returns_is_not_called_noise(
    model: Model, size: float, criteria: Criteria
) -> None:
    """However short: it is in every period, and no noise is."""
    runs = tuple(with_contact(one, size) for one in recordings(model))
    train, test = Dataset(runs[:3]), Dataset(runs[3:])
    found = find(model, train, test, propose="never", criteria=criteria)
    assert found.verdict == "unexplained"
    assert "beyond the noise" in found.sentence


@pytest.mark.slow
def test_what_only_a_training_recording_shows_is_not_called_noise(model: Model) -> None:
    """It returns in its every period, and the motions that judge are elsewhere."""
    runs = recordings(model)
    train = Dataset((with_contact(runs[0], 8.0), *runs[1:3]))
    found = find(model, train, Dataset(runs[3:]), propose="never", criteria=BRIEF)
    assert found.verdict == "unexplained"
    assert found.training_only == ("elbow",) and "held-out recordings do not show" in found.sentence
    assert found.to_dict()["training_only"] == ["elbow"] and not found.confidence
    assert all((joint.ratio_after or 0.0) < 1.0 for joint in found.joints)
    (note,) = [one for one in found.notes if "test recordings do not" in one]
    assert f"largest in {runs[0].name} at t = " in note and "elbow (" in note
    assert "shoulder" not in note
    assert float(note.partition("at t = ")[2].split()[0]) % 8.0 == pytest.approx(3.0, abs=0.2)


@pytest.mark.slow
def test_the_shape_of_an_effect_in_the_given_model_is_sought_too(model: Model) -> None:
    """A study names Stribeck friction, but not its speed: a wrong one would look like more."""
    given = model + "stribeck_friction@elbow"
    slow = tuple(e.shaped(0.03) if e.shape else e for e in given.effects)
    runs = recordings(given.with_shapes(slow), Fs__elbow=1.2)
    found = find(given, Dataset(runs[:3]), Dataset(runs[3:]))
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    (speed,) = next(e.shape for e in found.before.model.effects if e.shape)
    assert speed == pytest.approx(0.03, rel=0.3)
    assert found.test_error.after < 1.1 * (found.test_error.noise_floor or 0.0)


@pytest.mark.slow
def test_what_the_data_do_not_tell_keeps_its_given_value_and_has_no_sigma(model: Model) -> None:
    """The elbow is at rest: its speed is noise, and so is every friction found from it."""
    truth = true_values(model, **FRICTION)
    runs = []
    for seed in range(3):
        one = synthetic(model, truth, seed, rate_hz=250.0)
        q = np.column_stack([one.q[:, 0], np.full(one.samples, 0.3)])
        v = np.gradient(q, 1 / 250.0, axis=0)
        a = np.gradient(v, 1 / 250.0, axis=0)
        rng = np.random.default_rng(seed)
        tau = model.torque(model.block(one.t, q, v, a), truth) + 0.1 * rng.normal(size=q.shape)
        runs.append(one.replace(q=q, tau=tau))
    after = find(model, Dataset(tuple(runs[:2])), Dataset(tuple(runs[2:]))).after
    lost = {name for name, known in zip(after.names, after.identified, strict=True) if not known}
    assert lost == {"Fv@elbow", "Fc@elbow"}
    assert after.value("Fv@elbow") == after.value("Fc@elbow") == 0.0
    assert np.all(np.isnan(after.sigma[~after.identified]))
    assert np.all(
        np.abs(after.values - truth)[after.identified] < 5 * after.sigma[after.identified]
    )


@pytest.mark.slow
def test_the_estimate_names_the_method_that_was_used(model: Model) -> None:
    runs = recordings(model)[:2]
    noise = Noise(np.full(2, 2e-5), np.full(2, 0.3))
    bare = tuple(one.replace(period=None) for one in runs)
    methods = {
        "instrumental variables": Dataset(runs),
        "corrected for the stated noise": Dataset(bare, None, noise),
        "weighted per joint": Dataset(bare),
    }
    rows = set()
    for words, data in methods.items():
        estimate = find(model, data, most=0).before
        assert words in estimate.method
        rows.add(round(estimate.rows, -3))
    assert len(rows) == 1  # noisy copies are no new equations


@pytest.mark.slow
def test_a_joint_without_torque_has_no_error_and_no_nan_in_json(model: Model) -> None:
    runs = []
    for one in recordings(model)[:3]:
        still = np.column_stack([one.q[:, 0], np.full(one.samples, 0.3)])
        runs.append(one.replace(q=still, tau=one.tau * [1.0, 0.0]))
    found = find(model, Dataset(tuple(runs[:2])), Dataset(tuple(runs[2:])), most=0)
    text = json.dumps(found.to_dict(), allow_nan=False)
    assert json.loads(text)["joints"][1]["error_after"] is None
    elbow = found.joint_table().rows[1]
    assert elbow[:4] == ("elbow", "-", "-", "-")
    both = compare_models({"one": model}, Dataset(tuple(runs[:2])), Dataset(tuple(runs[2:])))
    json.dumps(both.to_dict(), allow_nan=False)
    assert both.tables()


@pytest.mark.slow
def test_test_recordings_that_do_not_repeat_are_judged_all_the_same(model: Model) -> None:
    """Healthy training runs, and a drag in the test run only: something is missing there."""
    healthy = recordings(model)[:3]
    lacking = model + "quadratic_drag@elbow"
    truth = true_values(lacking, **FRICTION, Fq__elbow=0.5)
    other = synthetic(lacking, truth, 7, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
    test = Dataset((other.replace(period=None),))
    found = find(model, Dataset(healthy), test, propose="never")
    assert found.test_error.noise_floor is not None
    assert found.test_error.before > 1.5 * found.test_error.noise_floor
    assert found.verdict == "unexplained"


def test_test_recordings_that_repeat_give_the_floor_that_the_others_cannot(model: Model) -> None:
    runs = recordings(model)
    train = Dataset(tuple(r.replace(period=None) for r in runs[:3]))
    found = find(model, train, Dataset(runs[3:]))
    assert (found.noise_source, found.verdict) == ("replicates", "nothing_missing")
    assert any("plain least squares" in note for note in found.notes)


@pytest.mark.slow
def test_what_differentiation_leaves_is_not_called_missing(model: Model) -> None:
    """Without any noise the floor is zero, and rounding and truncation are all that is left."""
    truth = true_values(model, **FRICTION)
    runs = tuple(synthetic(model, truth, seed, rate_hz=500.0) for seed in range(3))
    found = find(model, Dataset(runs[:2]), Dataset(runs[2:]))
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    assert found.test_error.after < 1e-4
