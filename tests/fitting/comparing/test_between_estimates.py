"""Then and now: what has changed is found, what has not is not, and what cannot be told is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from dynident import fit
from dynident.errors import FitError
from dynident.fitting.comparing.between_estimates import estimate_changes
from dynident.fitting.comparing.changed_parameters import LEVEL
from dynident.fitting.estimate import DataSource, Estimate
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}


def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


def estimated(seed: int, of: Model | None = None, **values: float) -> Estimate:
    truth = true_values(model(), **{**FRICTION, **values})
    made = synthetic(model(), truth, seed, rate_hz=250.0, torque_std=0.1)
    return fit(of or model(), Dataset((made,)))


@pytest.fixture(scope="module")
def before() -> Estimate:
    return estimated(1)


def test_what_has_changed_is_found_and_nothing_else(before):
    found = estimate_changes(before, estimated(2, Fc__elbow=0.75))
    assert [one.parameter for one in found.changed] == ["Fc@elbow"]
    (one,) = found.changed
    assert one.after - one.before == pytest.approx(0.15, abs=3 * one.sigma)
    assert found.p_value < 1e-6 and found.parameters[0] is one


def test_where_nothing_has_changed_nothing_is_said_to(before):
    found = estimate_changes(before, estimated(3))
    assert found.changed == () and found.p_value > 0.01
    assert found.sentence.startswith("None of 10")


@pytest.mark.slow
def test_p_values_are_uniform_and_false_alarms_as_rare_as_promised(before):
    # What two fits to recordings of their own would give, of a robot that has not changed.
    rng = np.random.default_rng(0)
    kept = list(before.basis.independent)
    covariance = before.covariance[np.ix_(kept, kept)]

    def again() -> Estimate:
        values = np.array(before.values)
        values[kept] += rng.multivariate_normal(np.zeros(len(kept)), covariance)
        return replace(before, values=values)

    def moved_sources(one: Estimate) -> Estimate:
        return replace(one, sources=())

    found = [estimate_changes(again(), moved_sources(again())) for _ in range(2000)]
    assert kstest([one.p_value for one in found], "uniform").pvalue > 0.01
    alarms = np.mean([not one.sentence.startswith("None of") for one in found])
    assert alarms < LEVEL + 3 * np.sqrt(LEVEL / 2000)  # of any claim at all
    assert alarms > LEVEL / 4  # a test that never speaks would pass as well
    named = np.mean([bool(one.changed) for one in found])
    assert LEVEL / 4 < named <= alarms


def test_then_and_now_exchanged_is_the_same_change_backwards(before):
    after = estimated(2, Fc__elbow=0.75)
    there, back = estimate_changes(before, after), estimate_changes(after, before)
    z = {one.parameter: one.z for one in there.parameters}
    assert {one.parameter: -one.z for one in back.parameters} == pytest.approx(z)
    assert back.statistic == pytest.approx(there.statistic)


def test_a_change_of_a_combination_is_seen_by_all_parameters_together(before):
    """Two parameters that hang together: a change that neither alone could show."""
    kept = list(before.basis.independent)
    sizes, directions = np.linalg.eigh(before.covariance[np.ix_(kept, kept)])
    values = np.array(before.values)
    values[kept] += 8.0 * np.sqrt(2 * sizes[0]) * directions[:, 0]  # the best known of all
    found = estimate_changes(before, replace(before, values=values, sources=()))
    assert found.statistic == pytest.approx(64.0, rel=1e-6)
    assert found.p_value < 1e-4


def test_no_parameter_is_named_where_all_together_show_nothing(before):
    """The p of one parameter is below the level, that of all together is not: no claim."""
    k = before.basis.independent[-1]
    values, covariance = np.array(before.values), np.diag(np.diag(before.covariance))
    flat = replace(before, covariance=covariance)
    values[k] += 2.9 * np.sqrt(2 * covariance[k, k])
    found = estimate_changes(flat, replace(flat, values=values, sources=()))
    assert found.parameters[0].p_adjusted < LEVEL < found.p_value
    assert found.changed == () and found.sentence.startswith("None of 10")
    assert not any(one["has_changed"] for one in found.to_dict()["parameters"])


def test_a_sigma_that_takes_rows_as_independent_is_told(before):
    plain = replace(before, sigma_words="", sources=())
    own = replace(before, sigma_words="sigma counts what rows share.")
    told = [estimate_changes(own, one).caveats for one in (replace(own, sources=()), plain)]
    assert not any("independent" in one for one in told[0])
    assert any("independent" in one and "too small" in one for one in told[1])


def test_another_friction_width_is_another_quantity_only_where_friction_is_dry(before):
    wide = estimated(4, of=model().with_friction_width("elbow", 0.3))
    with pytest.raises(FitError, match=r"friction_width at elbow is 0.01 .* 0.3 in the other"):
        estimate_changes(before, wide)
    viscous = Model(arm()) + "viscous_friction"
    wider = viscous.with_friction_width("elbow", 0.3)
    assert estimate_changes(estimated(1, of=viscous), estimated(4, of=wider)).parameters


def test_another_tree_of_the_same_names_is_refused(before):
    robot = before.model.robot
    first, *others = robot.joints
    moved = replace(robot, joints=(first, replace(others[0], p=others[0].p + 0.01), *others[1:]))
    turned = replace(robot, joints=(replace(first, axis=-first.axis), *others))
    tilted = replace(robot, gravity=(0.1, 0.0, -9.8))
    cases = (
        (moved, f"joint {others[0].name} placed"),
        (turned, f"joint {first.name} placed"),
        (tilted, "other gravity"),
    )
    for other, words in cases:
        after = replace(before, model=replace(before.model, robot=other), sources=())
        with pytest.raises(FitError, match=words) as refusal:
            estimate_changes(before, after)
        assert "one description" in str(refusal.value) and "\n" not in str(refusal.value)


def test_what_cannot_be_compared_is_refused_in_a_line(before):
    other = replace(before, sources=(DataSource("today.csv", "ab" * 32, ""),))
    same = replace(before, sources=(DataSource("again.csv", "ab" * 32, ""),))
    bare = replace(before, covariance=0 * before.covariance)
    cases = (
        (other, same, "both estimates rest on again.csv"),
        (before, bare, "no covariance"),
    )
    for old, new, words in cases:
        with pytest.raises(FitError, match=words) as refusal:
            estimate_changes(old, new)
        assert "\n" not in str(refusal.value)
