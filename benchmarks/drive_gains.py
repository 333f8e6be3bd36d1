"""Weigh unknown loads with six-joint robots whose six drive gains are unknown.

    python benchmarks/drive_gains.py --robots 20 [--first 500] [--only "known load"]

Each robot has lengths, inertias, friction and gains drawn at random; its user is told masses that
are off by a third, and records currents: without a load, with one, with another. The torques are
exactly the model's, with noise in the currents. The table says how far the load's mass and centre
are off, how often 95 % intervals hold the truth (of gains, of the model's parameters, of mass,
centre and inertia of the load), and in how many of the robots the scale was said to be fixed.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field

import numpy as np

import dynident as di
from arms import chain
from dynident.fitting.drive_gains import DriveGains, GainProblem, fit_drive_gains
from dynident.fitting.loads import Load
from dynident.inertia import from_com, to_com
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot

JOINTS, RATE_HZ, SECONDS = 6, 200.0, 16.0
FRICTION = ("viscous_friction", "coulomb_friction", "torque_offset")
_Z = 1.959964


@dataclass(frozen=True, kw_only=True)
class Case:
    """What a robot's user records and knows.

    Attributes
    ----------
    carried : a recording each: "" for no load, "tool" for the known one, "crate" for the unknown.
    gain : number of the joint whose gain is known; None for none.
    mass_only : of the known load.
    noise : of the currents, share of their root mean square.
    position_std : rad, of the encoders.
    effects : that the robot has, and the fit.
    """

    name: str
    carried: tuple[str, ...]
    gain: int | None = None
    mass_only: bool = False
    noise: float = 0.03
    position_std: float = 0.0
    effects: tuple[str, ...] = FRICTION


CASES = (
    Case(name="one known load", carried=("", "tool", "crate")),
    Case(name="one known load, friction absent", carried=("", "tool", "crate"), effects=()),
    Case(name="one load of known mass", carried=("", "tool", "crate"), mass_only=True),
    Case(name="one known gain", carried=("", "crate"), gain=2),
    Case(name="one known load, currents with 10 % noise", carried=("", "tool", "crate"), noise=0.1),
    Case(
        name="one known load, encoder 1e-05 rad too",
        carried=("", "tool", "crate"),
        position_std=1e-5,
    ),
    Case(name="nothing known", carried=("", "crate")),
)


@dataclass(frozen=True, eq=False)
class TrueRobot:
    """A robot as it is, and as its user is told that it is."""

    model: Model
    values: np.ndarray
    told: Model
    gains: np.ndarray
    loads: dict[str, np.ndarray]


@dataclass
class Tally:
    """What came out of the robots of a case."""

    masses: list[float] = field(default_factory=list)
    centres: list[float] = field(default_factory=list)
    gains: list[float] = field(default_factory=list)
    parameters: list[float] = field(default_factory=list)
    load: list[float] = field(default_factory=list)
    fixed: list[bool] = field(default_factory=list)


def true_robot(seed: int, effects: tuple[str, ...]) -> TrueRobot:
    """Draw a robot, its gains (1 to 30 N m/A) and loads of 1 to 3 kg."""
    rng = np.random.default_rng([seed, 17])
    robot = _drawn(chain(JOINTS), rng)
    told = robot.with_theta(robot.theta * np.repeat(np.exp(0.3 * rng.normal(size=JOINTS)), 10))
    model, described = Model(robot), Model(told)
    for name in effects:
        model, described = model + name, described + name
    values = model.given_values()
    for name, low, high in (
        ("viscous_friction", 0.1, 0.4),
        ("coulomb_friction", 0.1, 0.5),
        ("torque_offset", -0.2, 0.2),
    ):
        for joint in robot.names if name in effects else ():
            values[model.slices[f"{name}@{joint}"]] = rng.uniform(low, high)
    gains = np.exp(rng.uniform(np.log(1.0), np.log(30.0), JOINTS))
    loads = {"": np.zeros(10), "tool": drawn_body(rng), "crate": drawn_body(rng)}
    return TrueRobot(model, values, described, gains, loads)


def _drawn(robot: Robot, rng: np.random.Generator) -> Robot:
    """The chain with other links: bodies of a few points each."""
    theta = [_points(rng, rng.uniform(1, 4), 0.06, rng.uniform(-0.1, 0.1, 3)) for _ in robot.names]
    return robot.with_theta(np.concatenate(theta))


def drawn_body(rng: np.random.Generator) -> np.ndarray:
    """Parameters (10,) of a body of 1 to 3 kg."""
    return _points(rng, rng.uniform(1, 3), 0.05, rng.uniform(-0.1, 0.1, 3))


def _points(rng: np.random.Generator, mass: float, spread: float, centre: np.ndarray) -> np.ndarray:
    """Parameters (10,) of a body of six equal points."""
    r = rng.normal(0, spread, (6, 3))
    r -= r.mean(axis=0)
    square = mass / 6 * r.T @ r
    return from_com(mass, centre, np.trace(square) * np.eye(3) - square)


def recordings(case: Case, robot: TrueRobot, seed: int) -> tuple[Recording, ...]:
    """Currents along a motion of five harmonics for each load."""
    rng = np.random.default_rng([seed, 29])
    carrying = robot.model + "payload"
    t = np.arange(round(SECONDS * RATE_HZ) + 1) / RATE_HZ
    k = 2 * np.pi / SECONDS * np.arange(1, 6)
    found, std = [], np.zeros(JOINTS)
    for number, name in enumerate(case.carried, start=1):
        s, c = rng.normal(size=(2, JOINTS, 5)) / np.arange(1, 6)
        sin, cos = np.sin(t[:, None] * k), np.cos(t[:, None] * k)
        q, v = sin @ s.T + cos @ c.T, (cos * k) @ s.T - (sin * k) @ c.T
        a = -(sin * k**2) @ s.T - (cos * k**2) @ c.T
        block = carrying.block(t, q, v, a, carries_payload=True)
        torque = carrying.torque(block, np.append(robot.values, robot.loads[name]))
        current = torque / robot.gains
        std = std if number > 1 else case.noise * np.sqrt(np.mean(current**2, axis=0))
        current = current + std * rng.normal(size=current.shape)
        q = q + case.position_std * rng.normal(size=q.shape)
        names = robot.model.robot.names
        found.append(Recording(t, q, current, names, name=f"{number}", load=name, number=number))
    return tuple(found)


def identified(case: Case, robot: TrueRobot, data: tuple[Recording, ...]) -> DriveGains:
    """What the package makes of it."""
    tool = to_com(robot.loads["tool"])
    known = Load(name="tool", mass=tool.mass)
    if not case.mass_only:
        six = tuple(float(tool.inertia_com[place]) for place in INERTIA_PLACES)
        known = Load(name="tool", mass=tool.mass, centre=tuple(tool.com), inertia=six)
    loads = {"tool": known, "crate": Load(name="crate")}
    names = robot.model.robot.names
    gains = {} if case.gain is None else {names[case.gain]: float(robot.gains[case.gain])}
    used = tuple(loads[name] for name in dict.fromkeys(case.carried) if name)
    return fit_drive_gains(GainProblem(robot.told, Dataset(data), gains, used))


INERTIA_PLACES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def judge(case: Case, robot: TrueRobot, found: DriveGains, tally: Tally) -> None:
    """Compare with the truth; where no scale is fixed, the gains up to their mean alone."""
    logs = np.log(found.gains / robot.gains)
    tally.fixed.append(not found.groups)
    free = ~found.given
    if found.groups:
        logs = logs - logs.mean()
    tally.gains += list((logs / np.where(free, found.relative_sigma, 1.0))[free])
    (crate,) = (load for load in found.loads if load.load.name == "crate")
    truth = to_com(robot.loads["crate"])
    tally.centres.append(float(np.linalg.norm(crate.values[1:4] - truth.com)))
    if found.groups:
        return
    tally.masses.append(abs(crate.values[0] / truth.mass - 1))
    inertia = [truth.inertia_com[place] for place in INERTIA_PLACES]
    tally.load += list((crate.values - [truth.mass, *truth.com, *inertia]) / crate.sigma)
    n, p = JOINTS, robot.model.size
    sigma = np.sqrt(np.diag(found.covariance)[n : n + p])
    shown = sigma > 0
    tally.parameters += list(((found.values - robot.values)[shown]) / sigma[shown])


def _covered(scores: list[float]) -> str:
    inside = np.mean(np.abs(scores) < _Z) if scores else np.nan
    return f"{inside:.3f} ({len(scores)})" if scores else "-"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--first", type=int, default=500, help="seed to begin with")
    parser.add_argument("--only", default="", help="cases whose name holds this")
    said = parser.parse_args()
    print(f"dynident {di.__version__}; coverage of 95 % intervals, with the number of them")
    print(
        f"{'case':42s} {'mass, worst':>11s} {'centre':>8s} {'gains':>12s} {'parameters':>13s} "
        f"{'load':>12s} scale fixed"
    )
    for case in CASES:
        if said.only not in case.name:
            continue
        tally = Tally()
        for seed in range(said.first, said.first + said.robots):
            robot = true_robot(seed, case.effects)
            judge(case, robot, identified(case, robot, recordings(case, robot, seed)), tally)
        mass = f"{100 * max(tally.masses):.2f} %" if tally.masses else "-"
        print(
            f"{case.name:42s} {mass:>11s} {1000 * max(tally.centres):>5.1f} mm "
            f"{_covered(tally.gains):>12s} {_covered(tally.parameters):>13s} "
            f"{_covered(tally.load):>12s} {sum(tally.fixed)} of {len(tally.fixed)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
