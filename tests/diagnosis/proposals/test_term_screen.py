"""What the screening of terms says, beside plain regressions of the same rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.diagnosis.proposals.term_library import Factor, LibraryTerm, extended, library
from dynident.diagnosis.proposals.term_screen import screen
from dynident.model import Model
from dynident.robot import Robot
from laws_hidden import MODEL, recordings, searched, with_law
from synthetic import ARM

ELBOW = 1
V, Q = Factor("motion", ("{v}",)), Factor("position", ("{q}",))
WAVE = Factor("position", ("sin({shape}*{q})", "cos({shape}*{q})"), None, ("k", 2.0, 1.0, 3.0))
FAR = Factor("motion", ("{v}^2",), "shoulder")
FAR_WAVE = replace(WAVE, joint="shoulder", shape=("k", 3.0, 2.0, 4.0))
TERMS = (
    *(LibraryTerm(one) for one in ((V, Q), (V, WAVE), (Q, FAR), (FAR,))),
    *extended([LibraryTerm((V, WAVE))], [FAR_WAVE]),
)
LAW = {"c*v*q": 0.5}


@pytest.fixture(scope="module")
def made():
    return recordings(LAW)


def drops(made, model: Model = MODEL, terms=TERMS, joint: int = ELBOW):
    search, fitted = searched(made, model)
    found = screen(search.evidence, fitted, joint, terms)
    return {one.term: one.drop for one in found}


def test_the_drop_is_that_of_least_squares_with_the_columns(made) -> None:
    search, fitted = searched(made)
    found = {one.term: one.drop for one in screen(search.evidence, fitted, ELBOW, TERMS)}
    assert len(found) >= 2
    of_q_and_v = {
        TERMS[0]: lambda q, v: [v[:, 1] * q[:, 1]],
        TERMS[1]: lambda q, v: [v[:, 1] * np.sin(2 * q[:, 1]), v[:, 1] * np.cos(2 * q[:, 1])],
        TERMS[2]: lambda q, v: [q[:, 1] * v[:, 0] ** 2],
        TERMS[3]: lambda q, v: [v[:, 0] ** 2],
        TERMS[4]: lambda q, v: [
            v[:, 1] * one(2 * q[:, 1]) * other(3 * q[:, 0])
            for one in (np.sin, np.cos)
            for other in (np.sin, np.cos)
        ],
    }
    for term, drop in found.items():
        x, y, c = [], [], []
        for stack, known in zip(search.evidence.stacks, fitted.white, strict=True):
            columns = [
                [[np.stack(of_q_and_v[term](one.q, one.v), axis=1)] for one in run.replicates]
                for run in stack.runs
            ]
            for joint in range(2):
                rows = known[joint].dense().reshape(-1, len(fitted.values) + 1)
                x, y = [*x, rows[:, :-1]], [*y, rows[:, -1]]
                white = stack.unfolded(stack.whitened(columns, joint, fitted.noise[joint]))
                c.append((joint == ELBOW) * white.reshape(len(rows), -1))
        x, y, c = np.concatenate(x), np.concatenate(y), np.concatenate(c)
        without, with_ = (_left(one, y) for one in (x, np.hstack([x, c])))
        # Positions without noise are one in all repetitions; only that of the torque differs.
        assert drop == pytest.approx(without - with_, rel=0.02)


def _left(columns: np.ndarray, y: np.ndarray) -> float:
    scale = np.linalg.norm(columns, axis=0)
    used = columns[:, scale > 0] / scale[scale > 0]
    return float(np.sum((y - used @ np.linalg.lstsq(used, y, rcond=1e-10)[0]) ** 2))


def test_the_unit_of_torque_does_not_matter(made) -> None:
    robot = MODEL.robot
    small = Model(robot.with_theta(robot.theta * 1e-3)) + "viscous_friction" + "coulomb_friction"
    scaled = [one.replace(tau=1e-3 * one.tau) for one in made]
    terms = tuple(one for one in library(robot, "elbow")[::7] if not one.of_session)
    found, other = drops(made, terms=terms), drops(scaled, small, terms)
    assert len(found) > 20
    assert found.keys() == other.keys()
    for term, drop in found.items():
        assert other[term] == pytest.approx(drop, rel=1e-4)


def test_the_order_of_the_joints_does_not_matter(made) -> None:
    robot = Robot.from_text(ARM, joints=("elbow", "shoulder"))
    model = Model(robot) + "viscous_friction" + "coulomb_friction"
    turned = [
        one.replace(q=one.q[:, ::-1], tau=one.tau[:, ::-1], joints=robot.names) for one in made
    ]
    found, other = drops(made), drops(turned, model, joint=robot.names.index("elbow"))
    assert found.keys() == other.keys()
    for term, drop in found.items():
        assert other[term] == pytest.approx(drop, rel=1e-4)


def test_what_the_model_has_is_not_screened_again(made) -> None:
    own = TERMS[0]
    assert own in drops(made)
    assert own not in drops(made, with_law(MODEL, "c*v*q"))
    assert LibraryTerm((V,)) not in drops(made, terms=(LibraryTerm((V,)),))
