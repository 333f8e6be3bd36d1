"""From the last iteration to an `Estimate`, with its uncertainties and caveats."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.fitting.estimate import Estimate, nearly_hidden, unidentified
from dynident.fitting.history import Convergence
from dynident.fitting.instrumental.bias import ExpectedBias, expected_bias
from dynident.fitting.instrumental.covariance import (
    block_covariance,
    carried_covariance,
    textbook_covariance,
)
from dynident.fitting.instrumental.iv_iterations import Iterations
from dynident.fitting.instrumental.noise_level import NoiseLevel, noise_level, position_noise
from dynident.fitting.instrumental.normal_equations import InstrumentalSolution
from dynident.fitting.instrumental.residual_spectrum import residual_noise
from dynident.fitting.instrumental.simulated_loop import LoopSource
from dynident.fitting.instrumental.simulated_run import SimulatedRun
from dynident.fitting.instrumental.source import InstrumentSource
from dynident.fitting.least_squares import sources_of
from dynident.fitting.linear_solution import residual_std
from dynident.fitting.uncertainty.expected_bias import held, listed, reported
from dynident.model import Model
from dynident.recording import Filter
from dynident.recording.derivatives import ORDERS
from dynident.tables import number

_SURE = 10.0
"""Standard errors from which an expected bias is reported: the 99.5 % quantile of Student's t with
the two degrees of freedom of three pairs."""
_SHIFTED = 2.0
"""Standard errors of a shift by sampling from which 95 % intervals hold the truth in less than
half of all cases."""
_WEAK = 0.02
"""Canonical correlation below which instruments and regressor hardly have to do with each other."""


def assemble(method: str, iterations: Iterations) -> Estimate:
    """Return the estimate of finished iterations; `method` is in words."""
    model, source = iterations.model, iterations.source
    found, solution, values = iterations.found, iterations.solution, iterations.values
    noise, bias = _noise(model, source, iterations)
    covariance = carried_covariance(model, values, iterations.instruments, solution, noise)
    words = (
        "sigma carries the noise of encoders and torque, and the bias to be expected of it; what "
        "the model lacks is not in it."
    )
    if noise.doubt:
        # No size of the noise explains the residual: the scatter of the data has to say it.
        covariance = block_covariance(
            model, values, source.measured, iterations.instruments, solution
        )
        words = "sigma is the scatter between blocks of time: the noise could not be measured."
    norms = found.residual_norms(values)
    freedom = found.rows - solution.rank
    variance = float(np.sum((norms * solution.weights) ** 2)) / freedom
    textbook = textbook_covariance(model, solution, variance)
    torques = found.torque_norms
    history = Convergence(
        names=model.names,
        units=model.units,
        start=iterations.start,
        start_name=iterations.start_name,
        rounds=tuple(iterations.rounds),
        ending=iterations.ending,
        message=iterations.message,
        sigma=np.sqrt(np.diag(covariance)),
        textbook_sigma=np.sqrt(np.diag(textbook)),
        expected_bias=np.where(_sure(bias), bias.values, np.nan),
        sampling_bias=bias.sampling,
        position_std=noise.position_std,
        torque_std=noise.torque_std,
        noise_source=noise.source,
    )
    return Estimate(
        model=model,
        values=values,
        covariance=held(covariance, _held(bias)),
        basis=solution.basis,
        torque_std=residual_std(found, solution.values, solution.rank),
        joint_errors=norms / np.where(torques > 0, torques, np.nan),
        error=found.relative(norms),
        condition_number=solution.condition_number,
        rows=found.rows,
        method=method,
        status=history.sentence,
        headline=_shifted_by_sampling(source.measured.filter, bias, history),
        notes=(*_doubted(noise), *_notes(model, solution, history, bias), *source.notes),
        sources=sources_of(source.measured),
        history=history,
        sigma_words=words,
    )


def _noise(
    model: Model, source: InstrumentSource, iterations: Iterations
) -> tuple[NoiseLevel, ExpectedBias]:
    given, measured = source.measured.noise, source.measured
    position = given.position_std if given else position_noise(source, iterations.instruments)
    position = np.asarray(position, dtype=float)
    bias = expected_bias(
        model,
        iterations.values,
        iterations.instruments,
        iterations.solution,
        position,
        iterations.simulated,
        _run_of(source, iterations),
    )
    if given:
        torque = np.asarray(given.torque_std, dtype=float)
        return NoiseLevel(position, torque, "given"), bias
    found = residual_noise(
        model,
        iterations.values,
        measured,
        iterations.instruments,
        position,
        iterations.solution.rank,
    )
    return noise_level(model.robot.names, found), bias


def _run_of(source: InstrumentSource, iterations: Iterations) -> SimulatedRun | None:
    """The simulation behind the instruments; None where no loop is known, or a later one failed."""
    if not isinstance(source, LoopSource) or source.last_run is None:
        return None
    if iterations.simulated is None:
        return None
    same = np.array_equal(source.last_run.values, iterations.simulated)
    return source.last_run if same else None


def _doubted(noise: NoiseLevel) -> tuple[str, ...]:
    """The complaint that the residual is no noise; empty where it may be."""
    if not noise.doubt:
        return ()
    return (
        f"The noise could not be measured: {noise.doubt}. State it in [noise], or look for what "
        "the model lacks.",
    )


def _notes(
    model: Model, solution: InstrumentalSolution, history: Convergence, bias: ExpectedBias
) -> tuple[str, ...]:
    notes = [*unidentified(solution.basis), *nearly_hidden(model.base)]
    if history.message:
        notes.append(f"{history.ending.value.capitalize()}: {history.message}.".replace("?.", "?"))
    if any(one.way.projected for one in history.rounds):
        last = "the last" if history.rounds[-1].way.projected else "some"
        notes.append(
            f"The estimate before {last} of the iterations has no motion (its inertia matrix is "
            "not positive definite, say): the nearest possible robot was simulated in its place."
        )
    if history.rounds and history.rounds[-1].correlation < _WEAK:
        notes.append(
            "Weak instruments: in one direction they have next to nothing in common with the "
            f"regressor (canonical correlation {history.rounds[-1].correlation:.2g}); "
            "its standard deviation says what is left."
        )
    dry = [label for label in (e.label for e in model.effects) if _is_dry(model, label)]
    which = reported(_held(bias), history.sigma)
    if dry:
        notes.append(
            "Instruments do not correct the columns of dry friction: the mean of "
            "tanh((v + noise)/w) is not tanh(v/w), however long the recording. "
            "See the expected bias."
        )
    if which.size:
        notes.append(
            "Expected bias, from simulating the same motion with encoder noise of this size "
            f"(in sigma, not subtracted): {listed(model, bias.values, which)}."
        )
    clock = np.flatnonzero(np.abs(bias.sampling) > history.sigma)
    if clock.size:
        notes.append(
            "Sampling (central differences, held torques, filters) shifts some parameters by more "
            f"than their noise, which the intervals do not hold (not subtracted): "
            f"{listed(model, bias.sampling, clock)}."
        )
    return tuple(notes)


def _shifted_by_sampling(filter: Filter | None, bias: ExpectedBias, history: Convergence) -> str:
    """What is to be read before any number: sampling shifts the values by far more than sigma."""
    shift, sigma = np.abs(bias.sampling), history.sigma
    shifted = np.flatnonzero((sigma > 0) & (shift > _SHIFTED * sigma))
    if not shifted.size:
        return ""
    most = shifted[np.argmax(shift[shifted] / sigma[shifted])]
    remedy = "Record at a higher rate."
    if filter is not None and filter.order == ORDERS[0]:
        remedy = "Differences of fourth order (difference_order = 4 in the filter) shift them less."
    return (
        f"Sampling shifts {shifted.size} of {len(sigma)} parameters by more than "
        f"{number(_SHIFTED, 2)} sigma, {history.names[most]} by "
        f"{number(float(shift[most] / sigma[most]), 2)}: sigma does not hold that, and gives no "
        f"95 % intervals of these. {remedy}"
    )


def _sure(bias: ExpectedBias) -> np.ndarray:
    return np.abs(bias.values) > _SURE * bias.uncertainty


def _held(bias: ExpectedBias) -> np.ndarray:
    """The bias (p,) as far as the draws are sure of it."""
    return np.where(_sure(bias), bias.values, 0.0)


def _is_dry(model: Model, label: str) -> bool:
    """Whether an effect's columns depend on the width of the friction law."""
    effect = model.effect(label)
    if effect.needs_recording:
        return False
    n = model.robot.n
    speed = model.friction_widths[None].copy()
    block = model.block(np.zeros(1), np.zeros((1, n)), speed, np.zeros((1, n)))
    block = replace(model.ready(effect, block, None), torque=np.ones((1, n)))
    wider = replace(block, friction_width=2.0 * model.friction_widths)
    return bool(np.any(effect.columns(block) != effect.columns(wider)))
