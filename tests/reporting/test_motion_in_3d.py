"""The page with a motion in 3D: what it holds, from which shapes, and that it fetches nothing."""

from __future__ import annotations

import base64
import gc
import re
import threading

import numpy as np
import pytest

from dynident.closed_loop import Fourier
from dynident.experiment_design.geometry.surroundings import Obstacle
from dynident.reporting.pictures.motion_in_3d import motion_page
from dynident.robot import Robot

BOX = '<geometry><box size="0.3 0.05 0.05"/></geometry>'
HOSTILE = "&lt;/title&gt;&lt;script&gt;alert(1)&lt;/script&gt;/.."


def bar(inside: str = "", name: str = "bar", link: str = "l") -> Robot:
    return Robot.from_text(
        f'<robot name="{name}"><link name="base"/><link name="{link}"><inertial>'
        '<origin xyz="0.15 0 0"/><mass value="2"/>'
        '<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
        f'{inside}</link><joint name="j" type="revolute"><parent link="base"/>'
        f'<child link="{link}"/><axis xyz="0 1 0"/>'
        '<limit lower="-2" upper="2" velocity="3" effort="50"/></joint></robot>'
    )


def motion(period: float = 2.0) -> Fourier:
    return Fourier(period, np.array([0.2]), np.array([[0.5]]), np.array([[0.0]]))


def messages(html: str) -> bytes:
    """What the page has the viewer do."""
    found = re.findall(r"data:application/octet-binary;base64,([A-Za-z0-9+/=]+)", html)
    assert found
    return b"".join(base64.b64decode(one) for one in found)


@pytest.mark.parametrize(
    ("inside", "shows", "shape"),
    [
        (f"<visual>{BOX}</visual>", "visual geometry", b"BoxGeometry"),
        (f"<collision>{BOX}</collision>", "collision geometry", b"BoxGeometry"),
        ("", "ellipsoids", b"SphereGeometry"),
        (
            '<visual><geometry><mesh filename="package://nowhere/a.obj"/></geometry></visual>',
            "ellipsoids",
            b"SphereGeometry",
        ),
    ],
)
@pytest.mark.slow
def test_links_are_drawn_as_the_description_has_them(inside: str, shows: str, shape: bytes) -> None:
    page = motion_page(bar(inside), motion(), "A caption.")
    assert shows in page.shows and shows in page.html
    told = messages(page.html)
    assert shape in told and b"set_animation" in told


@pytest.mark.slow
def test_every_frame_of_a_period_is_there_and_long_ones_have_fewer() -> None:
    sizes = [len(messages(motion_page(bar(), motion(x), "").html)) for x in (1.0, 4.0, 1800.0)]
    per_second = (sizes[1] - sizes[0]) / 3.0
    assert per_second > 30 * 7 * 4  # 30 frames of a place and a turn
    assert sizes[2] < 3100 * per_second / 30


def test_names_of_links_are_no_part_of_the_page() -> None:
    robot = bar(f"<visual>{BOX}</visual>", HOSTILE, HOSTILE)
    for one in (robot, bar("", HOSTILE, HOSTILE)):
        page = motion_page(one, motion(), "</div><script>alert(2)</script>")
        assert "<script>alert(" not in page.html
        assert page.html.count("</title>") == 1


def test_the_page_may_fetch_nothing() -> None:
    html = motion_page(bar(), motion(), "A caption.").html
    policy = html.index("Content-Security-Policy")
    assert policy < html.index("<script")
    said = html[policy : html.index(">", policy)]
    assert "default-src 'none'" in said and "http" not in said and "*" not in said
    assert not re.findall(r"<(?:script|link|img)[^>]*(?:src|href)\s*=", html)


def test_obstacles_are_drawn() -> None:
    around = (
        Obstacle(np.array([0.5, 0.0, 0.0]), np.array([0.1])),
        Obstacle(np.array([0.0, 0.5, 0.0]), np.array([0.2, 0.2, 0.2])),
    )
    told = messages(motion_page(bar(f"<visual>{BOX}</visual>"), motion(), "", around).html)
    assert b"obstacles/1" in told and b"obstacles/2" in told and b"SphereGeometry" in told


def test_nothing_of_the_viewer_is_left_for_another_thread_to_collect() -> None:
    """Drake's viewer aborts the process where it ends in another thread than it began in."""
    gc.disable()
    try:
        motion_page(bar(f"<visual>{BOX}</visual>"), motion(), "A caption.")
        thread = threading.Thread(target=gc.collect)
        thread.start()
        thread.join()
    finally:
        gc.enable()
