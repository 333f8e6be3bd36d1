"""Given parameters made consistent: what moves, what stays, and what is written."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from random_trees import mjcf, random_tree, sdf, urdf

import dynident as di
from dynident.errors import DynidentWarning, FileError, FitError, RobotError
from dynident.inertia import from_com, margins
from dynident.refitting import read_subject
from dynident.robot import Robot
from study_files import STUDY, edited, write_study
from synthetic import ARM, arm

WRITERS = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}
BROKEN = ARM.replace('ixx="0.01"', 'ixx="0.3"')
"""The upper link's moment about x exceeds the sum of the others: the arm's motion is the same."""
FRICTION = edited(('["viscous_friction"]', '["viscous_friction", "coulomb_friction@elbow"]'))


def consistent(robot: Robot) -> bool:
    return all(margins(link.phi).consistent for link in robot.links)


def phis(robot: Robot) -> dict[str, np.ndarray]:
    return {link.name: link.phi for link in robot.links}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    write_study(folder, FRICTION)
    (folder / "broken.urdf").write_text(BROKEN)
    return folder


@pytest.fixture(scope="module")
def study(folder):
    return di.load(folder / "study.toml")


@cache
def broken_tree(writer, seed: int) -> Robot:
    return Robot.from_text(writer(random_tree(seed, moving=4, valid=False)))


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_written_robots_are_consistent_and_move_as_they_were_projected(writer, seed, tmp_path):
    """Links of broken trees, also several on one moving body; comments and the rest untouched."""
    robot = broken_tree(writer, seed)
    assert not consistent(robot)
    found = di.refit(robot)
    told = found.write_robot(tmp_path / "out.xml")
    assert told.notion == "full" and told.drake == "own parser"
    reloaded = Robot.from_file(tmp_path / "out.xml", robot.names)
    assert consistent(reloaded)
    motion = robot.random_motion(1, 20)
    want = found.projection.robot.inverse_dynamics(*motion)
    assert np.max(np.abs(reloaded.inverse_dynamics(*motion) - want)) < 1e-10 * np.max(np.abs(want))
    old, new = phis(robot), phis(reloaded)
    for name, phi in old.items():
        massless = phi[0] == 0 and np.any(phi)  # an inertia, but no mass: that cannot be
        if margins(phi).consistent and not massless:
            np.testing.assert_array_equal(new[name], phi)
        if massless:
            assert new[name][0] > 0
            np.testing.assert_allclose(new[name][4:], phi[4:], atol=1e-6)
            assert name in " ".join(found.notes)
    assert found.projection.certificate.optimal
    assert di.refit(tmp_path / "out.xml").unchanged


def test_one_absurd_link_does_not_blur_the_others():
    """Without data nothing couples links: each is moved as if it were alone."""
    alone = Robot.from_text(BROKEN)
    absurd = alone.with_links({"fore": [2, 0, 0, 0, -1e6, 0, 1, 0, 0, 1e7]})
    for solver in ("conic", "nlp"):
        found = di.project(absurd, solver=solver)
        assert found.certificate.optimal
        one = phis(di.project(alone, solver=solver).robot)["upper"]
        np.testing.assert_allclose(phis(found.robot)["upper"], one, rtol=1e-9)


def test_only_the_inertial_element_of_the_broken_link_is_touched(tmp_path):
    text = BROKEN.replace("<link", "<!-- mine --><link").replace("</inertial>", "</inertial >")
    text = text.replace(
        "</inertial >", '</inertial><visual><geometry><mesh filename="a.stl"/></geometry></visual>'
    )
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    found = di.refit(path)
    assert found.sentence == "Made fully consistent: 1 of 2 links moved."
    found.write_robot(path)
    begin, end = text.index("<inertial>"), text.index("</inertial>")
    new = path.read_text()
    assert new[:begin] == text[:begin] and new.endswith(text[end:])
    assert consistent(Robot.from_file(path))


def test_the_weaker_notion_is_told(tmp_path):
    """Equation 5 allows what the triangle inequality forbids; the file says which one it is."""
    path = tmp_path / "arm.urdf"
    path.write_text(BROKEN)
    found = di.refit(path, within=di.constraints.Within("semi"))
    assert found.unchanged and found.sentence.endswith("is semi-consistent already.")
    told = found.write_robot(tmp_path / "out.urdf")
    assert told.notion == "semi" and told.semi_only == ("upper",)
    assert "triangle" in found.projection.certificate.notion
    with pytest.raises(FitError, match="choose full or semi"):
        di.refit(path, within=di.constraints.Within("none"))


@pytest.mark.parametrize("solver", ["conic", "nlp"])
def test_data_decide_what_moves(study, folder, solver):
    """A moment that no motion shows is mended for nothing: the torque stays what it was."""
    found = di.refit(folder / "broken.urdf", study, solver=solver)
    assert not found.unchanged and consistent(found.robot)
    assert found.errors is not None and found.errors.recordings == "test"
    given, free, now = (result.error for result in found.errors.comparison.results)
    assert now < 1.02 * given and now < 1.02 * free
    effects = dict(
        zip(found.projection.estimate.names[-3:], found.projection.values[-3:], strict=True)
    )
    assert abs(effects["Fv@shoulder"] - 2.0) < 0.1 and abs(effects["Fc@elbow"] - 1.5) < 0.1
    assert "recordings" in found.projection.to_dict()["metric"]


def test_effects_that_are_not_given_are_fitted_within_their_bounds(study, folder, tmp_path):
    """The true arm comes back as it is: its friction is found beside it."""
    found = di.refit(folder / "arm.urdf", study)
    assert found.unchanged
    assert found.write_robot(tmp_path / "a.urdf").unchanged
    values = dict(zip(found.projection.estimate.names, found.projection.values, strict=True))
    assert abs(values["Fv@elbow"] - 1.0) < 0.05 and abs(values["Fc@elbow"] - 1.5) < 0.05
    heavy = ARM.replace('mass value="4"', 'mass value="12"')
    given = di.refit(Robot.from_text(heavy), study).projection.x_before
    assert np.all(given[20:] >= 0)


@pytest.mark.slow
def test_an_estimate_keeps_what_it_knows(study, folder):
    estimate = di.fit(study.model, study.train)
    estimate.save(folder / "fit.json")
    for what in (estimate, folder / "fit.json"):
        alone = di.refit(what)
        assert consistent(alone.robot)
        metric = alone.projection.metric
        assert metric is not None and metric.source == "covariance of the estimate"
        beside = di.refit(what, study)
        np.testing.assert_array_equal(beside.projection.x_before[-3:], estimate.values[-3:])
        np.testing.assert_allclose(
            beside.projection.values, alone.projection.values, rtol=1e-2, atol=1e-2
        )
    fewer = di.fit(di.Model(study.robot) + "torque_offset" + "viscous_friction", study.train)
    with pytest.warns(DynidentWarning, match="torque_offset@shoulder, torque_offset@elbow; their"):
        beside = di.refit(fewer, study)
    assert beside.projection.x_before[20] == fewer.value("Fv@shoulder")


def test_what_is_written_is_the_given_description_also_where_another_is_believed(folder, tmp_path):
    text = BROKEN.replace("</robot>", "<!-- mine --></robot>")
    (tmp_path / "mine.urdf").write_text(text)
    believed = Robot.from_text(ARM.replace('mass value="2"', 'mass value="2.5"'))
    found = di.refit(tmp_path / "mine.urdf", prior=believed)
    found.write_robot(tmp_path / "out.urdf")
    assert (tmp_path / "out.urdf").read_text().endswith("<!-- mine --></robot>")
    np.testing.assert_array_equal(phis(found.robot)["fore"], phis(arm())["fore"])


def test_joints_in_the_order_of_the_study(folder, tmp_path):
    text = edited(('["shoulder", "elbow"]', '["elbow", "shoulder"]'), text=FRICTION)
    path = folder / "turned.toml"
    path.write_text(text)
    one = di.refit(folder / "broken.urdf", di.load(folder / "study.toml"))
    other = di.refit(folder / "broken.urdf", di.load(path))
    for name, phi in phis(one.robot).items():
        np.testing.assert_allclose(phis(other.robot)[name], phi, rtol=1e-4, atol=1e-6)
    assert other.write_robot(tmp_path / "o.urdf").pinocchio == "own parser"


def test_without_test_recordings(folder):
    path = folder / "alone.toml"
    path.write_text(STUDY[: STUDY.rindex("[[recordings]]")])
    found = di.refit(folder / "broken.urdf", di.load(path))
    assert found.errors is not None and found.errors.recordings == "training"
    assert "on the training recordings" in found.errors.table().title


def test_a_list_of_numbers(study, folder, tmp_path):
    rows = [f"{name},{','.join(map(repr, phi.tolist()))}" for name, phi in phis(arm()).items()]
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(["link,m,mx,my,mz,Ixx,Ixy,Iyy,Ixz,Iyz,Izz", *rows[1:]]))
    given = di.fitting.read_parameters(path, Robot.from_text(BROKEN))
    assert di.refit(given).unchanged and di.refit(path, study).unchanged
    assert di.refit(path, prior=Robot.from_text(BROKEN)).unchanged
    assert consistent(di.refit(given).robot)
    with pytest.raises(FileError, match=r"mine.csv: is taken for a CSV of .* give the description"):
        di.refit(path)
    with pytest.raises(FileError, match=r"broken.urdf: is no CSV file.* leave out the order"):
        read_subject(folder / "broken.urdf", None, "paper")


def test_what_is_no_number_has_nothing_near(tmp_path, study):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.replace('izz="0.06"', 'izz="nan"'))
    for data in (None, study):
        with pytest.raises(RobotError, match=r"arm.urdf: link 'upper': .*\(Izz = nan\).* nothing"):
            di.refit(path, data)


def test_another_robot_is_refused(study, tmp_path):
    names = ARM.replace("shoulder", "hip")
    with pytest.raises(RobotError, match=r"no moving joint 'shoulder'"):
        di.refit(Robot.from_text(names), study)
    longer = ARM.replace('origin xyz="0.4 0 0"', 'origin xyz="0.5 0 0"')
    with pytest.raises(FitError, match="other kinematics"):
        di.refit(Robot.from_text(longer), study)


def test_several_links_on_one_body_each_become_possible(tmp_path):
    """The sum of two links is a possible body, one of them alone is not."""
    text = BROKEN.replace(
        "</robot>",
        """<link name="tool"><inertial><mass value="1"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
        <joint name="weld" type="fixed"><parent link="upper"/><child link="tool"/></joint></robot>
        """,
    )
    robot = Robot.from_text(text).with_links(
        {"tool": from_com(-0.1, [0.1, 0, 0], np.diag([0.001, 0.001, 0.001]))}
    )
    found = di.refit(robot)
    told = found.write_robot(tmp_path / "a.urdf")
    assert told.notion == "full" and told.links == 4
    assert consistent(Robot.from_file(tmp_path / "a.urdf"))


def test_bodies_beyond_the_shapes_of_their_links_are_told() -> None:
    text = (
        '<robot name="one"><link name="base"/><link name="rod"><inertial>'
        '<origin xyz="0.15 0 0"/><mass value="2"/>'
        '<inertia ixx="2e6" ixy="0" ixz="0" iyy="2e7" iyz="0" izz="2e7"/></inertial>'
        '<visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.06 0.06"/></geometry></visual>'
        '</link><joint name="j" type="revolute"><parent link="base"/><child link="rod"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
    )
    found = di.refit(Robot.from_text(text))
    assert found.unchanged
    assert any("rod" in note and "units" in note for note in found.notes)
    # Semi-consistent is less than possible as a body.
    flat = text.replace('iyy="2e7"', 'iyy="1e6"')
    for one in (text, flat):
        semi = di.refit(Robot.from_text(one), within=di.constraints.Within("semi"))
        assert semi.unchanged and not any("Possible" in note for note in semi.notes)
    # Shapes a little too small for the mass are nothing to mend, and nothing to tell.
    simplified = text.replace("2e6", "0.02").replace("2e7", "0.2")
    found = di.refit(Robot.from_text(simplified))
    assert found.unchanged and not found.notes
