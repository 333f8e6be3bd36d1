"""A case made: its effects scaled, its recordings written, its truth told apart from them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from blind_study import strengths
from blind_study.cases import Case, Hidden
from blind_study.circumstances import MujocoCase
from blind_study.drawn_laws import NAME, DrawnEffect, draw_law, effect_of
from blind_study.experiments import PAUSE, PERIOD, Laboratory, Plan, SensorError
from blind_study.foreign import EFFECTS, SENSOR_ERRORS
from blind_study.law_cases import family_of
from blind_study.robots import TWO, specimen
from blind_study.writing import state_study
from dynident.closed_loop import TrueEffect, write_experiment
from dynident.effects import Effect, catalogue
from dynident.errors import DynidentWarning
from dynident.fitting import fit, rows
from dynident.model import Model
from dynident.recording import Dataset

ALWAYS_KNOWN = ("viscous_friction", "coulomb_friction", "rotor_inertia")
_CLOSE = 1.3
_STEP = (0.02, 50.0)


@dataclass(frozen=True)
class Size:
    """How large the recordings of a study are.

    Attributes
    ----------
    rate_of_two, rate_of_many : Hz, of robots with two joints and with more.
    runs, tests : recordings to fit and to judge by.
    repetitions : periods in a recording.
    """

    rate_of_two: float = 500.0
    rate_of_many: float = 250.0
    runs: int = 4
    tests: int = 2
    repetitions: int = 2


@dataclass(frozen=True)
class _Secret:
    """One thing hidden: an effect, or an error of a sensor."""

    label: Hidden
    effects: tuple[TrueEffect, ...]
    errors: tuple[SensorError, ...]
    most: float
    least: float

    def scaled(self, factor: float) -> _Secret:
        effects = tuple(_scaled(one, factor) for one in self.effects)
        errors = tuple(replace(one, size=one.size * factor) for one in self.errors)
        return replace(
            self,
            effects=effects,
            errors=errors,
            most=self.most / factor,
            least=self.least / factor,
        )


def unavailable(case: Case) -> str:
    """Name an effect of a case that the catalogue does not have; empty if it has all."""
    known = {**catalogue(), **EFFECTS, **dict.fromkeys((*SENSOR_ERRORS, NAME))}
    return next((one.effect for one in case.hidden if one.effect not in known), "")


def make(case: Case, folder: Path, size: Size) -> dict[str, Any]:
    """Write the recordings, robot and study of a case into a folder; return its truth.

    Raises
    ------
    SimulationError
        If the robot cannot be simulated.
    """
    with warnings.catch_warnings():
        # A clock that jitters is said to be resampled, each time it is.
        warnings.simplefilter("ignore", DynidentWarning)
        return _made(case, folder, size)


def _made(case: Case, folder: Path, size: Size) -> dict[str, Any]:
    rng = np.random.default_rng([case.seed, case.number, 4])
    plan = _plan(case, size, rng)
    made = plan.made
    plan = replace(plan, known=_known(plan, rng))
    secrets = [_secret(plan, one, rng) for one in case.hidden]
    noise = _residual(plan, plan.short((), (), noisy=True))
    floor = 0.0
    if not secrets or case.width != case.stated_width or isinstance(case, MujocoCase):
        floor = _ratio(plan, None, noise)
    ratios, found = [], []
    for secret in secrets:
        scaled, ratio = _to_target(plan, secret, noise, floor)
        found.append(_moved(plan, scaled, rng))
        ratios.append(ratio)
    effects = tuple(one for secret in found for one in secret.effects)
    errors = tuple(one for secret in found for one in secret.errors)
    write_experiment(plan.whole(effects, errors), folder)
    state_study(folder / "study.toml", case)
    return {
        "case": case.to_dict(),
        "rate_hz": plan.rate_hz,
        "joints": list(made.robot.names),
        "planar": made.planar,
        "hidden": [
            {**_place(plan, secret.label), "ratio": ratio, **_numbers(secret)}
            for secret, ratio in zip(found, ratios, strict=True)
        ],
        "also": [_place(plan, one) for one in _also(case)],
        "ratio": max([floor, *ratios]),
        "ratio_without": floor,
        "law": next((law for secret in found if (law := _law(secret))), None),
        "noise_rms": [float(x) for x in noise],
    }


def _plan(case: Case, size: Size, rng: np.random.Generator) -> Plan:
    """Return what all experiments of a case have in common; MuJoCo is loaded for its cases only."""
    if isinstance(case, MujocoCase):
        from blind_study.mujoco_lab import MujocoPlan

        rate = case.circumstances.rate_hz
        made = specimen(case.joints, rate, rng)
        return MujocoPlan(case, made, (), rate, size.runs, size.tests, size.repetitions)
    rate = size.rate_of_two if case.joints == TWO else size.rate_of_many
    made = specimen(case.joints, rate, rng)
    return Plan(case, made, (), rate, size.runs, size.tests, size.repetitions)


def _also(case: Case) -> tuple[Hidden, ...]:
    """Return what is true as well: MuJoCo's tendons couple both ways."""
    if not isinstance(case, MujocoCase):
        return ()
    return tuple(
        replace(one, joint=one.source, source=one.joint)
        for one in case.hidden
        if one.effect == "joint_coupling"
    )


def _known(plan: Plan, rng: np.random.Generator) -> tuple[TrueEffect, ...]:
    case, made = plan.case, plan.made
    gone = {(one.effect, one.joint) for one in case.hidden}
    bristles = {one.joint for one in case.hidden if one.effect == "lugre_friction"}
    found = []
    sizes = (made.viscous, made.dry, made.rotor)
    for name, values in zip(ALWAYS_KNOWN, sizes, strict=True):
        for j, joint in enumerate(made.robot.names):
            if (name, j) in gone:
                continue
            # Bristles take the place of the Coulomb friction that the study goes on to state.
            value = 0.0 if name == "coulomb_friction" and j in bristles else float(values[j])
            effect = catalogue()[name](joint).on(made.robot)
            found.append(TrueEffect(effect, (value,)))
    if case.payload:
        load = strengths.start("payload", made, 0, 0, rng, case.width)
        values = tuple(v * 3.0 for v in load.values)
        found.append(TrueEffect(catalogue()["payload"]().on(made.robot), values))
    return tuple(found)


def _law(secret: _Secret) -> dict[str, Any] | None:
    """What a drawn law says, and how many units of it there are."""
    for one in secret.effects:
        if isinstance(one.effect, DrawnEffect):
            return {"drawn": one.effect.drawn.to_dict(), "amount": one.values[0]}
    return None


def _drawn(plan: Plan, hidden: Hidden, rng: np.random.Generator) -> _Secret:
    """Draw a law; the load is only there where MuJoCo moves the robot."""
    case, robot = plan.case, plan.made.robot
    family, width = family_of(case), case.width or case.stated_width
    law = draw_law(family, plan.made, width, rng)
    while law.of_load and not isinstance(case, MujocoCase):
        law = draw_law(family, plan.made, width, rng)
    effect = effect_of(law)(robot.names[law.joint]).on(robot)
    amount = 0.2 * float(rng.choice([-1.0, 1.0]))
    label = replace(hidden, joint=law.joint)
    # No more than thrice the dry friction, or it would drive the joint.
    return _Secret(label, (TrueEffect(effect, (amount,), hidden=True),), (), 15.0, 0.0)


def _secret(plan: Plan, hidden: Hidden, rng: np.random.Generator) -> _Secret:
    if hidden.effect == NAME:
        return _drawn(plan, hidden, rng)
    begin = strengths.start(
        hidden.effect, plan.made, hidden.joint, hidden.source, rng, plan.case.width
    )
    if hidden.effect in SENSOR_ERRORS:
        error = SensorError(hidden.effect, hidden.joint, begin.values[0])
        return _Secret(hidden, (), (error,), begin.most, begin.least)
    kind: Callable[..., Effect] = {**catalogue(), **EFFECTS}[hidden.effect]
    place = _place(plan, hidden)
    effect = kind(place["joint"], place["source"], begin.shape).on(plan.made.robot)
    true = TrueEffect(effect, begin.values, hidden=True)
    return _Secret(hidden, (true,), (), begin.most, begin.least)


def _place(plan: Plan, hidden: Hidden) -> dict[str, str | None]:
    names = plan.made.robot.names
    kind = {**catalogue(), **EFFECTS}.get(hidden.effect)
    placed = kind.place if kind is not None else "joint"
    joint = None if placed == "robot" or hidden.joint < 0 else names[hidden.joint]
    source = names[hidden.source] if placed == "pair" else None
    return {"effect": hidden.effect, "joint": joint, "source": source}


def _numbers(secret: _Secret) -> dict[str, list[float]]:
    values = [v for one in secret.effects for v in one.values]
    shape = [s for one in secret.effects for s in one.effect.shape]
    return {"values": [*values, *(one.size for one in secret.errors)], "shape": shape}


def _scaled(one: TrueEffect, factor: float) -> TrueEffect:
    values = tuple(float(v * factor) for v in one.values)
    effect = one.effect
    if effect.name == "joint_elasticity":
        # A softer spring has a lower resonance.
        resonance, *rest = effect.shape
        effect = effect.shaped(resonance / np.sqrt(factor), *rest)
    return replace(one, effect=effect, values=values)


def _to_target(
    plan: Plan, secret: _Secret, noise: np.ndarray, floor: float
) -> tuple[_Secret, float]:
    """Scale what is hidden until it leaves its target ratio; return the ratio that it leaves.

    `floor` is what the study's model leaves without it.
    """

    def left(one: _Secret) -> float:
        return float(np.sqrt(max(_ratio(plan, one, noise) ** 2 - floor**2, 0.0)))

    target = secret.label.ratio
    if not target:  # it leaves nothing, whatever its size: make it large
        scaled = secret.scaled(min(5.0, secret.most))
        return scaled, left(scaled)
    ratio = left(secret)
    for _ in range(2):
        factor = float(np.clip(target / max(ratio, 1e-6), *_STEP))
        factor = float(np.clip(factor, secret.least, secret.most))
        if 1 / _CLOSE < factor < _CLOSE:
            break
        secret = secret.scaled(factor)
        ratio = left(secret)
    return secret, ratio


def _ratio(plan: Plan, secret: _Secret | None, noise: np.ndarray) -> float:
    """Systematic residual over noise, root mean square, at the joint where it is largest."""
    effects, errors = (secret.effects, secret.errors) if secret else ((), ())
    laboratory = plan.short(effects, errors, noisy=False)
    during = None
    for one in effects:
        if one.effect.name == "contact":
            _, time, width = one.effect.shape
            during = (time - 2 * width, time + 2 * width)
    return float(np.max(_residual(plan, laboratory, during) / noise))


def _residual(
    plan: Plan, laboratory: Laboratory, during: tuple[float, float] | None = None
) -> np.ndarray:
    """Residual of the study's model fitted to an experiment, root mean square, (n,) N m.

    `during` narrows it to some time of the first recording.
    """
    data = Dataset(laboratory.run())
    effects = tuple(one.effect for one in plan.known)
    model = Model(plan.made.nominal, effects, plan.case.stated_width)
    values = fit(model, data).values
    parts = [columns @ values - torque for columns, torque in rows(model, data, values)]
    residual = np.concatenate(parts)
    if during is not None:
        first = parts[0]
        t = np.linspace(0.0, PERIOD, len(first), endpoint=False)
        residual = first[(t >= during[0]) & (t <= during[1])]
    return np.sqrt(np.mean(residual**2, axis=0))


def _moved(plan: Plan, secret: _Secret, rng: np.random.Generator) -> _Secret:
    """Move a contact from the first training recording to any, and to any of its periods."""
    number = int(rng.integers(1, plan.runs + 1))
    later = PAUSE * (number - 1) + PERIOD * float(rng.integers(plan.repetitions))

    def moved(one: TrueEffect) -> TrueEffect:
        if one.effect.name != "contact":
            return one
        _, time, width = one.effect.shape
        return replace(one, effect=one.effect.shaped(float(number), time + later, width))

    return replace(secret, effects=tuple(moved(one) for one in secret.effects))
