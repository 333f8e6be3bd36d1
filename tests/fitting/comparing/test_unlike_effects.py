"""Estimates of which one has an effect more: what both have is compared, the rest is listed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from dynident import fit
from dynident.errors import FitError
from dynident.fitting import LeastSquares
from dynident.fitting.comparing.between_estimates import estimate_changes
from dynident.fitting.comparing.changed_parameters import LEVEL, EstimateChanges
from dynident.fitting.comparing.unlike_effects import places_of, shared_effects, without
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

NARROW = Model(arm()) + "viscous_friction" + "coulomb_friction"
WIDE = NARROW + "quadratic_drag@elbow"
TRUE = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
DRAG = 0.2
DRAWS = 300


def estimated(of: Model, seed: int, drag: float, motion: int = 1, **changed: float) -> Estimate:
    """A fit to a recording of its own: the same motion, other noise, unless told otherwise."""
    truth = true_values(WIDE, **{**TRUE, "Fq__elbow": drag, **changed})
    made = synthetic(WIDE, truth, motion, rate_hz=250.0)
    noise = 0.1 * np.random.default_rng([seed, 7]).normal(size=made.tau.shape)
    recorded = replace(made, tau=made.tau + noise, name=f"run {seed}")
    return LeastSquares(weighting="none", errors="independent").fit(of, Dataset((recorded,)))


@pytest.fixture(scope="module")
def wide() -> Estimate:
    return estimated(WIDE, 1, DRAG)


@pytest.fixture(scope="module")
def narrow() -> Estimate:
    return estimated(NARROW, 1, DRAG)


def test_without_an_effect_is_the_fit_without_it(wide, narrow):
    """The same recording fitted anew; noise is estimated apart, as the fit is worse."""
    kept = places_of(WIDE, shared_effects(NARROW, WIDE))
    values, covariance = without(wide, kept)
    B = narrow.basis.combination
    np.testing.assert_allclose(B @ values[kept], B @ narrow.values, rtol=0, atol=1e-6)
    ratio = np.diag(B @ covariance[np.ix_(kept, kept)] @ B.T) / np.diag(B @ narrow.covariance @ B.T)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-4)
    assert ratio[0] < 1.0


def drawn(one: Estimate, values: np.ndarray, C: np.ndarray, rng: np.random.Generator) -> Estimate:
    """What a fit to another recording would have given."""
    kept = list(one.basis.independent)
    drawn = np.array(values)
    drawn[kept] += rng.multivariate_normal(np.zeros(len(kept)), C[np.ix_(kept, kept)])
    return replace(one, values=drawn, covariance=C, sources=())


@pytest.mark.slow
@pytest.mark.parametrize("drag", [0.0, DRAG])
def test_a_robot_that_is_the_same_is_rarely_said_to_have_changed(wide, narrow, drag):
    """Be the effect of no size, or there on both days and left out on the first."""
    rng = np.random.default_rng(int(10 * drag))
    truth = np.array(wide.values)
    truth[wide.names.index("Fq@elbow")] = drag
    kept = places_of(WIDE, shared_effects(NARROW, WIDE))
    values, C = without(replace(wide, values=truth), kept)
    found = [
        estimate_changes(
            drawn(narrow, values[kept], C[np.ix_(kept, kept)], rng),
            drawn(wide, truth, wide.covariance, rng),
        )
        for _ in range(DRAWS)
    ]
    claims = np.mean([not one.sentence.startswith("None of") for one in found])
    assert claims < LEVEL + 3 * np.sqrt(LEVEL / DRAWS)
    # The plain difference would accuse the robot of what the model left out.
    beyond = np.mean([max(abs(one.z) for one in each.parameters) > 5 for each in found])
    assert beyond > 0.5 if drag else beyond == 0.0


def coloured(of: Model, seed: int) -> Estimate:
    """A fit as `di.fit` does it, to errors that neighbouring rows share."""
    made = synthetic(WIDE, true_values(WIDE, **TRUE, Fq__elbow=DRAG), 1, rate_hz=100.0)
    white = np.random.default_rng([seed, 9]).normal(size=(len(made.tau) + 200, 2))
    noise = lfilter([0.06], [1.0, -0.8], white, axis=0)[200:]
    return fit(of, Dataset((replace(made, tau=made.tau + noise, name=f"run {seed}"),)))


@pytest.mark.slow
def test_where_taking_out_is_approximate_false_alarms_are_rare_all_the_same():
    """Weights from the residual, a covariance of coloured errors: every old fit with every new."""
    many = 20
    old = [coloured(NARROW, 100 + k) for k in range(many)]
    new = [coloured(WIDE, 500 + k) for k in range(many)]
    found = [estimate_changes(one, other) for one in old for other in new]
    claims = np.mean([not one.sentence.startswith("None of") for one in found])
    # The mean over all pairs varies no more than that over `many` pairs that share nothing.
    assert claims < LEVEL + 3 * np.sqrt(LEVEL / many)
    (caveat,) = [one for one in found[0].caveats if "taken out" in one]
    assert "approximate" in caveat


def test_nothing_in_common_with_a_variance_is_one_line():
    """What is known of either is what the other has not."""
    both = [NARROW + f"{label}@elbow" for label in ("quadratic_drag", "torque_offset")]
    found = []
    for one in (estimated(model, 1 + k, DRAG) for k, model in enumerate(both)):
        alone = np.zeros_like(one.covariance)
        alone[-1, -1] = 1.0
        found.append(replace(one, covariance=alone))
    with pytest.raises(FitError, match="in common has a variance") as refusal:
        estimate_changes(*found)
    assert "\n" not in str(refusal.value)


def test_what_has_changed_beside_a_new_effect_is_found_and_nothing_else():
    """Drag is new, and the friction of the other joint is another one."""
    old = estimated(NARROW, 1, 0.0)
    found = estimate_changes(old, estimated(WIDE, 2, DRAG, motion=2, Fv__shoulder=1.5))
    assert [one.parameter for one in found.changed] == ["Fv@shoulder"]
    assert found.only_before == ()
    (lone,) = found.only_after
    assert (lone.effect, lone.parameter) == ("quadratic_drag@elbow", "Fq@elbow")
    assert lone.value == pytest.approx(DRAG, abs=4 * lone.sigma) and lone.sigma < DRAG / 4
    assert "Only the estimate after has quadratic_drag@elbow." in found.sentence
    assert "that both have" in found.sentence
    assert any("models differ by quadratic_drag@elbow" in one for one in found.caveats)
    assert "Fq@elbow" not in {one.parameter for one in found.parameters}


def test_what_is_gone_is_listed_as_that(wide):
    there = estimate_changes(wide, estimated(NARROW, 3, DRAG))
    back = estimate_changes(replace(estimated(NARROW, 3, DRAG)), wide)
    assert there.only_before == back.only_after and there.only_after == back.only_before == ()
    z = {one.parameter: one.z for one in there.parameters}
    assert {one.parameter: -one.z for one in back.parameters} == pytest.approx(z)
    assert there.p_value == pytest.approx(back.p_value)
    (row,) = there.lone_table().rows
    assert row[:3] == ("Fq@elbow", "quadratic_drag@elbow", "before")
    assert {one["parameter"] for one in there.to_dict()["only_before"]} == {"Fq@elbow"}


def test_what_shares_a_column_with_what_is_gone_is_not_compared():
    """Two effects of one column: only their sum is known, and is no parameter of both models."""
    both = NARROW - "viscous_friction@elbow" + "thermal_friction@elbow"
    assert _shared(estimate_changes(estimated(NARROW, 1, 0.0), estimated(both, 2, 0.0))) >= {
        "Fv@shoulder",
        "Fc@shoulder",
        "Fc@elbow",
    }
    # An offset at the elbow, and gravity that is tilted: neither is known alone.
    tilted = NARROW + "torque_offset@elbow" + "torque_offset@shoulder"
    found = estimate_changes(estimated(NARROW, 1, 0.0), estimated(tilted, 2, 0.0))
    assert {one.effect for one in found.only_after} == {
        "torque_offset@elbow",
        "torque_offset@shoulder",
    }


def _shared(found: EstimateChanges) -> set[str]:
    return {one.parameter for one in found.parameters}
