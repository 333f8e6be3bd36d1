"""The library of terms: which there are, and that each is a law that a joint can have."""

from __future__ import annotations

from itertools import pairwise

from chains import chain
from dynident.diagnosis.proposals.term_library import Factor, LibraryTerm, extended, library
from dynident.effects import law_effect
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


def test_the_price_grows_with_factors_and_other_joints() -> None:
    prices = [LibraryTerm(one).price for one in ((V,), (V, Q), (V, FAR), (V, Q, FAR))]
    assert all(low < high for low, high in pairwise(prices))
