"""Projection onto possible robots: what it changes, what it keeps and what it hands on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from random_trees import random_tree, urdf

from chains import (
    COUNTEREXAMPLE,
    SOLVERS,
    chain_text,
    estimated,
    least,
    links,
    pseudo,
    recorded,
)
from dynident.constraints import Known, ParameterSpace, TotalMass, Within
from dynident.errors import FitError
from dynident.fitting import Estimate, Metric, Prior, given_estimate, load_estimate, project
from dynident.inertia import margins
from dynident.nlp.certificate import OPTIMAL
from dynident.robot import Robot

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
    if solver == "conic":  # of a nonlinear program the gap is what counts: flat bodies are far
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
