"""Random robots, written in all three formats from the same numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dynident.robot.formats.elements import from_rpy


def text(values):
    return " ".join(repr(float(x)) for x in np.atleast_1d(values))


@dataclass
class Body:
    name: str
    parent: str | None
    kind: str  # of the joint to its parent: revolute, prismatic, fixed
    joint: str
    xyz: np.ndarray
    rpy: np.ndarray
    axis: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray  # about the centre of mass, in the link's axes
    com_rpy: np.ndarray = field(default_factory=lambda: np.zeros(3))
    limits: tuple[float, float] = (-1.5, 2.0)


def random_body(rng, index, parent, kind, valid):
    points = rng.normal(size=(6, 3)) * 0.1
    masses = rng.uniform(0.1, 1.0, 6)
    mass = float(masses.sum())
    com = masses @ points / mass
    about = points - com
    inertia = sum(
        m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, about, strict=True)
    )
    if not valid:
        choice = rng.integers(3)
        if choice == 0:
            mass, inertia = -mass, inertia
        elif choice == 1:
            mass = 0.0
        else:
            inertia = np.diag([1.0, -0.3, 5.0])
    aligned = rng.random() < 0.4
    axis = np.eye(3)[rng.integers(3)] if aligned else rng.normal(size=3)
    return Body(
        f"link_{index}",
        parent,
        kind,
        f"joint_{index}",
        rng.normal(size=3) * 0.3,
        rng.uniform(-1.4, 1.4, 3),
        axis / np.linalg.norm(axis),
        mass,
        com,
        np.asarray(inertia),
        rng.uniform(-1, 1, 3),
    )


def random_tree(seed, moving=4, valid=True):
    """A branching tree with `moving` moving joints, some fixed joints in between."""
    rng = np.random.default_rng(seed)
    base = random_body(rng, 0, None, "fixed", True)
    bodies = [base]
    count = 0
    while count < moving:
        parent = bodies[rng.integers(max(0, len(bodies) - 3), len(bodies))].name
        kind = str(rng.choice(["revolute", "prismatic", "fixed"], p=[0.5, 0.25, 0.25]))
        bodies.append(random_body(rng, len(bodies), parent, kind, valid or rng.random() < 0.4))
        count += kind != "fixed"
    return bodies


def _turned(body):
    """The inertia in the axes of the inertial frame, which is turned by com_rpy."""
    R = from_rpy(body.com_rpy)
    return R.T @ body.inertia @ R


def urdf(bodies):
    out = ['<robot name="tree">']
    for body in bodies:
        J = _turned(body)
        out.append(
            f'<link name="{body.name}"><inertial>'
            f'<origin xyz="{text(body.com)}" rpy="{text(body.com_rpy)}"/>'
            f'<mass value="{body.mass!r}"/>'
            f'<inertia ixx="{text(J[0, 0])}" ixy="{text(J[0, 1])}" ixz="{text(J[0, 2])}" '
            f'iyy="{text(J[1, 1])}" iyz="{text(J[1, 2])}" izz="{text(J[2, 2])}"/>'
            "</inertial></link>"
        )
        if body.parent is not None:
            out.append(
                f'<joint name="{body.joint}" type="{body.kind}">'
                f'<parent link="{body.parent}"/><child link="{body.name}"/>'
                f'<origin xyz="{text(body.xyz)}" rpy="{text(body.rpy)}"/>'
                f'<axis xyz="{text(body.axis)}"/>'
                f'<limit lower="{body.limits[0]}" upper="{body.limits[1]}" '
                'effort="9" velocity="4"/>'
                "</joint>"
            )
    return "\n".join([*out, "</robot>"])


def sdf(bodies):
    out = ['<sdf version="1.9"><model name="tree">']
    for body in bodies:
        J = _turned(body)
        names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        entries = zip(names, J[np.triu_indices(3)], strict=True)
        pose = ""
        if body.parent is not None:
            pose = f'<pose relative_to="{body.parent}">{text(body.xyz)} {text(body.rpy)}</pose>'
        out.append(
            f'<link name="{body.name}">{pose}<inertial>'
            f"<pose>{text(body.com)} {text(body.com_rpy)}</pose><mass>{body.mass!r}</mass>"
            f"<inertia>{''.join(f'<{k}>{text(v)}</{k}>' for k, v in entries)}</inertia>"
            "</inertial></link>"
        )
        if body.parent is not None:
            axis = (
                ""
                if body.kind == "fixed"
                else f"<axis><xyz>{text(body.axis)}</xyz><limit><lower>{body.limits[0]}</lower>"
                f"<upper>{body.limits[1]}</upper><effort>9</effort><velocity>4</velocity></limit>"
                "</axis>"
            )
            out.append(
                f'<joint name="{body.joint}" type="{body.kind}"><parent>{body.parent}</parent>'
                f"<child>{body.name}</child>{axis}</joint>"
            )
    return "\n".join([*out, "</model></sdf>"])


def mjcf(bodies):
    def write(body):
        J = body.inertia
        full = [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
        pose = ""
        if body.parent is not None:
            pose = f' pos="{text(body.xyz)}" euler="{text(body.rpy)}"'
        joint = ""
        if body.parent is not None and body.kind != "fixed":
            kind = {"revolute": "hinge", "prismatic": "slide"}[body.kind]
            joint = (
                f'<joint name="{body.joint}" type="{kind}" axis="{text(body.axis)}" '
                f'range="{body.limits[0]} {body.limits[1]}" actuatorfrcrange="-9 9"/>'
            )
        children = "\n".join(write(other) for other in bodies if other.parent == body.name)
        return (
            f'<body name="{body.name}"{pose}>'
            f'<inertial pos="{text(body.com)}" mass="{body.mass!r}" fullinertia="{text(full)}"/>'
            f"{joint}{children}</body>"
        )

    return (
        '<mujoco model="tree"><compiler angle="radian" eulerseq="XYZ"/>'
        f"<worldbody>{write(bodies[0])}</worldbody></mujoco>"
    )


def joint_names(bodies):
    return [body.joint for body in bodies[1:] if body.kind != "fixed"]
