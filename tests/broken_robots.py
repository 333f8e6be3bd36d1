"""A two-link arm in three formats, whose second link can be broken in many ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BOX = (0.3, 0.08, 0.04)
"""Edges of the second link's box, m, around (0.15, 0, 0)."""
MASS = 2.0
MOMENTS = (0.0011, 0.0155, 0.0163)
"""Of a uniform filling of the box, to two digits more than its size is known."""


@dataclass(frozen=True)
class Fore:
    """The second link's inertial numbers (as they are to be written), and its shapes."""

    mass: object = MASS
    com: object = "0.15 0 0"
    moments: tuple[object, ...] = MOMENTS
    products: tuple[object, ...] = (0, 0, 0)  # xy, xz, yz
    shapes: str | None = None
    """In the format's words; default: the box. Empty: none."""
    joint: str = ""
    """Dynamics of the second joint, in the format's words."""
    rest: str = ""
    """More elements of the robot."""


def urdf(fore: Fore = Fore()) -> str:
    shapes = fore.shapes
    if shapes is None:
        shapes = (
            '<visual><origin xyz="0.15 0 0"/><geometry>'
            f'<box size="{text(BOX)}"/></geometry></visual>'
        )
    xx, yy, zz = fore.moments
    xy, xz, yz = fore.products
    return f"""<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="4"/>
 <inertia ixx="0.0066" ixy="0" ixz="0" iyy="0.0566" iyz="0" izz="0.0566"/></inertial></link>
<link name="fore"><inertial><origin xyz="{fore.com}"/><mass value="{fore.mass}"/>
 <inertia ixx="{xx}" ixy="{xy}" ixz="{xz}" iyy="{yy}" iyz="{yz}" izz="{zz}"/></inertial>
 {shapes}</link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
 <origin xyz="0 0 0.3" rpy="1.57 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
 <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>{fore.joint}</joint>{fore.rest}</robot>"""


def sdf(fore: Fore = Fore()) -> str:
    shapes = fore.shapes
    if shapes is None:
        shapes = (
            '<collision name="c"><pose>0.15 0 0 0 0 0</pose><geometry><box>'
            f"<size>{text(BOX)}</size></box></geometry></collision>"
        )
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    entries = zip(names, (*fore.moments, *fore.products), strict=True)
    inertia = "".join(f"<{name}>{value}</{name}>" for name, value in entries)
    return f"""<sdf version="1.9"><model name="arm"><link name="base"/>
<link name="upper"><pose>0 0 0.3 1.57 0 0</pose><inertial><pose>0.2 0 0 0 0 0</pose><mass>4</mass>
 <inertia><ixx>0.0066</ixx><iyy>0.0566</iyy><izz>0.0566</izz></inertia></inertial></link>
<link name="fore"><pose relative_to="upper">0.4 0 0 0 0 0</pose>
 <inertial><pose>{fore.com} 0 0 0</pose><mass>{fore.mass}</mass><inertia>{inertia}</inertia>
 </inertial>{shapes}</link>
<joint name="weld" type="fixed"><parent>world</parent><child>base</child></joint>
<joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>
 <axis><xyz>0 0 1</xyz></axis></joint>
<joint name="elbow" type="revolute"><parent>upper</parent><child>fore</child>
 <axis><xyz>0 0 1</xyz>{fore.joint}</axis></joint>{fore.rest}</model></sdf>"""


def mjcf(fore: Fore = Fore()) -> str:
    shapes = fore.shapes
    if shapes is None:
        half = text(0.5 * np.array(BOX))
        shapes = f'<geom type="box" pos="0.15 0 0" size="{half}"/>'
    full = " ".join(str(value) for value in (*fore.moments, *fore.products))
    return f"""<mujoco model="arm"><compiler angle="radian"/>{fore.rest}<worldbody>
<body name="upper" pos="0 0 0.3" euler="1.57 0 0"><joint name="shoulder" axis="0 0 1"/>
 <inertial pos="0.2 0 0" mass="4" diaginertia="0.0066 0.0566 0.0566"/>
<body name="fore" pos="0.4 0 0"><joint name="elbow" axis="0 0 1" {fore.joint}/>
 <inertial pos="{fore.com}" mass="{fore.mass}" fullinertia="{full}"/>{shapes}</body></body>
</worldbody></mujoco>"""


WRITERS = {"urdf": urdf, "sdf": sdf, "mjcf": mjcf}


def text(values) -> str:
    return " ".join(repr(float(value)) for value in values)
