"""Closed loops, compiled or in Drake, and virtual experiments.

Drake is loaded when it simulates something.

In: a `Mechanism` (a robot with the effects that it truly has), a `Reference` and a `Controller`.
Out: `simulate` gives `Rollout`s; `retrace` runs measured references again; an `Experiment` records
virtual measurements, which `write_experiment` writes with a study. A new kind of controller is an
entry of `controllers.LAWS`.
"""

from dynident.closed_loop.compiled.loop_function import loop_evaluations
from dynident.closed_loop.controllers import Controller, ControllerFile
from dynident.closed_loop.experiments.experiment import Experiment, ExperimentRun
from dynident.closed_loop.experiments.experiment_file import load_experiment
from dynident.closed_loop.experiments.virtual_study import write_experiment
from dynident.closed_loop.loop import ClosedLoop, simulate
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.references import Reference, SampledReference
from dynident.closed_loop.retrace import EncoderNoise, Retraced, retrace
from dynident.closed_loop.rollout import Rollout, Task
from dynident.closed_loop.sensors import Sensors
from dynident.closed_loop.splines import BSpline, Trajectory
from dynident.closed_loop.trajectories import Fourier
from dynident.closed_loop.true_effects import TrueEffect

__all__ = [
    "BSpline",
    "ClosedLoop",
    "Controller",
    "ControllerFile",
    "EncoderNoise",
    "Experiment",
    "ExperimentRun",
    "Fourier",
    "Mechanism",
    "Reference",
    "Retraced",
    "Rollout",
    "SampledReference",
    "Sensors",
    "Task",
    "Trajectory",
    "TrueEffect",
    "load_experiment",
    "loop_evaluations",
    "retrace",
    "simulate",
    "write_experiment",
]
