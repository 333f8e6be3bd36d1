"""dynident: robot model identification that tells you what physics your model lacks.

import dynident as di

study = di.load("problems/emps/study.toml")
fit = di.fit(study.model, study.train)
di.compare(fit, study.test).show()
d = di.diagnose(fit, study.train, study.test)
d.show()
better = di.fit(study.model + d.best.effect, study.train)
di.compare({"before": fit, "after": better}, study.test).show()
di.report(d, to="report.html")
"""

from __future__ import annotations

import importlib
import sys
import types
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Where each public name lives; it is imported when it is first asked for, so that
# `import dynident` and `dynident --help` cost nothing.
_HOME = {
    "BaseParameters": "robot",
    "BayesianFactorRegression": "fit.regression.joint_factors",
    "Bounds": "nlp",
    "CentreInBox": "nlp",
    "CentreInEllipsoid": "nlp",
    "Check": "check",
    "Comparison": "diagnose",
    "Constrained": "fit",
    "Controller": "closed_loop",
    "CorrectedLeastSquares": "fit.regression.corrected",
    "Dataset": "recording",
    "Diagnosis": "diagnose",
    "DynidentError": "errors",
    "DynidentWarning": "errors",
    "Effect": "effects",
    "Estimate": "fit",
    "Experiment": "closed_loop",
    "Filter": "recording",
    "Filtered": "fit",
    "GivenParameters": "fit",
    "IV": "fit",
    "InputNoise": "fit",
    "JointFactorRegression": "fit.regression.joint_factors",
    "Known": "nlp",
    "LeastSquares": "fit",
    "Metric": "fit",
    "Model": "model",
    "Noise": "recording",
    "Prior": "fit",
    "Projection": "fit",
    "Recording": "recording",
    "Refit": "refit",
    "Regression": "fit",
    "Robot": "robot",
    "SimulatedLoop": "fit",
    "Statistics": "fit.regression.statistics",
    "StepwiseRegression": "fit.regression.stepwise",
    "Study": "study",
    "Sum": "nlp",
    "SwappedPeriods": "fit",
    "Symmetric": "nlp",
    "TotalLeastSquares": "fit.regression.total",
    "TotalMass": "nlp",
    "TruncatedLeastSquares": "fit.regression.truncated",
    "Validation": "diagnose",
    "Within": "nlp",
    "catalogue": "effects",
    "check": "check",
    "compare": "diagnose",
    "diagnose": "diagnose",
    "effects_of": "effects",
    "fit": "fit",
    "load": "study",
    "load_estimate": "fit",
    "load_experiment": "closed_loop",
    "project": "fit",
    "read": "recording",
    "read_parameters": "fit",
    "refit": "refit",
    "reliability_profile": "fit.regression.identifiability",
    "report": "report",
    "start_sensitivity": "fit.regression.identifiability",
    "validate": "diagnose",
    "write": "recording",
    "write_experiment": "closed_loop",
}

__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from dynident.check import Check, check
    from dynident.closed_loop import Controller, Experiment, load_experiment, write_experiment
    from dynident.diagnose import (
        Comparison,
        Diagnosis,
        Validation,
        compare,
        diagnose,
        validate,
    )
    from dynident.effects import Effect, catalogue, effects_of
    from dynident.errors import DynidentError, DynidentWarning
    from dynident.fit import (
        IV,
        Constrained,
        Estimate,
        Filtered,
        GivenParameters,
        InputNoise,
        LeastSquares,
        Metric,
        Prior,
        Projection,
        Regression,
        SimulatedLoop,
        SwappedPeriods,
        fit,
        load_estimate,
        project,
        read_parameters,
    )
    from dynident.fit.regression.corrected import CorrectedLeastSquares
    from dynident.fit.regression.identifiability import reliability_profile, start_sensitivity
    from dynident.fit.regression.joint_factors import (
        BayesianFactorRegression,
        JointFactorRegression,
    )
    from dynident.fit.regression.statistics import Statistics
    from dynident.fit.regression.stepwise import StepwiseRegression
    from dynident.fit.regression.total import TotalLeastSquares
    from dynident.fit.regression.truncated import TruncatedLeastSquares
    from dynident.model import Model
    from dynident.nlp import (
        Bounds,
        CentreInBox,
        CentreInEllipsoid,
        Known,
        Sum,
        Symmetric,
        TotalMass,
        Within,
    )
    from dynident.recording import Dataset, Filter, Noise, Recording, read, write
    from dynident.refit import Refit, refit
    from dynident.report import report
    from dynident.robot import BaseParameters, Robot
    from dynident.study import Study, load


# Verbs that share their name with the room they live in.
_VERBS = ("check", "diagnose", "fit", "refit", "report")


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'dynident' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"dynident.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])


def _verb(name: str) -> property:
    # Importing the room `dynident.fit` binds the name `fit` to the module; users mean the verb.
    return property(
        lambda module: getattr(importlib.import_module(f"dynident.{name}"), name),
        lambda module, value: None,
    )


def _by_name(module: types.ModuleType) -> tuple[Any, tuple[str]]:
    # Functions that use it are sent to other processes with it; a module goes as its name.
    return importlib.import_module, (module.__name__,)


sys.modules[__name__].__class__ = type(
    "DynidentModule",
    (types.ModuleType,),
    {"__reduce__": _by_name, **{name: _verb(name) for name in _VERBS}},
)
