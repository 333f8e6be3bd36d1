"""Closed loops in Drake, and virtual experiments. Drake is loaded when something is simulated."""

from dynident.closed_loop.controllers import Controller, ControllerFile
from dynident.closed_loop.experiment import Experiment, Run
from dynident.closed_loop.experiment_file import load_experiment
from dynident.closed_loop.mechanism import Mechanism, TrueEffect
from dynident.closed_loop.rollout import Rollout, Task
from dynident.closed_loop.sensors import Sensors
from dynident.closed_loop.trajectories import Fourier
from dynident.closed_loop.virtual_study import write_experiment

__all__ = [
    "Controller",
    "ControllerFile",
    "Experiment",
    "Fourier",
    "Mechanism",
    "Rollout",
    "Run",
    "Sensors",
    "Task",
    "TrueEffect",
    "load_experiment",
    "write_experiment",
]
