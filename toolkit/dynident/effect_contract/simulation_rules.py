"""The torque that a simulated robot with the effect takes, against the effect's columns."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.closed_loop import Mechanism, TrueEffect
from dynident.effect_contract.crane import block_of, crane, motion, random_values
from dynident.effect_contract.disagreement import differs
from dynident.effects import Effect

_SEEDS = (0, 1, 17, 402, 9999)


def zero_is_no_effect(effect: Effect) -> Iterator[str]:
    """Values of zero give no torque, neither from the columns nor in a simulation."""
    values = (0.0,) * len(effect.parameters(crane()))
    if np.any(effect.at(values).columns(block_of(effect, 3)) @ np.array(values)):
        yield "the columns at values of zero give a torque"
    for name in ("simulated_loss", "simulated_delay"):
        if np.any(getattr(effect, name)(values, crane())):
            yield f"{name}() is not zero for values of zero"
    if not _is_of_the_instant(effect, values):
        return
    t, q, v, a = motion(3)
    mechanism = Mechanism.of(crane(), [TrueEffect(effect, values)], carries_payload=True)
    rigid = crane().inverse_dynamics(q, v, a)
    what = "the simulated torque with values of zero"
    yield from differs(what, mechanism.command(t, q, v, a), rigid, relative=1e-7, absolute=1e-10)


def simulation_is_the_columns(effect: Effect) -> Iterator[str]:
    """Command for a motion, from all ways of acting, less the rigid robot's torque."""
    for seed in _SEEDS:
        values = random_values(effect, seed)
        if not _is_of_the_instant(effect, tuple(values)):
            continue
        t, q, v, a = motion(seed)
        truth = TrueEffect(effect, tuple(values))
        mechanism = Mechanism.of(crane(), [truth], carries_payload=True).numbered(1)
        rigid = crane().inverse_dynamics(q, v, a)
        needed = mechanism.command(t, q, v, a) - rigid
        found = effect.at(values.tolist()).columns(block_of(effect, seed)) @ values
        scale = np.abs(needed).max() + np.abs(rigid).max()
        what = f"the torque of the columns at {_written(values)}"
        yield from differs(what, found, needed, relative=1e-9, absolute=1e-11 * scale)


def terms_are_the_force(effect: Effect) -> Iterator[str]:
    """For values of either sign: an estimate on its way has no bounds."""
    values = np.random.default_rng(7).normal(size=len(effect.parameters(crane())))
    terms = effect.simulated_terms(tuple(values), crane())
    if terms is None:  # it is evaluated in Python
        return
    block = block_of(effect, 7)
    laws = {
        "constant": lambda x, v: np.ones(len(block.t)),
        "position": lambda x, v: x,
        "speed": lambda x, v: v,
        "sign": lambda x, v: np.tanh(v / np.max(block.friction_width)),
        "magnitude": lambda x, v: np.abs(v),
    }
    total = np.zeros_like(block.q)
    for term in terms:
        of = list(term.of)
        moving = block.q[:, of].sum(axis=1), block.v[:, of].sum(axis=1)
        total[:, term.at] += term.coefficient * laws[term.law](*moving)
    force = effect.simulated_force(values.tolist(), block)
    what = f"the sum of simulated_terms() at {_written(values)}"
    yield from differs(what, total, force, relative=1e-12, absolute=1e-13)


def _is_of_the_instant(effect: Effect, values: tuple[float, ...]) -> bool:
    """Whether its torque follows from one instant's motion alone, so that it can be compared."""
    return (
        not effect.memory
        and effect.simulated_transmission(values, crane()) is None
        and not np.any(effect.simulated_delay(values, crane()))
    )


def _written(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"
