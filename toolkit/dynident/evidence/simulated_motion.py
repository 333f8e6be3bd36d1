"""Motion without noise, from the closed loop simulated: instruments where nothing repeats.

The columns of a noisy motion are biased. Where a motion repeats, each repetition is an instrument
for the others. Where it does not, but the controller and its references are known, the fitted
model is simulated in the same loop, with ideal sensors: its motion is near the true one and knows
nothing of the noise. How the two enter the regression is said in `Run.moved`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Effect
from dynident.errors import DynidentError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Run, gather, resimulated
from dynident.fitting.history import Ending
from dynident.model import Model
from dynident.recording import Dataset


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulatedMotion:
    """The recordings' references in the simulated loop of the fitted model.

    Attributes
    ----------
    runs : the recordings with the simulated motion as their last replicate; empty where none could
        be simulated, or none is needed.
    notes : caveats, for the reader of the diagnosis.
    controller : of the loop.
    measured : the recordings behind `runs`.
    left_out : effects of the fitted model that are not in its simulation.
    """

    runs: tuple[Run, ...] = ()
    notes: tuple[str, ...] = ()
    controller: Controller | None = None
    measured: Dataset | None = None
    left_out: tuple[Effect, ...] = ()

    def renewed(self, evidence: Evidence, fitted: EvidenceFit) -> tuple[SimulatedMotion, Evidence]:
        """Simulate another model: what is known of its motion, and the evidence with it.

        What cannot be simulated is left out, with a note; where nothing can, the motion stays, and
        the evidence is the very same.

        Parameters
        ----------
        evidence : with the motions of an earlier model.
        fitted : the model to be simulated.
        """
        if self.controller is None or self.measured is None:
            return self, evidence
        model, values = fitted.model, fitted.values
        payload_recordings = [run.recording.payload for run in evidence.runs]
        recordings = (
            one.replace(payload=carries)
            for one, carries in zip(self.measured.recordings, payload_recordings, strict=True)
        )
        measured = replace(self.measured, recordings=tuple(recordings))
        problem, note = "", ()
        for effects in _ever_fewer(model.effects, self.left_out):
            part, own = _without(model, values, effects)
            try:
                simulated = _simulated(self.controller, part, own, measured)
                runs = resimulated(evidence.runs, simulated)
            except DynidentError as error:
                problem = problem or str(error)
                continue
            if effects and effects != self.left_out:
                names = ", ".join(effect.title for effect in effects)
                note = (f"Instruments: simulated without {names} ({problem}).",)
            renewed = replace(self, runs=runs, left_out=effects, notes=(*self.notes, *note))
            return renewed, evidence.with_runs(runs).looked_at_anew()
        note = (f"Instruments: the motion of an earlier model, as {problem}.",)
        return replace(self, notes=(*self.notes, *note)), evidence


def motion_of_loop(
    model: Model,
    dataset: Dataset,
    controller: Controller | None,
    progress: Callable[[str], None] = lambda _: None,
    criteria: Criteria = DEFAULTS,
) -> SimulatedMotion:
    """Simulate a model, fitted with the simulation's instruments, in its recorded loop.

    Parameters
    ----------
    model : as given.
    dataset : recordings to fit.
    controller : of their loop; None where it is not known.
    progress : is called with what is being done, for a display.
    criteria : rounds and tolerance of the fit, copies and blocks of the recordings.

    Returns
    -------
    Without runs where a motion repeats (it is its own instrument), where the controller or a
    reference is missing, or where the loop cannot be simulated.
    """
    if controller is None or any(recording.period for recording in dataset.recordings):
        return SimulatedMotion()
    if not all(recording.q_ref is not None for recording in dataset.recordings):
        note = "The loop is not simulated for instruments: not every recording has q_ref."
        return SimulatedMotion(notes=(note,))

    from dynident.fitting.instrumental import IV, SimulatedLoop  # which loads the simulator

    def report(what: str, done: float, total: float) -> None:
        progress(f"{what}, {100 * done / total:.0f} %" if total else what)

    method = IV(
        SimulatedLoop(controller),
        rounds=criteria.fit.instrument_rounds,
        tolerance=criteria.fit.instrument_tolerance,
        progress=report,
    )
    try:
        found = method.iterated(model, dataset)
        runs = gather(
            found.source.measured,
            criteria.noise,
            simulated=found.instruments,
            samples_hz=criteria.fit.samples_hz,
        )
    except DynidentError as error:
        return SimulatedMotion(notes=(f"The loop cannot be simulated for instruments: {error}",))
    notes = found.source.notes
    if found.ending is Ending.DOUBTFUL_LOOP:
        notes = (*notes, found.message[0].upper() + found.message[1:])
    return SimulatedMotion(
        runs=runs, notes=notes, controller=controller, measured=found.source.measured
    )


def _simulated(
    controller: Controller, model: Model, values: np.ndarray, measured: Dataset
) -> Dataset:
    from dynident.fitting.instrumental import SimulatedLoop
    from dynident.fitting.instrumental.source import Guess

    # Believed are the inertias of these very values: the gains are the real loop's, as stated.
    source = SimulatedLoop(controller).prepare(model, measured, Guess(values, (values,)))
    return source.at(values)


def _ever_fewer(effects: tuple[Effect, ...], known: tuple[Effect, ...]):
    """What to leave out of a simulation: what had to be before, then one more from the end."""
    labels = {effect.label for effect in known}
    yield tuple(effect for effect in effects if effect.label in labels)
    for count in range(1, len(effects) + 1):
        yield effects[-count:]


def _without(
    model: Model, values: np.ndarray, effects: tuple[Effect, ...]
) -> tuple[Model, np.ndarray]:
    keep = np.ones(model.size, dtype=bool)
    for effect in effects:
        keep[model.slices[effect.label]] = False
    labels = {effect.label for effect in effects}
    kept = tuple(effect for effect in model.effects if effect.label not in labels)
    return replace(model, effects=kept), values[keep]
