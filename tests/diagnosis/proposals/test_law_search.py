"""Laws proposed for what a model lacks, and none where it lacks nothing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.proposals.proposals_of import proposals_of
from dynident.evidence.evidence_fit import fit_evidence
from laws_hidden import MODEL, path, recordings, searched, together, with_law


def proposals(torques: dict[str, float], *added: str, **how):
    """What is proposed where the catalogue has added effects."""
    search, fitted = searched(recordings(torques, **how))
    return proposals_of(search, path(search, fitted, *added))


@cache
def of_a_product() -> tuple[Proposal, ...]:
    """What is proposed for a torque that is a product of position and velocity."""
    return proposals({"c*v*q": 0.5})


@pytest.mark.slow
def test_a_hidden_law_is_proposed_with_its_coefficient() -> None:
    (found,) = of_a_product()
    assert (found.torque, found.effect.joint) == ("c*v*q", "elbow")
    assert found.values[0] == pytest.approx(0.5, abs=4 * found.sigma[0])
    assert found.is_explanation
    assert found.noise_floor is not None
    assert found.test_error_after < 1.05 * found.noise_floor


@pytest.mark.slow
def test_a_law_of_low_speeds_is_found_behind_friction_that_looks_wide() -> None:
    """A missing law that fades with the speed widens dry friction, and hides behind that."""
    torque = "c*q*sign(v)*exp(-abs(v)/0.07)"
    search, fitted = searched(recordings({torque: 1.0}))
    wide = fit_evidence(search.evidence, MODEL.with_friction_width("elbow", 0.1), fitted)
    found = next(search.found(wide)).proposal
    assert found.torque == "c*sign(v)*exp(-abs(v)/w)*q"
    (speed,) = found.effect.shape
    assert speed == pytest.approx(0.07, abs=4 * found.shape_sigma[0]) and speed < 0.1
    assert "at elbow in place of 0.1" in found.remark
    # Both searches count.
    alone = next(search.found(fitted)).proposal
    assert found.tried > 1.5 * alone.tried and not alone.remark


@pytest.mark.slow
def test_of_laws_that_nothing_tells_apart_the_simplest_comes_first() -> None:
    """A wave of a low frequency beside it is a constant, and never worse on the rows fitted."""
    (found,) = of_a_product()
    assert found.torque == "c*v*q"
    assert any("sin(k*q[shoulder])" in one.made_of.torque for one in found.rivals)


@pytest.mark.slow
def test_a_product_of_three_is_found_by_way_of_products_of_two() -> None:
    found = proposals({"c*v*q*abs(v[shoulder])": 0.4})[0]
    factors = set(found.torque.replace("[shoulder]", ".far").split("*"))
    assert factors == {"c", "v", "q", "abs(v.far)"}
    assert found.values[0] == pytest.approx(0.4, abs=4 * found.sigma[0])


@pytest.mark.slow
def test_a_product_of_three_is_found_from_a_wrong_one_by_exchanging_its_factors() -> None:
    """Of the one best product of two, v[shoulder]^3 and a wave, no third factor makes it."""
    search, fitted = searched(recordings({"c*abs(v)*q*v[shoulder]": 0.4}))
    for exchanged, is_found in ((0, False), (6, True)):
        numbers = replace(search.evidence.criteria.proposals, seeds=1, exchanged=exchanged)
        criteria = replace(search.evidence.criteria, proposals=numbers)
        one = replace(search, evidence=replace(search.evidence, criteria=criteria))
        found = next(one.found(fitted)).proposal
        assert (found.torque == "c*abs(v)*q*v[shoulder]") == is_found


@pytest.mark.slow
@pytest.mark.parametrize(("torque", "before"), [("c*v*", "v*("), ("c*", "")])
def test_waves_over_two_joints_are_found_whatever_their_phases(torque: str, before: str) -> None:
    (found,) = proposals({f"{torque}sin(2.4*q + 0.3)*sin(4.7*q[shoulder] - 0.4)": 0.9})
    assert found.torque.startswith(f"{before}c1*sin(k*q)*sin(m*q[shoulder]) + c2*sin(k*q)*cos(m")
    assert found.is_explanation
    for value, sigma, true in zip(found.effect.shape, found.shape_sigma, (2.4, 4.7), strict=True):
        assert value == pytest.approx(true, abs=4 * sigma)
        assert sigma < 0.2


@pytest.mark.slow
def test_shapes_of_a_law_have_a_sigma_and_its_metric_is_made_once_where_they_hardly_move() -> None:
    made = recordings({"c*v*sin(2.4*q[shoulder])": 0.4})
    search, fitted = searched(made)
    said: list[str] = []
    found = next(replace(search, progress=said.append).found(fitted)).proposal
    assert found.torque == "v*(c1*sin(k*q[shoulder]) + c2*cos(k*q[shoulder]))"
    # Once in the metric of the model as given, once in that with the law.
    assert said.count("laws at elbow") == 2
    (sigma,) = found.shape_sigma
    # Least squares with the derivative as a column: 0.11, of a motion of 0.3 rad.
    assert 0.05 < sigma < 0.4
    assert found.named_values["k"] == pytest.approx(2.4, abs=4 * sigma)


@pytest.mark.slow
def test_of_several_laws_none_is_called_an_explanation() -> None:
    found = proposals({"c*v*q": 0.5, "c*v^2*q[shoulder]": 0.2})
    assert found[-1].torque == "c*v^2*q[shoulder]"
    assert [one.is_explanation for one in found] == [False, False]


@pytest.mark.slow
def test_what_cannot_be_told_apart_are_rivals_and_the_truth_is_among_them() -> None:
    found = proposals({"c*v*q": 0.5}, motion=together)[0]
    named = {one.made_of.torque for one in (found.effect, *found.rivals)}
    assert {"c*v*q", "c*q*v[shoulder]", "c*v*q[shoulder]"} & named
    assert "c*v*q" in named


def test_nothing_is_proposed_for_noise() -> None:
    assert proposals({}) == ()


def test_nothing_is_proposed_where_the_law_is_in_the_model() -> None:
    search, fitted = searched(recordings({"c*v*q": 0.5}), with_law(MODEL, "c*v*q"))
    assert list(search.found(fitted)) == []


DRUM = {"c*q*load": 0.08}
RIPPLE = "torque_ripple@elbow"


@pytest.mark.slow
def test_a_law_that_a_wrong_effect_hides_is_proposed_instead_of_it() -> None:
    (found,) = proposals(DRUM, RIPPLE)
    assert (found.torque, found.instead_of) == ("c*q*load", (RIPPLE,))
    assert found.values[0] == pytest.approx(0.08, abs=4 * found.sigma[0])
    assert found.is_explanation
    assert found.sentence.startswith(f"Instead of {RIPPLE}, a law that no catalogue has would be")
    assert found.to_dict()["instead_of"] == [RIPPLE]


@pytest.mark.slow
def test_only_the_wrong_one_of_two_effects_is_replaced() -> None:
    (found,) = proposals(DRUM, "joint_spring@elbow", RIPPLE, spring=8.0)
    assert (found.torque, found.instead_of) == ("c*q*load", (RIPPLE,))


@pytest.mark.slow
def test_a_right_effect_stays_beside_a_law() -> None:
    found = proposals({"c*v*q": 0.5}, "joint_spring@elbow", spring=1.0)[0]
    assert (found.torque, found.instead_of) == ("c*v*q", ())


def test_nothing_is_proposed_instead_of_what_explains_it() -> None:
    assert proposals({}, "joint_spring@elbow", spring=8.0) == ()
