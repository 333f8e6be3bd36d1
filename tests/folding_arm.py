"""A planar arm that can fold onto itself, with balls that can touch."""

from __future__ import annotations

from dynident.robot import Robot

MARGIN, RADIUS = 0.03, 0.08
SPHERE = (
    '<collision><origin xyz="{x} 0 0"/><geometry><sphere radius="0.08"/></geometry></collision>'
)


def folding() -> Robot:
    """Three links in a plane, 0.3 m each, that can fold: a ball in the first, one at the tip."""
    parts = ['<robot name="folding"><link name="base"/>']
    for k in range(3):
        ball = {0: SPHERE.format(x=0.1), 2: SPHERE.format(x=0.3)}.get(k, "")
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.15 0.01 0"/><mass value="{2 - 0.5 * k}"/>'
            '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
            f'{ball}</link><joint name="j{k}" type="revolute">'
            f'<parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="{0.3 if k else 0} 0 0"/><axis xyz="0 1 0"/>'
            '<limit lower="-2.6" upper="2.6" velocity="3" effort="200"/></joint>'
        )
    return Robot.from_text("".join(parts) + "</robot>")
