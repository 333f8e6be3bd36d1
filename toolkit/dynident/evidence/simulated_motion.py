"""Motion without noise, from the closed loop simulated: instruments where nothing repeats.

The columns of a noisy motion are biased. Where a motion repeats, each repetition is an instrument
for the others. Where it does not, but the controller and its references are known, the fitted
model is simulated in the same loop, with ideal sensors: its motion is near the true one and knows
nothing of the noise. How the two enter the regression is said in `Run.moved`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Effect
from dynident.errors import DynidentError
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.runs import Run, gather, resimulated, simulated_versions, with_motions
from dynident.fitting.history import Ending
from dynident.fitting.instrumental import IV, SimulatedLoop
from dynident.fitting.instrumental.source import Guess
from dynident.fitting.sampling import Sampled
from dynident.model import Model
from dynident.recording import Dataset, uniform

_LATEST = 8
"""Models whose motions are kept: those along a path are judged again and again."""


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
        measured = _carrying(self.measured, [run.recording.payload for run in evidence.runs])
        found = _motion_of(self.controller, model, values, measured, self.left_out)
        if found.motion is None:
            note = f"Instruments: the motion of an earlier model, as {found.problem}."
            return replace(self, notes=(*self.notes, note)), evidence
        runs, note = resimulated(evidence.runs, found.motion), ()
        if found.left_out and found.left_out != self.left_out:
            names = ", ".join(effect.title for effect in found.left_out)
            note = (f"Instruments: simulated without {names} ({found.problem}).",)
        renewed = replace(self, runs=runs, left_out=found.left_out, notes=(*self.notes, *note))
        return renewed, evidence.with_runs(runs).looked_at_anew()

    def simulator(self, recordings: Dataset) -> RecordedLoop | None:
        """What simulates models on other recordings of the same loop.

        Parameters
        ----------
        recordings : with their references.

        Returns
        -------
        None where these recordings' motions are not simulated.
        """
        if self.controller is None or not all(r.q_ref is not None for r in recordings.recordings):
            return None
        return RecordedLoop(self.controller, recordings)


class RecordedLoop:
    """Simulates models in the loop of some recordings; see `runs.MotionSimulator`.

    The references of the recordings alone drive it: what it says of a model is a prediction.

    Parameters
    ----------
    controller : of the loop.
    recordings : with their references.
    """

    def __init__(self, controller: Controller, recordings: Dataset) -> None:
        self._controller = controller
        straight = tuple(uniform(one) for one in recordings.recordings)
        self._measured = replace(recordings, recordings=straight)
        self._known: OrderedDict[Hashable, tuple[Sampled, ...] | None] = OrderedDict()

    def along(self, runs: tuple[Run, ...], model: Model, values: np.ndarray) -> tuple[Run, ...]:
        """Return the runs with the simulated motion of a model as their last replicate.

        Parameters
        ----------
        runs : the recordings, with or without one.
        model, values : (p,) what is simulated.

        Returns
        -------
        The runs as they are, where it cannot be simulated.
        """
        carried = tuple(run.recording.payload for run in runs)
        key = model.effects, tuple(model.friction_widths), values.tobytes(), carried
        if key not in self._known:
            measured = _carrying(self._measured, carried)
            found = _motion_of(self._controller, model, values, measured).motion
            self._known[key] = None if found is None else simulated_versions(runs, found)
            if len(self._known) > _LATEST:
                self._known.popitem(last=False)
        motions = self._known[key]
        return runs if motions is None else with_motions(runs, motions)


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
        runs = gather(found.source.measured, criteria.noise, simulated=found.instruments)
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
    # Believed are the inertias of these very values: the gains are the real loop's, as stated.
    source = SimulatedLoop(controller).prepare(model, measured, Guess(values, (values,)))
    return source.at(values)


def _carrying(measured: Dataset, payloads: Sequence[bool | None]) -> Dataset:
    """Recordings, marked as carrying the payload, or not, or as nobody knows."""
    pairs = zip(measured.recordings, payloads, strict=True)
    return replace(measured, recordings=tuple(one.replace(payload=each) for one, each in pairs))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Found:
    """The simulated motion of a model; `problem` says why anything is left out of it, or all."""

    motion: Dataset | None
    left_out: tuple[Effect, ...] = ()
    problem: str = ""


def _motion_of(
    controller: Controller,
    model: Model,
    values: np.ndarray,
    measured: Dataset,
    left_out: tuple[Effect, ...] = (),
) -> _Found:
    """Simulate a model in a loop, without what cannot be simulated.

    Parameters
    ----------
    controller, measured : the loop, and recordings of it.
    model, values : (p,) to be simulated.
    left_out : effects that could not be simulated before.
    """
    problem = ""
    for effects in _ever_fewer(model.effects, left_out):
        try:
            motion = _simulated(controller, *_without(model, values, effects), measured)
        except DynidentError as error:
            problem = problem or str(error)
            continue
        return _Found(motion=motion, left_out=effects, problem=problem)
    return _Found(motion=None, problem=problem)


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
