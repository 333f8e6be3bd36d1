"""Projection onto possible robots: what it keeps, what it does not depend on, what it says."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_trees import random_tree, urdf
from scipy.spatial.transform import Rotation

from chains import COUNTEREXAMPLE, SOLVERS, chain_text, least, noisy_estimate, pseudo
from dynident.errors import FitError
from dynident.fit import (
    Estimate,
    LeastSquares,
    Metric,
    Prior,
    fit,
    given_estimate,
    load_estimate,
    project,
)
from dynident.inertia import frame_change, margins
from dynident.model import Model
from dynident.nlp import Known, ParameterSpace, TotalMass, Within
from dynident.nlp.certificate import OPTIMAL
from dynident.recording import Dataset, Filter, Recording
from dynident.robot import Robot
from dynident.robot.rotations import from_rpy
from synthetic import smooth_motion

QUIET = Filter(None, None, 50.0, edge_s=(0.02, 0.02))


def recorded(robot: Robot, seed: int = 1, noise: float = 0.1, friction: float = 0.2) -> Recording:
    """Torques of a robot with viscous friction, noise relative to each joint's torque."""
    rng = np.random.default_rng([seed, 5])
    t, q, v, a = smooth_motion(robot.n, seed, 200.0, 4.0, 4.0)
    tau = robot.inverse_dynamics(q, v, a) + friction * v
    tau = tau + noise * np.std(tau, axis=0) * rng.normal(size=tau.shape)
    return Recording(t, q, tau, robot.names, period=4.0)


def estimated(robot: Robot, recording: Recording) -> Estimate:
    return fit(Model(robot) + "viscous_friction", Dataset((recording,), QUIET), LeastSquares())


@pytest.fixture(scope="module")
def chain_estimate() -> Estimate:
    """Three links, an impossible estimate."""
    robot = Robot.from_text(chain_text(3))
    estimate = estimated(robot, recorded(robot))
    assert estimate.inconsistent_links()
    return estimate


def links(robot: Robot) -> dict[str, np.ndarray]:
    return {link.name: link.phi for link in robot.links if link.source != "absent"}


# --- what comes out is possible, and says in which sense -----------------------------------------


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize("consistency", ["full", "semi"])
def test_every_link_is_possible_afterwards(chain_estimate, consistency, distance, solver) -> None:
    prior = Prior(chain_estimate.model.robot, distance)
    found = project(chain_estimate, prior, within=Within(consistency), solver=solver)
    for phi in links(found.robot).values():
        assert least(phi, consistency) >= 0
    assert found.certificate.optimal
    assert found.certificate.gap < (1e-8 if solver == "conic" else OPTIMAL)
    assert found.certificate.stationarity < 1e-8
    word = {"full": "fully consistent", "semi": "equation 5"}[consistency]
    assert word in found.certificate.notion and word in str(found.certificate.table())
    if consistency == "full":
        assert not found.estimate.inconsistent_links()
    model = chain_estimate.model
    base = model.base.coordinates(found.robot.theta)
    np.testing.assert_allclose(found.values[: len(base)], base, rtol=1e-9, atol=1e-12)


def test_the_counterexample_is_moved_by_full_consistency_alone() -> None:
    robot = Robot.from_text(chain_text(2))
    broken = robot.with_links({"l1": COUNTEREXAMPLE})
    semi = project(broken, within=Within("semi"))
    np.testing.assert_array_equal(semi.robot.links[2].phi, COUNTEREXAMPLE)
    assert "equation 5" in semi.certificate.notion
    full = project(broken)
    assert "fully" in full.certificate.notion
    moved = full.robot.links[2].phi
    assert np.linalg.eigvalsh(pseudo(moved))[0] >= 0 and margins(moved).consistent
    assert np.linalg.norm(moved - COUNTEREXAMPLE) > 0.1
    np.testing.assert_array_equal(full.robot.links[1].phi, robot.links[1].phi)
    again = project(full, within=Within("semi"))
    np.testing.assert_array_equal(again.x, full.x)


@pytest.mark.parametrize("seed", [3, 8, 12])
def test_links_that_fixed_joints_join_are_each_possible(seed) -> None:
    robot = Robot.from_text(urdf(random_tree(seed, moving=4)))
    joints = [link.joint for link in robot.links if link.joint >= 0]
    assert len(joints) > len(set(joints)), "several links on one body"
    estimate = estimated(robot, recorded(robot, noise=1.0))
    assert estimate.inconsistent_links()
    found = project(estimate)
    assert found.certificate.optimal
    for name, phi in links(found.robot).items():
        assert least(phi, "full") >= -1e-9, name
    # What they are together is what was projected.
    rigid = estimate.model.base.coordinates(found.robot.theta)
    np.testing.assert_allclose(found.values[: len(rigid)], rigid, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("seed", [1, 2, 4, 8])
def test_descriptions_with_broken_links_are_mended_and_the_others_kept(seed) -> None:
    robot = Robot.from_text(urdf(random_tree(seed, moving=4, valid=False)))
    found = project(robot)
    before, after = links(robot), links(found.robot)
    broken = [name for name, phi in before.items() if not margins(phi).consistent]
    assert broken
    for name, phi in after.items():
        assert least(phi, "full") >= -1e-9 and margins(phi).consistent
        if least(before[name], "full") >= 0 and before[name][0] > 0:
            np.testing.assert_array_equal(phi, before[name])
    assert found.certificate.optimal


# --- what is possible already stays --------------------------------------------------------------


def test_projecting_again_changes_nothing(chain_estimate: Estimate) -> None:
    sets = (TotalMass(5.0, 8.0), Known("Fv@j1", 0.25))
    for within in (Within(), Within("semi"), Within("full", sets)):
        once = project(chain_estimate, within=within)
        twice = project(once, within=within)
        np.testing.assert_array_equal(twice.x, once.x)
        assert twice.certificate.optimal and twice.certificate.objective == 0.0
        from_robot = project(once.robot, within=Within(within.consistency))
        for name, phi in links(from_robot.robot).items():
            np.testing.assert_allclose(phi, links(once.robot)[name], rtol=1e-12, atol=1e-14)


def test_a_possible_estimate_comes_back_as_it_is() -> None:
    robot = Robot.from_text(chain_text(3))
    estimate = given_estimate(robot)
    found = project(estimate)
    np.testing.assert_array_equal(found.values, estimate.values)
    assert found.certificate.status.solver == "none" and found.misfit is None
    held = Metric.of_matrix(np.eye(len(estimate.names)), estimate.names, rows=9)
    assert project(estimate, metric=held).misfit == 0.0


# --- what it does not depend on ------------------------------------------------------------------


def in_other_units(text: str) -> str:
    """A chain in mm and g: attributes by their dimension."""

    def scaled(name: str, factor: float):
        def change(match: re.Match[str]) -> str:
            numbers = " ".join(repr(float(x) * factor) for x in match.group(1).split())
            return f'{name}="{numbers}"'

        return change

    for name, factor in (("xyz", 1e3), ("value", 1e3)):
        text = re.sub(rf'\b{name}="([^"]*)"', scaled(name, factor), text)
    text = text.replace('<axis xyz="0.0 0.0 1000.0"/>', '<axis xyz="0 0 1"/>')
    for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        text = re.sub(rf'\b{name}="([^"]*)"', scaled(name, 1e9), text)
    return text


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
@pytest.mark.parametrize("consistency", ["full", "semi"])
def test_units_do_not_matter(consistency, distance) -> None:
    """The same robot in kg, m and in g, mm (torques in g mm^2/s^2)."""
    text = chain_text(3)
    robot = Robot.from_text(text)
    other = Robot.from_text(in_other_units(text), gravity=(0.0, 0.0, -9810.0))
    recording = recorded(robot)
    small = Recording(
        recording.t, recording.q, 1e9 * recording.tau, robot.names, period=recording.period
    )
    found = [
        project(estimated(r, data), Prior(r, distance), within=Within(consistency))
        for r, data in ((robot, recording), (other, small))
    ]
    factor = np.array([1e3, *[1e6] * 3, *[1e9] * 6])
    for name, phi in links(found[0].robot).items():
        size = np.sqrt(np.diag(pseudo(links(robot)[name])))
        there = pseudo(links(found[1].robot)[name] / factor)
        np.testing.assert_allclose(
            there / np.outer(size, size), pseudo(phi) / np.outer(size, size), atol=1e-7
        )
    assert not np.allclose(found[0].x, found[0].x_before), "something moved"
    friction = [one.estimate.effect_values("viscous_friction@j1") for one in found]
    np.testing.assert_allclose(friction[1], 1e9 * friction[0], rtol=1e-7)


def test_the_order_of_joints_does_not_matter() -> None:
    text = chain_text(3)
    found = []
    for names in (("j0", "j1", "j2"), ("j2", "j0", "j1")):
        robot = Robot.from_text(text, joints=names)
        order = [int(name[1]) for name in names]
        data = recorded(Robot.from_text(text))
        data = Recording(data.t, data.q[:, order], data.tau[:, order], names, period=4.0)
        found.append(project(estimated(robot, data)))
    assert found[0].certificate.objective > 0.1
    for name, phi in links(found[0].robot).items():
        np.testing.assert_allclose(links(found[1].robot)[name], phi, rtol=1e-6, atol=1e-8)


def test_the_order_of_links_does_not_matter() -> None:
    """The same elements of the description, the last first."""
    text = chain_text(3)
    robot = Robot.from_text(text)
    root = ET.fromstring(text)
    root[:] = list(root)[::-1]
    whole = Robot.from_text(ET.tostring(root, encoding="unicode"), joints=robot.names)
    data = recorded(robot)
    found = [project(estimated(r, data)) for r in (robot, whole)]
    assert found[0].space.bodies != found[1].space.bodies, "another order"
    for name, phi in links(found[0].robot).items():
        np.testing.assert_allclose(links(found[1].robot)[name], phi, rtol=1e-6, atol=1e-8)


def turned(text: str, link: str, R: np.ndarray) -> str:
    """A chain with the frame of one link turned: its mass, joint axis and child follow."""

    def put(element: ET.Element, xyz: np.ndarray, turn: np.ndarray) -> None:
        element.set("xyz", " ".join(map(repr, map(float, xyz))))
        element.set(
            "rpy", " ".join(map(repr, map(float, Rotation.from_matrix(turn).as_euler("xyz"))))
        )

    def get(element: ET.Element) -> tuple[np.ndarray, np.ndarray]:
        numbers = [np.array(element.get(k, "0 0 0").split(), dtype=float) for k in ("xyz", "rpy")]
        return numbers[0], from_rpy(numbers[1])

    root = ET.fromstring(text)
    for one in root:
        if one.tag == "link" and one.get("name") == link:
            origin = one.find("inertial/origin")
            assert origin is not None
            xyz, turn = get(origin)
            put(origin, R.T @ xyz, R.T @ turn)
        if one.tag == "joint":
            origin, axis, child = one.find("origin"), one.find("axis"), one.find("child")
            parent = one.find("parent")
            assert origin is not None and axis is not None
            assert child is not None and parent is not None
            xyz, turn = get(origin)
            if child.get("link") == link:
                put(origin, xyz, turn @ R)
                direction = R.T @ np.array(axis.get("xyz", "").split(), dtype=float)
                axis.set("xyz", " ".join(map(repr, map(float, direction))))
            elif parent.get("link") == link:
                put(origin, R.T @ xyz, R.T @ turn)
    return ET.tostring(root, encoding="unicode")


def test_the_axes_of_a_link_do_not_matter() -> None:
    R = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    R = R * np.linalg.det(R)
    text = chain_text(3)
    robot, other = Robot.from_text(text), Robot.from_text(turned(text, "l1", R))
    data = recorded(robot)
    motion = robot.random_motion(0, 3)
    np.testing.assert_allclose(
        other.inverse_dynamics(*motion), robot.inverse_dynamics(*motion), atol=1e-9
    )
    found = [project(estimated(r, data)) for r in (robot, other)]
    back = frame_change(R, np.zeros(3))
    for name, phi in links(found[0].robot).items():
        there = links(found[1].robot)[name]
        there = back @ there if name == "l1" else there
        np.testing.assert_allclose(there, phi, rtol=1e-6, atol=1e-7)
    assert np.linalg.norm(found[0].robot.links[2].phi - robot.links[2].phi) > 1e-3


# --- the metric ----------------------------------------------------------------------------------


def test_the_metric_of_an_estimate_is_that_of_its_data(chain_estimate: Estimate) -> None:
    robot = chain_estimate.model.robot
    data = Dataset((recorded(robot),), QUIET)
    one = Metric.of_estimate(chain_estimate)
    other = Metric.of_data(chain_estimate.model, data)
    assert one.rank == other.rank == len(chain_estimate.basis.independent)
    size = np.sqrt(np.diag(other.matrix))
    # The covariance is scaled by the residual once more: of weighted equations, nearly one.
    np.testing.assert_allclose(
        one.matrix / np.outer(size, size), other.matrix / np.outer(size, size), atol=0.05
    )
    a, b = (project(chain_estimate, metric=m) for m in (one, other))
    np.testing.assert_allclose(a.values, b.values, atol=0.05 * np.max(np.abs(a.values)))
    assert a.misfit == pytest.approx(b.misfit, rel=0.1)


def test_a_full_metric_over_all_standard_parameters() -> None:
    """Of full rank, what is nearest is the same whatever the prior believes."""
    model, _, x_hat = noisy_estimate(3, 1, 0.1, 100)
    space = ParameterSpace.of(model)
    rows = np.random.default_rng(0).normal(size=(60, space.size)) / space.scale * 1e4
    metric = Metric.of_matrix(rows.T @ rows, space.names, rows=60)
    estimate = given_estimate(model.robot, model)
    bodies = {f"l{k}": x_hat[10 * k : 10 * k + 10] for k in range(3)}
    values = np.concatenate([model.base.coordinates(x_hat[:30]), x_hat[30:]])
    estimate = replace(estimate, links=bodies, values=values)
    found = project(estimate, metric=metric)
    other = project(estimate, Prior(model.robot, "quadratic", 3.0), metric)
    np.testing.assert_allclose(found.x, other.x, atol=1e-5)
    assert found.misfit is not None and found.misfit > 0
    assert "of the noise" in str(found.changes())
    step = rows @ (found.x - x_hat)
    assert found.misfit == pytest.approx(np.linalg.norm(step) / np.sqrt(60), rel=1e-6)


def test_input_noise_comes_off_the_metric() -> None:
    """X'X of rows with noise is X'X without, plus N Psi: that is taken off again."""
    rng = np.random.default_rng(2)
    names = ("a", "b", "c")
    clean = rng.normal(size=(20000, 3)) * [1.0, 0.5, 2.0]
    Psi = np.diag([0.3, 0.0, 0.1])
    noisy = clean + rng.normal(size=clean.shape) * np.sqrt(np.diag(Psi))
    metric = Metric.of_matrix(noisy.T @ noisy, names, noise_std=0.1, rows=len(clean))
    corrected = metric.corrected(len(clean) * Psi / 0.1**2)
    want = clean.T @ clean / 0.1**2
    np.testing.assert_allclose(corrected.matrix, want, atol=0.02 * np.max(want))
    assert abs(metric.matrix[0, 0] / want[0, 0] - 1.3) < 0.02, "it was there"
    assert not corrected.notes and "less input noise" in corrected.source


def test_more_noise_than_signal_is_noted_and_leaves_the_rest_alone() -> None:
    M = np.array([[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 4.0]])
    metric = Metric.of_matrix(M, ("a", "b", "c"))
    for taken in (1.0 - 1e-12, 1.0, 1.5, 10.0):
        left = metric.corrected(np.diag([taken, 0.0, 0.0]))
        assert "1 of 3 directions" in left.notes[0] and "prior decides" in left.notes[0]
        assert np.linalg.eigvalsh(left.matrix)[0] >= -1e-12
        assert left.matrix[2, 2] == pytest.approx(4.0)
        assert left.matrix[1, 1] == pytest.approx(1.0, abs=0.02)
        assert left.matrix[0, 0] < 0.02
    with pytest.raises(FitError, match="N Psi"):
        metric.corrected(np.eye(2))


def test_what_is_irrelevant_stays_at_zero(chain_estimate: Estimate) -> None:
    names = chain_estimate.names
    off = ("Fv@j1", next(n for n in names if n.startswith("Ixy")))
    weights = [0.0 if name in off else 1.0 for name in names]
    metric = Metric.of_estimate(chain_estimate).weighted(weights)
    assert metric.irrelevant == tuple(n for n in names if n in off)
    found = project(chain_estimate, metric=metric)
    for name in off:
        assert abs(chain_estimate.value(name)) > 1e-3
        assert found.estimate.value(name) == pytest.approx(0.0, abs=1e-9)
    assert found.certificate.optimal and not found.estimate.inconsistent_links()
    assert any("kept at zero" in note for note in found.notes)
    for wrong in (np.ones(2), -np.ones(len(names)), np.full(len(names), np.nan)):
        with pytest.raises(FitError, match="relevance"):
            Metric.of_estimate(chain_estimate).weighted(wrong)


@pytest.mark.parametrize(
    ("M", "words"),
    [
        (np.eye(3), r"shape \(3, 3\) does not fit 2"),
        (np.array([[1.0, np.nan], [np.nan, 1.0]]), "does not fit"),
        (np.array([[1.0, 0.5], [0.0, 1.0]]), "not symmetric"),
        (np.array([[1.0, 2.0], [2.0, 1.0]]), "negative direction.*X'X"),
        (np.diag([1.0, -1.0]), "negative direction"),
    ],
)
def test_matrices_that_are_no_metric_are_refused(M, words) -> None:
    with pytest.raises(FitError, match=words):
        Metric.of_matrix(M, ("a", "b"))


def test_metrics_of_something_else_are_refused(chain_estimate: Estimate) -> None:
    p = len(chain_estimate.names)
    others = tuple(f"x{k}" for k in range(p))
    for metric in (Metric.of_matrix(np.eye(2), ("a", "b")), Metric.of_matrix(np.eye(p), others)):
        with pytest.raises(FitError, match="not those of the estimate"):
            project(chain_estimate, metric=metric)
    with pytest.raises(FitError, match="no covariance"):
        Metric.of_estimate(given_estimate(chain_estimate.model.robot))
    with pytest.raises(FitError, match="noise_std"):
        Metric.of_matrix(np.eye(2), ("a", "b"), noise_std=0.0)


# --- the prior -----------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", ["quadratic", "entropic"])
def test_a_narrow_prior_wins_and_a_wide_one_follows_the_data(chain_estimate, distance) -> None:
    robot = chain_estimate.model.robot
    x_robot = ParameterSpace.of(chain_estimate.model)
    moved, misfit = [], []
    for spread in (1e-3, 0.3, 30.0):
        found = project(chain_estimate, Prior(robot, distance, spread))
        assert found.certificate.optimal and not found.estimate.inconsistent_links()
        centre = x_robot.references if distance == "entropic" else x_robot.given[:30]
        moved.append(np.linalg.norm(found.x[:30] - centre.ravel()))
        misfit.append(found.misfit)
    assert moved[0] < 0.05 < moved[1] < moved[2]
    assert misfit[0] > misfit[1] > misfit[2]


def test_an_impossible_prior_is_replaced_and_said_so(chain_estimate: Estimate) -> None:
    robot = chain_estimate.model.robot
    found = project(chain_estimate, robot.with_links({"l1": -robot.links[2].phi}))
    assert any("impossible: l1" in note for note in found.notes)
    assert not found.estimate.inconsistent_links()
    with pytest.raises(FitError, match="quadratic or entropic"):
        Prior(robot, "euclidean")  # type: ignore[arg-type]
    for spread in (0.0, np.inf, np.nan):
        with pytest.raises(FitError, match="spread"):
            Prior(robot, spread=spread)
    with pytest.raises(FitError, match="other joints or links"):
        project(chain_estimate, Robot.from_text(chain_text(2)))


def test_without_data_both_distances_are_the_same_and_keep_to_the_broken_link() -> None:
    robot = Robot.from_text(chain_text(3))
    broken = robot.with_links({"l1": robot.links[2].phi * np.array([1, 1, 1, 1, 1, 1, 1, 1, 1, 9])})
    found = [project(broken, Prior(robot, d)) for d in ("quadratic", "entropic")]
    np.testing.assert_allclose(found[0].x, found[1].x, rtol=1e-9)
    for name in ("l0", "l2"):
        np.testing.assert_array_equal(links(found[0].robot)[name], links(robot)[name])
    assert least(links(found[0].robot)["l1"], "full") >= 0
    assert found[0].metric is None and "No data" in found[0].notes[0]


def test_what_is_not_a_number_has_no_neighbour() -> None:
    robot = Robot.from_text(chain_text(2))
    with pytest.raises(FitError, match=r"m\.l1.*not finite"):
        project(robot.with_links({"l1": np.full(10, np.nan)}))


# --- what is handed on ---------------------------------------------------------------------------


def test_projections_are_saved_loaded_and_written(chain_estimate, tmp_path: Path) -> None:
    found = project(chain_estimate)
    loaded = load_estimate(found.estimate.save(tmp_path / "estimate.json"))
    assert loaded.links is not None and set(loaded.links) == set(links(found.robot))
    for name, phi in links(found.robot).items():
        np.testing.assert_array_equal(loaded.links[name], phi)
        np.testing.assert_array_equal(links(loaded.robot)[name], phi)
    np.testing.assert_array_equal(loaded.values, found.values)
    np.testing.assert_array_equal(project(loaded).x, found.x)
    written = Robot.from_file(found.write_robot(tmp_path / "robot.urdf"))
    motion = written.random_motion(3, 20)
    want = found.robot.inverse_dynamics(*motion)
    got = written.inverse_dynamics(*motion)
    np.testing.assert_allclose(got, want, atol=1e-10 * np.max(np.abs(want)))
    assert all(margins(phi).consistent for phi in links(written).values())


def test_the_covariance_of_a_projection_holds_what_is_active(chain_estimate: Estimate) -> None:
    found = project(chain_estimate, within=Within("full", (Known("Fv@j1", 0.25),)))
    covariance = found.estimate.covariance
    values = np.linalg.eigvalsh(covariance)
    assert values[0] >= -1e-12 * values[-1]
    index = found.estimate.names.index("Fv@j1")
    np.testing.assert_allclose(covariance[index], 0.0, atol=1e-15)
    free = np.diag(chain_estimate.covariance)
    identified = chain_estimate.identified
    assert np.all(np.diag(covariance)[identified] <= free[identified] * (1 + 1e-6)), "more is known"
    assert any("on the boundary" in note for note in found.notes)


def test_tables_and_json_tell_the_same(chain_estimate: Estimate, capsys) -> None:
    found = project(chain_estimate)
    found.show()
    printed = capsys.readouterr().out
    content = json.loads(json.dumps(found.to_dict()))
    assert content["certificate"]["optimal"] is True
    for link in content["links"]:
        assert link["name"] in printed
        assert link["was_consistent"] == margins(np.array(link["before"])).consistent
        assert margins(np.array(link["after"])).consistent
    assert "lower bound" in printed and "This is the optimum" in printed
    with pytest.raises(FitError, match="conic or nlp"):
        project(chain_estimate, solver="simplex")  # type: ignore[arg-type]
