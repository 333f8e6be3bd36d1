"""The study of laws in small: laws drawn, hidden in a robot, and proposals marked."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from blind_study.drawn_laws import DrawnFactor, DrawnLaw, draw_law
from blind_study.law_cases import BLOCK, FAMILIES, draw_laws, family_of
from blind_study.law_marks import HeldOutLaw
from blind_study.make import Size, make
from blind_study.robots import specimen
from dynident.study import load

TINY = Size(rate_of_two=200.0, rate_of_many=200.0, runs=2, tests=1)
V_Q = DrawnLaw(1, (DrawnFactor("v", 1), DrawnFactor("q", 0)), 0.01, 2.0)


def test_a_block_has_its_laws_of_each_family_and_stays_as_it_is() -> None:
    cases = draw_laws(3, 2 * BLOCK)
    assert draw_laws(3, 4, first=BLOCK) == cases[BLOCK : BLOCK + 4]
    hidden = [one for one in cases[:BLOCK] if one.kind == "law"]
    assert Counter(map(family_of, hidden)) == Counter(FAMILIES)
    assert all(one.variant == "laws" for one in cases)


@pytest.mark.parametrize("family", ["library", "memory", "outside"])
def test_one_unit_of_a_law_is_about_the_dry_friction_of_its_joint(family) -> None:
    rng = np.random.default_rng(0)
    made = specimen(2, 200.0, rng)
    for _ in range(20):
        law = draw_law(family, made, 0.01, rng)
        assert DrawnLaw.of(law.to_dict()) == law
        phase = rng.uniform(0, 2 * np.pi, (2, 500))
        q, v = made.amplitude[:, None] * np.sin(phase), made.speed[:, None] * np.cos(phase)
        torque = law.torque(q, v, 5.0, np.sign(v[law.joint]))
        assert np.all(np.isfinite(torque))
        assert np.sqrt(np.mean(torque**2)) < 30 * made.dry[law.joint]


def test_with_a_load_the_law_and_the_rest_make_the_whole() -> None:
    law = DrawnLaw(0, (DrawnFactor("q", 0), DrawnFactor("abs load", 0)), 0.01)
    q, v, total = np.array([[0.5, -0.4]]), np.zeros((1, 2)), np.array([3.0, -2.0])
    found = law.beside(total, q, v, 0.4)
    np.testing.assert_allclose(found, 0.4 * q[0] * np.abs(total - found), rtol=2e-5)


def test_a_lag_follows_what_it_lags() -> None:
    law = DrawnLaw(0, (DrawnFactor("lag", 0, (0.2,)),), 0.01)
    t = np.arange(800) * 0.01
    speed = np.sin(np.pi * t)
    state = law.past(0.01, speed[:, None])
    size, late = 1 / np.hypot(1, 0.2 * np.pi), np.arctan(0.2 * np.pi)
    np.testing.assert_allclose(state, size * np.sin(np.pi * t - late), atol=0.02)


@pytest.mark.slow
def test_the_true_formula_is_marked_as_the_law_and_others_are_not(tmp_path: Path) -> None:
    case = next(c for c in draw_laws(0, 300) if c.kind == "law" and _is_plain(c))
    make(case, tmp_path, TINY)
    (first, second) = load(tmp_path / "study.toml").model.robot.names
    held = HeldOutLaw(tmp_path / "study.toml", {"drawn": V_Q.to_dict(), "amount": 0.5})

    def mark(torque: str, joint: str = second, c: float = 1.0):
        return held.mark(
            {"torque": torque, "joint": joint, "values": {"c": c}, "sigma": {"c": 0.1}}
        )

    right = mark(f"c*v*q[{first}]", c=1.05)
    assert right.joint and right.same_form
    assert right.differs == pytest.approx(0.05, rel=1e-6)
    assert right.errors == pytest.approx((0.5,))
    assert mark("c*v*q").differs > 0.1 and not mark("c*v*q").same_form
    assert not mark(f"c*v[{second}]*q", joint=first).joint
    # What friction of the study's model takes up is no difference.
    assert mark(f"c*v*q[{first}] + c*v").differs < 1e-3
    assert held.mark_rival(f"v*(c1*sin(k*q[{first}]) + c2*cos(k*q[{first}])) at {second} (k = 0.1)")
    assert not held.mark_rival(f"c*v*q at {second}")


def _is_plain(case) -> bool:
    return case.joints == 2 and case.number < 300 and not hasattr(case, "circumstances")
