"""The instrumental variable estimator, and where its iterations begin."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace
from typing import ClassVar, Literal, get_args

import numpy as np

from dynident.arguments import checked
from dynident.closed_loop import Controller
from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.instrumental.estimate_assembly import assemble
from dynident.fitting.instrumental.iv_iterations import Iterations, IterationSettings
from dynident.fitting.instrumental.simulated_loop import LoopSource, SimulatedLoop
from dynident.fitting.instrumental.source import (
    Guess,
    Instruments,
    InstrumentSource,
    ProgressCallback,
    silent,
)
from dynident.fitting.least_squares import LeastSquares
from dynident.model import Model
from dynident.recording import Dataset, with_suited_order
from dynident.threads import single_threaded

Start = Literal["least_squares", "description", "regular"]
START_NAMES: tuple[str, ...] = get_args(Start)


@checked
@dataclass(frozen=True)
class IV:
    """Instrumental variables: x = (V' W)^-1 V' y, V from motion that has not the measured noise.

    With noisy positions the regressor W is noisy too, and least squares is wrong however long the
    recording. V, the same columns along a motion without that noise, corrects this. Where V comes
    from the simulated loop of the last estimate, the two are iterated to a fixed point.

    Unlike least squares, this takes recordings as a whole: memory grows with their length.

    Parameters
    ----------
    instruments : a `Controller`, for the simulated loop with its defaults; a `SimulatedLoop`;
        `SwappedPeriods`; or `Filtered`.
    start : "least_squares"; "description", of the robot, without effects; "regular", every rotor
        inertia (or inertia about the joint's axis) 1 and all else 0; or an earlier estimate of the
        same model.
    weighting : "joint" weights each joint's rows with the standard deviation of its residual.
    tolerance : the iterations stop when the norm of y - V x changes by less, relatively.
    rounds : at most so many iterations.
    progress : called with what is being done, how much is done, and how much there is to do.

    Notes
    -----
    Janot, Vandanjon and Gautier, "An instrumental variable approach for rigid industrial robots
    identification" (preprint 2010), equations 28 to 34.
    """

    instruments: Controller | Instruments
    _: KW_ONLY
    start: Start | Estimate = "least_squares"
    weighting: Literal["joint", "none"] = "joint"
    tolerance: float = 1e-2
    rounds: int = 20
    progress: ProgressCallback = field(default=silent, compare=False)
    name: ClassVar[str] = "instrumental variables"

    def __post_init__(self) -> None:
        if not hasattr(self.chosen, "prepare"):
            what = f"a {type(self.instruments).__name__} is no choice of instruments"
            remedy = (
                "give the study's controller (a [controller] table), SwappedPeriods() or Filtered"
            )
            raise FitError(what, "IV", remedy)
        if not isinstance(self.start, Estimate) and self.start not in START_NAMES:
            remedy = f"choose {', '.join(START_NAMES)}, or give an estimate"
            raise FitError(f"start = {self.start!r}", "IV", remedy)
        if not 0 < self.tolerance < 1 or self.rounds < 1:
            what = f"tolerance = {self.tolerance!r}, rounds = {self.rounds!r}"
            raise FitError(what, "IV", "choose a tolerance between 0 and 1, and 1 round or more")

    @property
    def chosen(self) -> Instruments:
        """The instruments: a controller alone stands for its simulated loop."""
        if isinstance(self.instruments, Controller):
            return SimulatedLoop(self.instruments)
        return self.instruments

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are fixed.

        Raises
        ------
        FitError
            If the recordings cannot carry the model or the instruments, or lose rank.
        SimulationError
            If not even the start can be simulated.
        """
        iterations = self.iterated(model, dataset)
        return assemble(f"{self.name}, {self.chosen.name}", iterations)

    def iterated(self, model: Model, dataset: Dataset) -> Iterations:
        """Return the iterations of a fit, done.

        Raises
        ------
        FitError, SimulationError
            As `fit`.
        """
        if not dataset.recordings:
            raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
        dataset = _without_bias(dataset)
        first = LeastSquares(self.weighting, "independent").fit(model, dataset)
        start = start_values(self.start, model, first)
        guess = Guess(start, (model.given_values(), first.values), self.progress)
        source = self.chosen.prepare(model, dataset, guess)
        name = "an earlier estimate" if isinstance(self.start, Estimate) else self.start
        if self.start == "least_squares" and _hopeless(source, start):
            start = start_values("regular", model, first)
            name = "regular (least squares has lost the inertias in noise)"
            source = self.chosen.prepare(model, dataset, replace(guess, start=start))
        settings = IterationSettings(
            weighting=self.weighting,
            tolerance=self.tolerance,
            rounds=self.rounds,
            progress=self.progress,
        )
        iterations = Iterations(settings, model, source, start, name.replace("_", " "))
        iterations.run()
        return iterations


def _without_bias(dataset: Dataset) -> Dataset:
    """The same with the order of raw differences that suits what noise does not bias."""
    if dataset.filter is None or not dataset.filter.suited_order:
        return dataset
    anew = replace(dataset.filter, suited_order=None)
    return replace(dataset, filter=with_suited_order(anew, dataset.recordings, 0.0))


def _hopeless(source: InstrumentSource, start: np.ndarray) -> bool:
    return isinstance(source, LoopSource) and source.next_to_massless(start)


def start_values(start: Start | Estimate, model: Model, least_squares: Estimate) -> np.ndarray:
    """Return the parameters (p,) at which the iterations begin.

    Parameters
    ----------
    start : as of `IV`.
    model : of p parameters.
    least_squares : the estimate of least squares, for a start of that name.

    Raises
    ------
    FitError
        If an earlier estimate is one of another model.
    """
    if isinstance(start, Estimate):
        if start.names != model.names:
            remedy = "fit the same model, or start from least squares"
            raise FitError("the estimate to start from has other parameters", "IV.start", remedy)
        return np.array(start.values)
    if start == "least_squares":
        return least_squares.values
    return regular(model) if start == "regular" else model.given_values()


def regular(model: Model) -> np.ndarray:
    """Return the regular start (Janot et al., equations 48 to 51), (p,).

    Each motor's inertia is 1 where the model has them, else each body's inertia about its joint's
    axis (its mass, if the joint slides); all else is 0. The inertia matrix is then regular at
    every pose.
    """
    values, robot = np.zeros(model.size), model.robot
    theta = np.zeros((robot.n, 10))
    for j, joint in enumerate(robot.joints):
        rotor = model.slices.get(f"rotor_inertia@{joint.name}")
        if rotor is not None:
            values[rotor] = 1.0
        elif joint.kind == "prismatic":
            theta[j, 0] = 1.0
        else:
            x, y, z = joint.axis
            theta[j, 4:] = (x * x, x * y, y * y, x * z, y * z, z * z)
    values[: model.base.rank] = model.base.coordinates(theta.ravel())
    return values
