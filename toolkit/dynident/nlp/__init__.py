"""Identification posed as nonlinear and conic programs.

`Program` is any nonlinear program: variables, residuals, costs, constraints; Ipopt solves it.
`Problem` states what is to be minimised within which set; `pose_conic` puts it to Clarabel through
Drake, `pose` to Ipopt through CasADi, and `certify` says how far an answer is from the optimum.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from dynident.nlp.certificate import (
    Bound,
    Certificate,
    certify,
    lower_bound,
    unconstrained_bound,
)
from dynident.nlp.conic import ConicProgram, ConicSolution, Multipliers, pose_conic, solve_conic
from dynident.nlp.nearest import nearest_body
from dynident.nlp.problem import Entropy, Problem
from dynident.nlp.sets import (
    Bounds,
    CentreInBox,
    CentreInEllipsoid,
    Consistency,
    ConstraintSet,
    Known,
    Linear,
    SecondOrder,
    Sum,
    Symmetric,
    TotalMass,
    Vanishing,
    Within,
)
from dynident.nlp.space import ParameterSpace, link_lengths, reference_bodies, stated_links
from dynident.nlp.status import Status

# CasADi takes a third of a second to load: only who poses a nonlinear program waits for it.
_CASADI = {
    "Attempt": "ipopt",
    "Constraint": "blocks",
    "Cost": "blocks",
    "NonlinearSolution": "parametrised",
    "Posed": "parametrised",
    "Program": "program",
    "ProgramSolution": "program",
    "Residual": "blocks",
    "Variable": "blocks",
    "pose": "parametrised",
    "solve_nonlinear": "parametrised",
}

if TYPE_CHECKING:
    from dynident.nlp.blocks import Constraint, Cost, Residual, Variable
    from dynident.nlp.ipopt import Attempt
    from dynident.nlp.parametrised import NonlinearSolution, Posed, pose, solve_nonlinear
    from dynident.nlp.program import Program, ProgramSolution


def __getattr__(name: str) -> Any:
    if name not in _CASADI:
        raise AttributeError(f"module 'dynident.nlp' has no attribute '{name}'")
    return getattr(importlib.import_module(f"dynident.nlp.{_CASADI[name]}"), name)


__all__ = [
    "Attempt",
    "Bound",
    "Bounds",
    "CentreInBox",
    "CentreInEllipsoid",
    "Certificate",
    "ConicProgram",
    "ConicSolution",
    "Consistency",
    "Constraint",
    "ConstraintSet",
    "Cost",
    "Entropy",
    "Known",
    "Linear",
    "Multipliers",
    "NonlinearSolution",
    "ParameterSpace",
    "Posed",
    "Problem",
    "Program",
    "ProgramSolution",
    "Residual",
    "SecondOrder",
    "Status",
    "Sum",
    "Symmetric",
    "TotalMass",
    "Vanishing",
    "Variable",
    "Within",
    "certify",
    "link_lengths",
    "lower_bound",
    "nearest_body",
    "pose",
    "pose_conic",
    "reference_bodies",
    "solve_conic",
    "solve_nonlinear",
    "stated_links",
    "unconstrained_bound",
]
