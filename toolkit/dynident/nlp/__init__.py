"""Identification posed as nonlinear and conic programs.

`Program` is any nonlinear program: variables, residuals, costs, constraints; Ipopt solves it.
`Problem` states what is to be minimised within which set; `pose_conic` puts it to Clarabel through
Drake, `pose` to Ipopt through CasADi, and `certify` says how far an answer is from the optimum.
"""

from dynident.nlp.blocks import Constraint, Cost, Residual, Variable
from dynident.nlp.certificate import Bound, Certificate, certify, lower_bound
from dynident.nlp.conic import ConicProgram, ConicSolution, Multipliers, pose_conic, solve_conic
from dynident.nlp.nearest import nearest_body
from dynident.nlp.parametrised import NonlinearSolution, Posed, pose, solve_nonlinear
from dynident.nlp.problem import Entropy, Problem
from dynident.nlp.program import Program
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
from dynident.nlp.solution import Attempt, ProgramSolution
from dynident.nlp.space import ParameterSpace, link_lengths, reference_bodies, stated_links
from dynident.nlp.status import Status

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
]
