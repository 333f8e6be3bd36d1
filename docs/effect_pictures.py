"""What each effect looks like in the residual: drawn from its own columns, when the site is built.

A two-link arm with known bodies moves; the effect's torque is taken at its elbow, and what viscous
and Coulomb friction can imitate of it is fitted and taken off, as a fit does. What remains, with a
little noise, is what a diagnosis sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from dynident import Model
from dynident.effects import Block, Effect, catalogue
from dynident.robot import Robot

ARM = Path(__file__).resolve().parents[1] / "problems" / "hidden_effect" / "arm.urdf"
JOINT, OTHER = "elbow", "shoulder"
USUAL = ("viscous_friction", "coulomb_friction")
NOISE = 0.03
"""N m, of each sample drawn."""
BINS = 60
_DOTS, _LINE, _SECOND = "#9aa7b4", "#b3261e", "#1f5fa8"


@dataclass(frozen=True)
class Shown:
    """How an effect is drawn.

    Attributes
    ----------
    values : of its linear parameters, in their units.
    against : quantity of the horizontal axis.
    split : what tells two groups of samples apart, which are drawn apart; none if empty.
    shape : of its shape parameters; empty for the middle of their grids.
    """

    values: tuple[float, ...]
    against: str
    split: str = ""
    shape: tuple[float, ...] = ()


SHOWN: dict[str, Shown] = {
    "asymmetric_friction": Shown((0.5, 0.5), "velocity"),
    "backlash": Shown((0.01,), "time"),
    "base_tilt": Shown((0.0, 0.05), "position"),
    "contact": Shown((3.0,), "time", "", (1.0, 5.0, 0.1)),
    "coulomb_friction": Shown((0.7,), "velocity"),
    "drive_gain": Shown((0.1,), "load"),
    "joint_coupling": Shown((0.3, 0.4, 0.05, 0.0), "velocity of the other joint"),
    "joint_elasticity": Shown((0.02,), "acceleration", "", (4.0, 0.1, 0.3)),
    "joint_spring": Shown((2.0, 0.0), "position"),
    "joint_zero": Shown((0.05,), "position"),
    "load_friction": Shown((0.1,), "load", "direction"),
    "payload": Shown((0.5, 0.1, 0.0, 0.0, 0, 0, 0.02, 0, 0, 0.02), "time"),
    "presliding": Shown((0.7,), "velocity"),
    "quadratic_drag": Shown((0.3,), "velocity"),
    "rotor_inertia": Shown((0.2,), "acceleration"),
    "stribeck_friction": Shown((0.7,), "velocity", "", (0.12,)),
    "thermal_friction": Shown((0.5, 0.7), "velocity", "hour", (300.0,)),
    "torque_delay": Shown((0.01,), "rate of the torque"),
    "torque_drift": Shown((0.001,), "time"),
    "torque_offset": Shown((0.6,), "velocity"),
    "torque_ripple": Shown((0.4, 0.0), "position", "", (12.0,)),
    "unbalance": Shown((0.5, 0.3), "position"),
    "viscous_friction": Shown((0.7,), "velocity"),
}
GROUPS = {
    "direction": ("moving forwards", "moving backwards"),
    "hour": ("first minute", "a quarter of an hour later"),
}


@dataclass(frozen=True)
class Seen:
    """A residual as it is drawn.

    Attributes
    ----------
    x, residual : (T,) of the horizontal axis, and N m at the elbow.
    label : of the horizontal axis, with its unit.
    groups : name -> (T,) which samples; one of no name where nothing is told apart.
    """

    x: np.ndarray
    residual: np.ndarray
    label: str
    groups: dict[str, np.ndarray]


@cache
def motion() -> Block:
    """The motion of all pictures: fast and slow, with many reversals; twice, the second later."""
    t = np.arange(0.0, 20.0, 0.004)
    w = 2 * np.pi / 10.0
    rows = (
        ((1, 0.5, 0.0), (2, 0.35, 1.0), (5, 0.12, 2.0)),
        ((1, 0.9, 0.7), (3, 0.4, 0.2), (7, 0.1, 1.5), (23, 0.02, 0.0)),
    )
    q, v, a = (
        np.column_stack(
            [
                sum(size * (k * w) ** order * wave(k * w * t + at) for k, size, at in row)
                for row in rows
            ]
        )
        for order, wave in enumerate((np.sin, np.cos, lambda x: -np.sin(x)))
    )
    t = np.where(t < 10.0, t, t + 890.0)
    return Model(Robot.from_file(ARM)).block(t, q, v, a)


def seen(kind: type[Effect]) -> Seen:
    """Return what an effect of this kind leaves in the residual at the elbow."""
    shown = SHOWN[kind.name]
    robot = Robot.from_file(ARM)
    place = "" if kind.place == "robot" else f"@{JOINT}"
    label = kind.name + place + (f":{OTHER}" if kind.place == "pair" else "")
    others = [name for name in USUAL if name != kind.name]
    given = Model(robot)
    for name in others:
        given = given + name
    whole = given + label
    effect = whole.effects[-1]
    if shown.shape:
        effect = effect.shaped(*shown.shape)
    effect = effect.at(shown.values)
    block = motion()
    late = block.t > 100.0
    values = given.given_values()
    torque, seen_by_model = _torques(given, effect, block, values, shown.values)
    rows = seen_by_model[:, :, len(given.base.independent) :].reshape(torque.size, -1)
    left = torque.ravel() - rows @ np.linalg.lstsq(rows, torque.ravel(), rcond=1e-9)[0]
    residual = left.reshape(torque.shape)[:, block.index(JOINT)]
    noise = np.random.default_rng(1).normal(scale=NOISE, size=len(residual))
    load = given.torque(block, values)[:, block.index(JOINT)]
    x, axis = _axis(shown.against, block, load)
    return Seen(x, residual + noise, axis, _groups(shown.split, block, late))


def _torques(
    given: Model, effect: Effect, block: Block, values: np.ndarray, sizes: Sequence[float]
) -> tuple[np.ndarray, np.ndarray]:
    """Torque of an effect (T, n), and the columns of the model without it (T, n, p)."""
    parts = [block.t < 100.0, block.t > 100.0]
    found = []
    for number, part in enumerate(parts, start=1):
        fields = {name: getattr(block, name)[part] for name in ("t", "q", "v", "a")}
        own = given.block(**fields, carries_payload=number == 2, number=number)
        own = given.ready(effect, own, values)
        found.append(effect.columns(own) @ np.asarray(sizes))
    return np.concatenate(found), given.columns(block, values)


def _axis(against: str, block: Block, load: np.ndarray) -> tuple[np.ndarray, str]:
    j, i = block.index(JOINT), block.index(OTHER)
    dt = 0.004
    one_after_the_other = np.arange(len(block.t)) * dt
    choices = {
        "velocity": (block.v[:, j], f"velocity of the {JOINT} (rad/s)"),
        "position": (block.q[:, j], f"position of the {JOINT} (rad)"),
        "acceleration": (block.a[:, j], f"acceleration of the {JOINT} (rad/s^2)"),
        "load": (load, f"predicted torque of the {JOINT} (N m)"),
        "time": (
            one_after_the_other,
            "time (s); from 10 s on, a recording made a quarter of an hour later",
        ),
        "velocity of the other joint": (block.v[:, i], f"velocity of the {OTHER} (rad/s)"),
        "rate of the torque": (
            np.gradient(load, dt),
            f"rate of the predicted torque of the {JOINT} (N m/s)",
        ),
    }
    return choices[against]


def _groups(split: str, block: Block, late: np.ndarray) -> dict[str, np.ndarray]:
    if not split:
        return {"": np.ones(len(block.t), dtype=bool)}
    first = block.v[:, block.index(JOINT)] > 0 if split == "direction" else ~late
    return dict(zip(GROUPS[split], (first, ~first), strict=True))


def picture(kind: type[Effect]) -> Figure:
    """Draw what an effect of this kind leaves in the residual."""
    one = seen(kind)
    figure = Figure(figsize=(6.0, 2.6), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0.0, color="#333333", linewidth=0.8)
    axes.plot(one.x[::2], one.residual[::2], ".", color=_DOTS, markersize=2, alpha=0.5)
    by_time = "time" in one.label
    for (name, part), colour in zip(one.groups.items(), (_LINE, _SECOND), strict=False):
        if not by_time:
            x, y = _means(one.x[part], one.residual[part])
            axes.plot(x, y, color=colour, linewidth=2.0, label=name or None)
    if "" not in one.groups:
        axes.legend(loc="best", frameon=False, fontsize=9)
    axes.set_xlabel(one.label)
    axes.set_ylabel("residual (N m)")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _means(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    bins = np.clip(np.digitize(x, edges) - 1, 0, BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    enough = count >= 5
    sums = [np.bincount(bins, weights=w, minlength=BINS)[enough] for w in (x, y)]
    return sums[0] / count[enough], sums[1] / count[enough]


def write_pictures(folder: Path) -> None:
    """Write a picture of every effect of the catalogue into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, kind in catalogue().items():
        picture(kind).savefig(folder / f"{name}.png", dpi=110, facecolor="white")
