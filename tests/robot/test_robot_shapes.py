"""Shapes of links in three formats: the convex hull that holds them, and little more."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from broken_robots import WRITERS, Fore, text
from dynident.errors import FileError
from dynident.robot import Description
from dynident.robot.formats.elements import from_rpy
from dynident.robot.geometry import LinkGeometry, link_geometry
from dynident.robot.hull import Hull
from dynident.robot.meshes import find_mesh, mesh_points

P, RPY = np.array([0.1, -0.2, 0.3]), np.array([0.4, -0.5, 0.6])
R = from_rpy(RPY)


def geometry(format_: str, shapes: str, path="robot", rest="") -> LinkGeometry:
    fore = Fore(shapes=shapes, rest=rest)
    return link_geometry(Description(str(path), format_, WRITERS[format_](fore)))["fore"]


def urdf_shape(inner: str) -> str:
    return (
        f'<collision><origin xyz="{text(P)}" rpy="{text(RPY)}"/><geometry>{inner}</geometry>'
        "</collision>"
    )


def sdf_shape(inner: str) -> str:
    return (
        f'<visual name="v"><pose>{text(P)} {text(RPY)}</pose><geometry>{inner}</geometry></visual>'
    )


def mjcf_shape(kind: str, *size: float) -> str:
    # Angles about fixed axes x, y, z, as in URDF: three elementary quaternions.
    q = np.array([1.0, 0, 0, 0])
    for axis, angle in enumerate(RPY):
        p = np.array([np.cos(angle / 2), 0, 0, 0])
        p[1 + axis] = np.sin(angle / 2)
        q = np.array(
            [p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))]
        )
    return f'<geom type="{kind}" size="{text(size)}" pos="{text(P)}" quat="{text(q)}"/>'


a, b, c = 0.3, 0.2, 0.1
SHAPES = {
    "box": (
        urdf_shape(f'<box size="{2 * a} {2 * b} {2 * c}"/>'),
        sdf_shape(f"<box><size>{2 * a} {2 * b} {2 * c}</size></box>"),
        mjcf_shape("box", a, b, c),
        lambda d: np.abs(d) @ [a, b, c],
        1.0001,
    ),
    "sphere": (
        urdf_shape(f'<sphere radius="{a}"/>'),
        sdf_shape(f"<sphere><radius>{a}</radius></sphere>"),
        mjcf_shape("sphere", a),
        lambda d: a + 0 * d[:, 0],
        1.05,
    ),
    "ellipsoid": (
        urdf_shape(f'<drake:ellipsoid a="{a}" b="{b}" c="{c}"/>'),
        sdf_shape(f"<ellipsoid><radii>{a} {b} {c}</radii></ellipsoid>"),
        mjcf_shape("ellipsoid", a, b, c),
        lambda d: np.linalg.norm(d * [a, b, c], axis=1),
        1.05,
    ),
    "cylinder": (
        urdf_shape(f'<cylinder radius="{a}" length="{2 * b}"/>'),
        sdf_shape(f"<cylinder><radius>{a}</radius><length>{2 * b}</length></cylinder>"),
        mjcf_shape("cylinder", a, b),
        lambda d: a * np.hypot(d[:, 0], d[:, 1]) + b * np.abs(d[:, 2]),
        1.01,
    ),
    "capsule": (
        urdf_shape(f'<capsule radius="{a}" length="{2 * b}"/>'),
        sdf_shape(f"<capsule><radius>{a}</radius><length>{2 * b}</length></capsule>"),
        mjcf_shape("capsule", a, b),
        lambda d: a + b * np.abs(d[:, 2]),
        1.05,
    ),
}


@pytest.mark.parametrize(("urdf", "sdf", "mjcf", "reach", "slack"), SHAPES.values(), ids=SHAPES)
def test_the_hull_holds_the_shape_and_little_more(urdf, sdf, mjcf, reach, slack):
    """In every direction it reaches as far as the shape, or a few per cent farther."""
    directions = np.random.default_rng(0).normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    exact = reach(directions @ R)
    for format_, shapes in (("urdf", urdf), ("sdf", sdf), ("mjcf", mjcf)):
        found = geometry(format_, shapes)
        assert not found.not_read
        _, high = Hull(found.points - P).reach(directions)
        assert np.all(high >= exact * (1 - 1e-12)), format_
        assert np.all(high <= exact * slack), format_


def test_visual_and_collision_both_count():
    near = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
    far = '<collision><origin xyz="1 0 0"/><geometry><sphere radius="0.1"/></geometry></collision>'
    assert Hull(geometry("urdf", near + far).points).depth(np.array([0.5, 0, 0])) > 0.09


def test_a_shape_that_cannot_be_read_hides_no_other():
    shapes = '<geom type="box" fromto="0 0 0 1 0 0" size="1 1"/><geom type="sphere" size="0.1"/>'
    found = geometry("mjcf", shapes)
    assert found.not_read == ("shape 'box' between two points",)
    assert len(found.points) and np.abs(found.points).max() < 0.11


def test_directions_of_any_length_are_directions():
    plain = geometry("mjcf", '<geom type="cylinder" size="0.1 0.2" quat="1 0 0.5 0"/>')
    huge = geometry("mjcf", '<geom type="cylinder" size="0.1 0.2" quat="2e200 0 1e200 0"/>')
    np.testing.assert_allclose(huge.points, plain.points, atol=1e-12)


def test_mjcf_defaults_capsules_between_points_and_meshes(tmp_path):
    rest = (
        '<default><geom type="capsule" size="0.1"/><mesh scale="0.001 0.001 0.001"/></default>'
        '<asset><mesh file="parts/plate.obj"/></asset><compiler meshdir="meshes"/>'
    )
    shapes = '<geom fromto="0 0 0 1 0 0"/><geom type="mesh" mesh="plate" pos="0 0 5"/>'
    folder = tmp_path / "meshes" / "parts"
    folder.mkdir(parents=True)
    (folder / "plate.obj").write_text("v 0 0 0\nv 1000 0 0\nv 0 2000 0\nf 1 2 3\n")
    found = geometry("mjcf", shapes, tmp_path / "arm.xml", rest)
    assert not found.not_read and found.meshes == ("meshes/parts/plate.obj",)
    low, high = Hull(found.points).reach(np.eye(3))
    np.testing.assert_allclose(low, [-0.1, -0.1, -0.1], atol=0.005)
    np.testing.assert_allclose(high, [1.1, 2.0, 5.0], atol=0.005)


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], dtype=float)
FACES = CORNERS[[[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]]


def stl_binary() -> bytes:
    head = b"solid looks like text".ljust(80) + struct.pack("<I", len(FACES))
    return head + b"".join(struct.pack("<12fH", 0, 0, 0, *face.ravel(), 0) for face in FACES)


def stl_text() -> bytes:
    corners = "".join(f"vertex {text(corner)}\n" for corner in FACES.reshape(-1, 3))
    return f"solid s\nfacet normal 0 0 0\nouter loop\n{corners}endloop\nendsolid".encode()


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.stl", stl_binary()),
        ("b.STL", stl_text()),
        ("c.obj", "".join(f"v {text(corner)}\n" for corner in CORNERS).encode()),
    ],
)
def test_meshes_are_found_and_read(name, data, tmp_path):
    package = tmp_path / "my_robot"
    (package / "meshes").mkdir(parents=True)
    (package / "meshes" / name).write_bytes(data)
    (package / "urdf").mkdir()
    for uri in (
        f"package://my_robot/meshes/{name}",
        f"model://my_robot/meshes/{name}",
        f"../meshes/{name}",
        f"file://{package}/meshes/{name}",
    ):
        shape = urdf_shape(f'<mesh filename="{uri}" scale="0.1 0.1 0.1"/>')
        found = geometry("urdf", shape, package / "urdf" / "arm.urdf")
        assert not found.not_read
        want = 0.1 * CORNERS @ R.T + P
        order = np.lexsort(want.T), np.lexsort(found.points.T)
        np.testing.assert_allclose(found.points[order[1]], want[order[0]], atol=1e-7)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.stl", stl_binary()[:-7], "no points"),
        ("a.stl", b"vertex 1 2", "damaged"),
        ("a.obj", b"v 1 2 x\n", "damaged"),
        ("a.obj", b"v nan 0 0\n", "not finite"),
        ("a.obj", b"", "no points"),
        ("a.dae", b"<COLLADA/>", "'.dae' files are not read"),
    ],
)
def test_meshes_that_cannot_be_read(name, data, words, tmp_path):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileError, match=words):
        mesh_points(tmp_path / name)


def test_addresses_that_name_no_file(tmp_path):
    for uri in ("https://a/b.stl", "package://no/such.stl", "such.stl", "", "a\0b", "x" * 5000):
        with pytest.raises(FileError):
            find_mesh(uri, tmp_path)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_depth_is_the_distance_to_the_surface(seed):
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3, 2)
    points = size * (rng.normal(size=(30, 3)) + rng.normal(size=3) * 10)
    hull = Hull(points)
    inside = rng.dirichlet(np.ones(30)) @ points
    assert hull.depth(inside) >= -1e-12 * size
    outside = points.mean(axis=0) + 50 * size * rng.normal(size=3)
    near = hull.nearest(outside)
    assert hull.depth(outside) == pytest.approx(-np.linalg.norm(near - outside))
    assert abs(hull.depth(near)) <= 1e-6 * size
    # Nearest: every point of the hull lies beyond the plane through it, across the way.
    assert np.all(
        (points - near) @ (outside - near) <= 1e-5 * size * np.linalg.norm(outside - near)
    )


def test_second_moment_of_a_uniform_box():
    size = np.array([0.3, 0.2, 0.1])
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size + 7.0
    hull = Hull(corners)
    np.testing.assert_allclose(hull.second_moment, np.diag(size**2 / 12), atol=1e-12)
    assert hull.volume == pytest.approx(np.prod(size))


def test_flat_shapes_have_a_hull():
    for points in (np.zeros((1, 3)), np.eye(3), np.array([[0, 0, 0], [1, 0, 0.0]])):
        hull = Hull(points + 0.5)
        assert hull.depth(points[0] + 0.5) >= -1e-6 and hull.depth(np.full(3, 9.0)) < -1.0
