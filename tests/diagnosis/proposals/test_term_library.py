"""The library of terms: which there are, and that each is a law that a joint can have."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from chains import chain
from dynident.diagnosis.proposals.term_library import (
    Factor,
    LibraryTerm,
    extended,
    library,
    pairs_within,
)
from dynident.effects import Block, law_effect
from synthetic import arm

V = Factor("motion", ("{v}",))
Q = Factor("position", ("{q}",))
WAVE = Factor("position", ("sin({shape}*{q})", "cos({shape}*{q})"), None, ("k", 2.0, 1.0, 3.0))
FAR = Factor("position", ("{q}",), "shoulder")
LOAD = Factor("load", ("{load}",))
TIME = Factor("session", ("t",))


def test_every_term_is_once_a_law_with_units_at_its_joint() -> None:
    robot = arm()
    terms = library(robot, "elbow")
    laws = [one.law("x") for one in terms]
    starts = [one.start for one in terms]
    assert len(set(zip(laws, starts, strict=True))) == len(terms)
    for term in terms[::5]:
        effect = law_effect(term.law("x"))("elbow", shape=term.start).on(robot)
        units = [one.unit for one in effect.parameters(robot)]
        assert len(units) == term.size
        assert all(units)


def test_speeds_of_two_other_joints_are_multiplied_each_pair_once() -> None:
    robot = chain(4)
    pairs = [
        frozenset(one.joint for one in term.factors)
        for term in library(robot, "j2")
        if len(term.factors) == 2
        and all(one.joint and one.texts == ("{v}",) for one in term.factors)
    ]
    assert len(pairs) == 3
    assert set(pairs) == {frozenset(one) for one in (("j0", "j1"), ("j0", "j3"), ("j1", "j3"))}


def test_a_third_factor_is_of_another_sort_or_joint_and_each_product_is_there_once() -> None:
    seeds = [LibraryTerm((V, Q)), LibraryTerm((LOAD, Q)), LibraryTerm((V,))]
    found = extended(seeds, [V, Q, WAVE, FAR, LOAD, TIME])
    made = [frozenset(one.factors) for one in found]
    assert set(made) == {frozenset({V, Q, FAR}), frozenset({V, Q, LOAD}), frozenset({LOAD, Q, FAR})}
    assert len(set(made)) == len(made)


def test_waves_of_two_joints_are_one_term_whatever_their_order() -> None:
    far = replace(WAVE, joint="shoulder", shape=("k", 5.0, 4.0, 6.0))
    (one,) = extended([LibraryTerm((V, WAVE))], [far])
    assert extended([LibraryTerm((V, far))], [WAVE]) == (one,)
    assert one.size == 4
    law = one.law("x")
    assert law.shape == (("k", 1.0, 3.0), ("m", 4.0, 6.0))
    assert one.start == (2.0, 5.0)
    effect = law_effect(law)("elbow", shape=one.start).on(arm())
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(2, 50, 2))
    at, other = (arm().names.index(name) for name in ("elbow", "shoulder"))
    # A phase of each wave is a choice of the four coefficients.
    true = v[:, at] * np.sin(2.0 * q[:, at] + 0.3) * np.sin(5.0 * q[:, other] - 1.1)
    columns = effect.columns(Block(np.zeros(50), q, v, 0.0 * q, names=arm().names))[:, at]
    values, *_ = np.linalg.lstsq(columns, true)
    np.testing.assert_allclose(columns @ values, true, atol=1e-12)


def test_a_third_wave_or_a_second_fading_factor_is_in_no_term() -> None:
    far = [replace(WAVE, joint=name) for name in ("j1", "j2")]
    fading = Factor("motion", ("exp(-abs({v})/{shape})",), None, ("w", 0.1, 0.01, 3.0))
    assert not extended([LibraryTerm((WAVE, far[0]))], [far[1]])
    assert not extended([LibraryTerm((fading, Q))], [replace(fading, joint="j1")])


def test_pairs_within_a_product_of_three_are_each_without_one_factor() -> None:
    three = LibraryTerm((V, Q, FAR))
    pairs = {frozenset(one.factors) for one in pairs_within([three, three])}
    assert pairs == {frozenset(one) for one in ((V, Q), (V, FAR), (Q, FAR))}
    assert len(pairs_within([three, three])) == 3


def test_the_price_grows_with_factors_and_other_joints() -> None:
    prices = [LibraryTerm(one).price for one in ((V,), (V, Q), (V, FAR), (V, Q, FAR))]
    assert all(low < high for low, high in pairwise(prices))
