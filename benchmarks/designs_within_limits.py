"""Whether designed motions keep every limit: random robots, looked at by other code than designs.

    python benchmarks/designs_within_limits.py --count 100

Each robot is drawn at random: one to seven joints, some of them rails, shapes of links that can
meet, limits from loose to tight, often obstacles and a box for the tip. Its description is wrong by
up to 20 % in the mass and the inertia of each link, and all that is recorded are four seconds of a
small motion. A motion is designed for it and looked at on ten times as many instants as the design
looked at: position, speed, acceleration and its differences from the coefficients, torque of the
true robot by Pinocchio, distances of links and obstacles and the place of the tip by a Drake plant
that is built here from the drawn text. Printed are the largest share of each limit, the least room,
what moves at either end, and how many were refused; a line for each robot says what its motion
exceeds, if any.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import dynident as di
from dynident.errors import DesignError
from dynident.experiment_design import DesignTask, MotionLimits, RecordingDesign
from dynident.experiment_design.geometry.surroundings import BoxEntry, Obstacle, StayBox
from dynident.experiment_design.motion_program import FINER
from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot
from dynident.tables import Table

ROUNDING = 1e-9
"""Of a limit, and m: less than this beyond is the computer's."""
CLEARANCE = 0.01  # m
_MOMENT = 1e-7  # s
_AXES = ("1 0 0", "0 1 0", "0 0 1")
_POSES = 300
"""Random positions: links that are too near at all of them are housings of neighbours."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawn:
    """A robot, what is around it, what it may do, and what is asked of it.

    Attributes
    ----------
    text : URDF, as the robot truly is.
    robot : of it.
    described : what is known of it.
    limits : with the obstacles and the box.
    task : the design.
    """

    text: str
    robot: Robot
    described: Robot
    limits: MotionLimits
    task: DesignTask

    @classmethod
    def of(cls, seed: int) -> Drawn:
        """Draw one."""
        rng, own = (np.random.default_rng([seed, k]) for k in (19, 20))
        n = int(rng.integers(1, 8))
        text = _urdf(n, rng)
        robot = Robot.from_text(text)
        plain = MotionLimits.of(robot)
        # From hardly any torque beyond that of gravity to more than the motion can use.
        q = robot.random_motion(seed, 200)[0]
        still = np.abs(robot.inverse_dynamics(q, 0.0 * q, 0.0 * q)).max(axis=0)
        torque = (still + 0.5) * np.exp(rng.uniform(-0.7, 2.5, n))
        limits = replace(
            plain,
            speed=plain.speed * rng.uniform(0.1, 1.0, n),
            acceleration=plain.acceleration * rng.uniform(0.1, 1.0, n),
            torque=np.where(rng.random(n) < 0.7, torque, np.inf),
            obstacles=tuple(_obstacle(rng) for _ in range(rng.integers(0, 3))),
        )
        jerk = limits.acceleration * own.uniform(2.0, 20.0, n)
        limits = replace(limits, jerk=np.where(own.random(n) < 0.5, jerk, np.inf))
        if rng.random() < 0.4:
            low, high = (rng.uniform(0.2, 0.9, 3) * side for side in (-1, 1))
            entry = BoxEntry(joint=robot.names[-1], lower=low.tolist(), upper=high.tolist())
            limits = replace(limits, boxes=(StayBox.of(entry, robot, "drawn"),))
        wrong = np.repeat(rng.uniform(0.8, 1.2, n), 10)
        task = DesignTask(
            duration=float(rng.uniform(3.0, 10.0)),
            repeat=int(rng.integers(1, 4)),
            harmonics=int(rng.integers(2, 9)),
            intervals=int(own.integers(4, 20)) if own.random() < 0.4 else None,
            starts=1,
            seed=seed,
            clearance=CLEARANCE,
        )
        return cls(
            text=text,
            robot=robot,
            described=robot.with_theta(wrong * robot.theta),
            limits=limits,
            task=task,
        )

    @property
    def recorded(self) -> di.Dataset:
        """Four seconds of a small motion of the true robot."""
        rate, n = 100.0, self.robot.n
        t, w = np.arange(400) / rate, 1.0 + np.arange(n)
        q, v = 0.1 * np.sin(np.outer(t, w)), 0.1 * w * np.cos(np.outer(t, w))
        torque = self.robot.inverse_dynamics(q, v, -(w**2) * q)
        torque = torque + 0.05 * np.random.default_rng(0).normal(size=torque.shape)
        return di.Dataset((Recording(t, q, torque, self.robot.names),))

    def designed(self) -> RecordingDesign:
        """Return its design; raise `DesignError` where there is none."""
        model, quiet = Model(self.described), lambda _: None
        return di.design(model, self.recorded, self.task, limits=self.limits, progress=quiet)


def _urdf(n: int, rng: np.random.Generator) -> str:
    """A chain of links, each with a ball, a box or a rod that can meet those of others."""
    parts = ['<robot name="drawn"><link name="base"/>']
    for k in range(n):
        length, mass = rng.uniform(0.1, 0.35), rng.uniform(0.5, 4.0)
        thick = rng.uniform(0.02, 0.06)
        shape = rng.choice(
            [
                f'<sphere radius="{thick}"/>',
                f'<box size="{thick} {thick} {0.6 * length}"/>',
                f'<cylinder radius="{thick / 2}" length="{0.6 * length}"/>',
            ]
        )
        turn = rng.choice([-1.5708, 0.0, 0.7, 1.5708], 3)
        moments = mass * (length**2 + thick**2) / 12 * rng.uniform(0.9, 1.1, 3)
        rail = rng.random() < 0.2
        reach, speed = (rng.uniform(0.1, 0.5), 0.8) if rail else (rng.uniform(0.5, 3.0), 3.0)
        middle = rng.uniform(-0.5, 0.5) * reach
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="0.01 0.02 {length / 2}"/>'
            f'<mass value="{mass}"/><inertia ixx="{moments[0]}" iyy="{moments[1]}" '
            f'izz="{moments[2]}" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
            f'<origin xyz="0 0 {length / 2}"/><geometry>{shape}</geometry></collision></link>'
            f'<joint name="j{k}" type="{"prismatic" if rail else "revolute"}">'
            f'<parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="0 0 {length if k else 0.0}" rpy="{turn[0]} {turn[1]} {turn[2]}"/>'
            f'<axis xyz="{rng.choice(_AXES)}"/><limit lower="{middle - reach}" '
            f'upper="{middle + reach}" velocity="{speed}" effort="0"/></joint>'
        )
    return "".join([*parts, "</robot>"])


def _obstacle(rng: np.random.Generator) -> Obstacle:
    away = rng.normal(size=3)
    centre = away / np.linalg.norm(away) * rng.uniform(0.2, 0.9)
    return Obstacle(centre, rng.uniform(0.03, 0.2, rng.choice([1, 3])))


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What a motion uses, by other code than designs it.

    Attributes
    ----------
    position, speed, acceleration, jerk, torque : largest share of a limit, 1 or less where it
        holds.
    clear, inside : m, least room beyond the clearance, and to a face of the box; infinite where
        there is none to keep.
    moving : largest share of a limit of speed or acceleration at the beginning and at the end.
    """

    position: float
    speed: float
    acceleration: float
    jerk: float
    torque: float
    clear: float
    inside: float
    moving: float

    @property
    def beyond(self) -> list[str]:
        """Names of what does not hold."""
        shares = ("position", "speed", "acceleration", "jerk", "torque")
        found = [one for one in shares if not getattr(self, one) <= 1.0 + ROUNDING]
        found += [one for one in ("clear", "inside") if not getattr(self, one) >= -ROUNDING]
        return found + ["moving"] * (not self.moving <= 1e-6)


def seen(drawn: Drawn, found: RecordingDesign) -> Seen:
    """Look at a designed motion on ten times as many instants as the design looked at."""
    limits, task, robot = drawn.limits, drawn.task, drawn.robot
    count = 10 * FINER * found.program.instants
    t = np.linspace(0.0, task.duration, count + 1)
    q, v, a = found.trajectory.at(t)
    torque = robot.inverse_dynamics(q, v, a)
    # Of a spline the jerk jumps where the period ends, at which it rests.
    last = found.trajectory.at(t[[-1]] - _MOMENT)[2] / -_MOMENT
    middle, half = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 2
    ends = found.trajectory.at(np.array([0.0, task.duration * task.repeat]))
    moving = [
        np.abs(one / limit).max()
        for one, limit in zip(ends[1:], (limits.speed, limits.acceleration), strict=True)
    ]
    clear, inside = _room(drawn, q)
    return Seen(
        position=float(np.abs((q - middle) / half).max()),
        speed=float(np.abs(v / limits.speed).max()),
        acceleration=float(np.abs(a / limits.acceleration).max()),
        jerk=float(np.abs(np.vstack([np.diff(a, axis=0) / t[1], last]) / limits.jerk).max()),
        torque=float(np.abs(torque / limits.torque).max()),
        clear=clear,
        inside=inside,
        moving=float(max(moving)),
    )


def _room(drawn: Drawn, q: np.ndarray) -> tuple[float, float]:
    """Least room of links and obstacles beyond the clearance, and of the tip in its box, m."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    Parser(plant).AddModelsFromString(drawn.text, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    around = set()
    for k, one in enumerate(drawn.limits.obstacles):
        centre: Any = one.centre  # the stubs of Drake take no array
        pose = RigidTransform(centre)
        friction = CoulombFriction(0.0, 0.0)
        around.add(
            plant.RegisterCollisionGeometry(
                plant.world_body(), pose, one.shape(), f"obstacle {k}", friction
            )
        )
    plant.Finalize()
    diagram = builder.Build()
    whole = diagram.CreateDefaultContext()
    context = plant.GetMyMutableContextFromRoot(whole)
    places = [plant.GetJointByName(name).position_start() for name in drawn.robot.names]
    tip = plant.GetJointByName(drawn.robot.names[-1]).child_body()

    def near(position: np.ndarray) -> Iterator[tuple[Any, float]]:
        whole_q = np.zeros(plant.num_positions())
        whole_q[places] = position
        plant.SetPositions(context, whole_q)
        query: Any = plant.get_geometry_query_input_port().Eval(context)
        for pair in query.ComputeSignedDistancePairwiseClosestPoints(CLEARANCE + 0.2):
            yield frozenset((pair.id_A, pair.id_B)), pair.distance - CLEARANCE

    rng = np.random.default_rng(1)
    lower, upper = drawn.limits.lower, drawn.limits.upper
    poses = rng.uniform(lower, upper, (_POSES, len(lower)))
    always = set.intersection(*({p for p, room in near(one) if room < 0} for one in poses))
    always = {pair for pair in always if not pair & around}
    clear, inside = np.inf, np.inf
    for position in q:
        clear = min([clear, *(room for pair, room in near(position) if pair not in always)])
        for box in drawn.limits.boxes:
            place = plant.EvalBodyPoseInWorld(context, tip).translation()
            inside = min(inside, float(np.min([place - box.lower, box.upper - place])))
    return clear, inside


def main() -> None:
    """Print the table, and a line for each robot whose motion does not hold."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=100, help="robots")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    asked = parser.parse_args()
    kept: list[Seen] = []
    wrong, refused, spent = 0, 0, 0.0
    for seed in range(asked.first, asked.first + asked.count):
        drawn = Drawn.of(seed)
        began = time.process_time()
        try:
            found = drawn.designed()
        except DesignError as error:
            refused += 1
            print(f"{seed}: {drawn.robot.n} joints, refused: {error}", flush=True)
            continue
        finally:
            spent += time.process_time() - began
        kept.append(seen(drawn, found))
        wrong += bool(kept[-1].beyond)
        print(
            f"{seed}: {drawn.robot.n} joints, {kept[-1].beyond or 'holds'} {kept[-1]}", flush=True
        )
    rows = [
        (name, f"{max(getattr(one, name) for one in kept):.9f}", "1")
        for name in ("position", "speed", "acceleration", "jerk", "torque")
    ]
    rows += [
        (f"{name}, mm", f"{1000 * min(getattr(one, name) for one in kept):.6f}", "0 or more")
        for name in ("clear", "inside")
    ]
    rows += [
        ("moving at the ends", f"{max(one.moving for one in kept):.1e}", "0"),
        ("designed, of these beyond something", f"{len(kept)}, {wrong}", "0"),
        ("refused", str(refused), ""),
        ("s of processor time each", f"{spent / asked.count:.1f}", ""),
    ]
    print(Table("Designed motions within their limits", ("figure", "worst", "asked"), tuple(rows)))


if __name__ == "__main__":
    main()
