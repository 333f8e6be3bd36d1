"""The whole diagnosis on recordings of known truth."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from brief_search import BRIEF
from dynident import compare
from dynident import diagnose as find
from dynident import fit as fit_model
from dynident.diagnosis import Diagnosis
from dynident.effects import effects_of
from dynident.errors import FitError, RecordingError
from dynident.evidence import compare_models
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
NOISE = {"position_std": 2e-5, "torque_std": 0.3}
PAYLOAD = {"payload.mass": 0.3, "payload.mx": 0.06, "payload.Izz": 0.02}
KNOWN: dict[object, Diagnosis] = {}
"""Diagnoses of this file's model, by what was hidden."""
TOLD_BY_MORE = ("payload", "joint_spring@shoulder", "joint_spring@elbow")
"""Hidden effects of which two recordings tell too little."""
STATED = Noise(np.array([2e-5, 2e-5]), np.array([0.3, 0.3]))


def in_full(*case: object):
    """A case that `make test-fast` leaves out: two of their kind remain."""
    return pytest.param(*case, marks=pytest.mark.slow)


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def recordings(model: Model, hidden: str | None, values: dict[str, float], **options):
    """Two or three runs to train on and one to test on; a payload is carried in every other one."""
    full = model if hidden is None else model + hidden
    truth = true_values(full, **FRICTION, **values)
    loaded = hidden == "payload"
    made = [
        synthetic(
            full, truth, seed, rate_hz=250.0, payload=bool(seed % 2) if loaded else None, **options
        )
        for seed in (range(4) if hidden in TOLD_BY_MORE else (0, 1, 3))
    ]
    silent = [one.replace(payload=None) for one in made]
    return tuple(silent[:-1]), tuple(silent[-1:])


def diagnosed(model: Model, hidden: str | None, values: dict[str, float]) -> Diagnosis:
    """What is found of a hidden effect; asked by several tests, it is sought once."""
    asked = (hidden, tuple(values.items()))
    if asked not in KNOWN:
        train, test = recordings(model, hidden, values, **NOISE)
        KNOWN[asked] = find(model, Dataset(train), Dataset(test))
    return KNOWN[asked]


@pytest.mark.parametrize(
    ("hidden", "values"),
    [
        in_full("torque_offset@elbow", {"offset__elbow": 0.3}),
        in_full("asymmetric_friction@elbow", {"dFv__elbow": 0.3, "dFc__elbow": 0.2}),
        ("stribeck_friction@elbow", {"Fs__elbow": 0.6}),
        in_full("quadratic_drag@shoulder", {"Fq__shoulder": 0.3}),
        in_full("joint_spring@shoulder", {"k__shoulder": 0.8, "c__shoulder": -0.2}),
        in_full("torque_ripple@elbow", {"As__elbow": 0.2, "Ac__elbow": 0.1}),
        in_full("rotor_inertia@elbow", {"Ia__elbow": 0.1}),
        ("payload", PAYLOAD),
        in_full("drive_gain@shoulder", {"e__shoulder": 0.1}),
        in_full("joint_coupling@elbow:shoulder", {"cv__elbow:shoulder": 0.3}),
    ],
)
def test_a_hidden_effect_is_found_and_the_error_falls_to_the_floor(
    model: Model, hidden: str, values: dict[str, float]
) -> None:
    found = diagnosed(model, hidden, values)
    best = found.best
    assert best is not None
    names = {best.effect.label, *(e.label for e in best.indistinguishable)}
    assert hidden in names
    assert len(names) <= 3
    assert found.verdict == "explained"
    assert found.test_error.noise_floor is not None
    assert found.test_error.before > 1.05 * found.test_error.after
    assert found.test_error.after < 1.15 * found.test_error.noise_floor
    assert best.test_error_after < best.test_error_before


@pytest.mark.parametrize("name", ["viscous_friction", "coulomb_friction"])
@pytest.mark.slow
def test_plain_friction_is_found_where_the_model_has_none(model: Model, name: str) -> None:
    train, test = recordings(model, None, {}, **NOISE)
    found = find(model - f"{name}@elbow", Dataset(train), Dataset(test))
    assert found.best is not None
    assert f"{name}@elbow" in {
        found.best.effect.label,
        *(e.label for e in found.best.indistinguishable),
    }


@pytest.mark.slow
def test_which_recordings_carry_the_payload_is_found_too(model: Model) -> None:
    found = diagnosed(model, "payload", PAYLOAD)
    assert any("Payload carried in: synthetic 1, synthetic 3" in note for note in found.notes)


def test_nothing_is_found_where_nothing_is_missing(model: Model) -> None:
    found = diagnosed(model, None, {})
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    assert found.test_error.before == found.test_error.after
    assert not any(c.status == "material" for c in found.candidates)


def strange(recording: Recording) -> Recording:
    """A viscosity that varies with the position of the other joint."""
    v = np.gradient(recording.q, 1 / 250.0, axis=0)
    extra = np.zeros_like(v)
    extra[:, 1] = 0.8 * v[:, 1] * np.sin(3 * recording.q[:, 0]) * np.sin(5 * recording.q[:, 1])
    return recording.replace(tau=recording.tau + extra)


@pytest.mark.slow
def test_an_effect_outside_the_catalogue_is_called_unknown(model: Model) -> None:
    train, test = recordings(model, None, {}, **NOISE)
    train, test = (Dataset(tuple(map(strange, part))) for part in (train, test))
    found = find(model, train, test, propose="never")
    assert found.verdict == "unexplained"
    assert "beyond the noise" in found.sentence


@pytest.mark.slow
def test_beside_a_payload_that_was_found_the_search_for_what_is_left_goes_on(model: Model) -> None:
    train, test = recordings(model, "payload", PAYLOAD, **NOISE)
    train, test = (Dataset(tuple(map(strange, part))) for part in (train, test))
    found = find(model, train, test, propose="never", criteria=BRIEF)
    assert found.verdict == "unexplained"
    assert [one.effect.label for one in found.steps] == ["payload"]


def test_absorbed_effects_come_with_their_experiment(model: Model) -> None:
    found = diagnosed(model, None, {})
    not_identifiable = {c.effect.label: c for c in found.candidates if c.status == "absorbed"}
    assert "rotor_inertia@shoulder" in not_identifiable
    assert not_identifiable["rotor_inertia@shoulder"].p_value is None
    assert "shoulder" in not_identifiable["rotor_inertia@shoulder"].remark


@pytest.mark.slow
def test_without_repetition_or_stated_noise_the_verdict_says_so(model: Model) -> None:
    train, test = recordings(model, "stribeck_friction@elbow", {"Fs__elbow": 0.8}, **NOISE)
    blind = [Dataset(tuple(r.replace(period=None) for r in part)) for part in (train, test)]
    found = find(model, *blind)
    assert found.noise_source == "unknown"
    assert found.test_error.noise_floor is None
    assert all(j.noise_rms is None and j.ratio_before is None for j in found.joints)
    assert "noise is unknown" in found.sentence
    assert any("plain least squares" in note for note in found.notes)
    assert found.best is not None
    assert found.best.effect.name == "stribeck_friction"


@pytest.mark.slow
def test_stated_noise_gives_a_floor_and_a_mark(model: Model) -> None:
    train, test = recordings(model, None, {}, **NOISE)
    told = [
        Dataset(tuple(r.replace(period=None) for r in part), None, STATED) for part in (train, test)
    ]
    found = find(model, *told)
    measured = diagnosed(model, None, {})
    assert found.noise_source == "given"
    assert found.verdict == "nothing_missing"
    assert any("not measured" in note for note in found.notes)
    assert found.test_error.noise_floor is not None
    assert measured.test_error.noise_floor is not None
    assert found.test_error.noise_floor == pytest.approx(measured.test_error.noise_floor, rel=0.1)


@pytest.mark.slow
def test_test_recordings_that_do_not_repeat_take_the_floor_of_the_others(model: Model) -> None:
    train, test = recordings(model, "torque_offset@elbow", {"offset__elbow": 0.3}, **NOISE)
    found = find(model, Dataset(train), Dataset(tuple(r.replace(period=None) for r in test)))
    assert (found.noise_source, found.verdict) == ("replicates", "explained")
    assert found.test_error.after < 1.15 * (found.test_error.noise_floor or 0)
    assert any("do not repeat" in note for note in found.notes)


@pytest.mark.slow
def test_without_test_recordings_blocks_are_held_out(model: Model) -> None:
    train, test = recordings(model, "torque_offset@elbow", {"offset__elbow": 0.3}, **NOISE)
    found = find(model, Dataset(train + test))
    assert any("blocks of time" in note for note in found.notes)
    assert found.best is not None
    assert found.best.effect.label == "torque_offset@elbow"
    assert found.test_error.after < 1.15 * (found.test_error.noise_floor or 0)


@pytest.mark.slow
def test_units_of_torque_do_not_change_the_answer(model: Model) -> None:
    train, test = recordings(model, "quadratic_drag@shoulder", {"Fq__shoulder": 0.3}, **NOISE)
    plain = diagnosed(model, "quadratic_drag@shoulder", {"Fq__shoulder": 0.3})
    scaled = [Dataset(tuple(r.replace(tau=1e3 * r.tau) for r in part)) for part in (train, test)]
    # The description is in the same unit: else the torques would be said to be in N mm.
    robot = model.robot.with_theta(1e3 * model.robot.theta)
    found = find(Model(robot, model.effects), *scaled)
    assert [s.effect.label for s in found.steps] == [s.effect.label for s in plain.steps]
    assert found.test_error.after == pytest.approx(plain.test_error.after, rel=1e-6)
    assert found.steps[0].values[0] == pytest.approx(1e3 * plain.steps[0].values[0], rel=1e-5)


@pytest.mark.slow
def test_the_answer_is_the_same_every_time_and_fits_json(model: Model) -> None:
    hidden = ("torque_offset@elbow", {"offset__elbow": 0.3})
    train, test = recordings(model, *hidden, **NOISE)
    one = diagnosed(model, *hidden).to_dict()
    two = find(model, Dataset(train), Dataset(test)).to_dict()
    assert json.dumps(one, allow_nan=False) == json.dumps(two, allow_nan=False)


def test_compare_puts_models_side_by_side(model: Model) -> None:
    train, test = recordings(model, "torque_offset@elbow", {"offset__elbow": 0.5}, **NOISE)
    effect = effects_of("torque_offset@elbow", model.robot)
    estimates = {
        "before": fit_model(model, Dataset(train)),
        "after": fit_model(model + effect, Dataset(train)),
    }
    result = compare(estimates, Dataset(test))
    errors = [one.error for one in result.results]
    assert errors[0] > 1.5 * errors[1]
    assert result.results[1].floor == pytest.approx(errors[1], rel=0.1)
    text = "\n".join(str(table) for table in result.tables())
    assert "before" in text and "after" in text and "noise floor" in text
    both = compare_models({"b": model, "a": model + effect}, Dataset(train), Dataset(test))
    assert [r.error for r in both.results] == pytest.approx(errors, rel=0.05)


def test_compare_needs_recordings_and_a_period_must_repeat(model: Model) -> None:
    train, _ = recordings(model, None, {}, **NOISE)
    with pytest.raises(FitError, match="no recording to compare"):
        compare(fit_model(model, Dataset(train)), Dataset(()))
    wrong = Dataset(tuple(r.replace(period=5.0) for r in train))
    with pytest.raises(RecordingError, match="do not repeat"):
        find(model, wrong)


@pytest.mark.parametrize("width", [0.04, 0.002])
@pytest.mark.slow
def test_the_friction_width_of_a_joint_is_found_and_is_no_missing_effect(
    model: Model, width: float
) -> None:
    """The friction at the elbow reverses over another width than the 0.01 rad/s of the model."""
    train, test = recordings(model, None, {}, **NOISE)

    def with_width(recording):
        v = np.gradient(recording.q, 1 / 250.0, axis=0)[:, 1]
        tau = np.array(recording.tau)
        tau[:, 1] += 3.0 * np.tanh(v / width) - FRICTION["Fc__elbow"] * np.tanh(v / 0.01)
        return recording.replace(tau=tau)

    made = (Dataset(tuple(with_width(r) for r in some)) for some in (train, test))
    found = find(model, *made)
    assert (found.verdict, found.steps) == ("nothing_missing", ())
    found_widths = found.after.model.friction_widths
    if width > 0.01:
        assert found_widths[1] == pytest.approx(width, rel=0.1)
    else:  # below what the samples show
        assert found_widths[1] < 0.006
    assert found_widths[0] == 0.01
    (note,) = (one for one in found.notes if one.startswith("Friction width"))
    assert "at elbow" in note
    assert ("95 % interval" in note) or ("at most" in note)
    assert found.after.value("Fc@elbow") == pytest.approx(3.0, rel=0.02)
    assert not any(name.startswith("Fb") for name in found.after.names)


@pytest.mark.slow
def test_an_estimate_is_fitted_anew_and_the_answer_says_with_what(model: Model) -> None:
    train, _ = recordings(model, None, {}, **NOISE)
    given = fit_model(model, Dataset(train))
    found = find(given, Dataset(train), most=0)
    assert found.fitted_by == found.before.method != given.method
    assert any(found.fitted_by in note for note in found.joint_table().notes)


@pytest.mark.slow
def test_the_gain_of_a_candidate_is_the_fall_of_the_step_that_adds_it_alone() -> None:
    """Each joint is weighted by its noise in the search; the error that is shown weights none.

    Shoulder and elbow have torques of very different size: shares of both sums differ.
    """
    model = Model(arm()) + "viscous_friction" + "coulomb_friction"
    found = diagnosed(model, "joint_spring@elbow", {"k__elbow": 2.5, "c__elbow": -0.4})
    (step,) = found.steps
    (one,) = [c for c in found.candidates if c.effect.label == step.effect.label]
    assert one.test_gain == pytest.approx(step.fall, rel=1e-9)
    assert found.to_dict()["candidates"][0]["test_gain"] == one.test_gain
    error = step.fall_standard_error
    assert error is not None and 0.0 < error < 0.5 * step.fall and not step.uncertain
    assert found.to_dict()["steps"][0]["fall_standard_error"] == error
    tried = [c for c in found.candidates if c.test_gain is not None]
    assert 10 <= len(tried) < len(found.candidates)
    said = {(c["effect"], c["joint"], c["source"]): c for c in found.to_dict()["candidates"]}
    assert all(
        said[c.effect.name, c.effect.joint, c.effect.source]["test_gain"] is None
        for c in found.candidates
        if c.test_gain is None
    )


@pytest.mark.slow
def test_a_joint_without_any_torque_is_fitted_to_no_more_than_rounding() -> None:
    """Its noise was the square of itself with every fit, until products overflowed."""
    model = Model(arm()) + "viscous_friction" + "coulomb_friction@elbow"
    values = true_values(model, Fv__shoulder=2.0, Fv__elbow=1.0, Fc__elbow=1.5)

    def idle(seed: int) -> Dataset:
        made = synthetic(model, values, seed, rate_hz=100.0, torque_std=0.01, period=None)
        return Dataset((replace(made, tau=made.tau * np.array([1.0, 0.0])),))

    found = find(model, idle(102), idle(103))
    assert np.isfinite(found.after.values).all()
