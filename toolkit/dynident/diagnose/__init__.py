"""Where a model fails, and which physical effects it lacks."""

from dynident.diagnose.compare import Comparison, compare, compare_models
from dynident.diagnose.diagnosis import Candidate, Diagnosis, JointResult, ResidualMap, Step
from dynident.diagnose.procedure import diagnose

__all__ = [
    "Candidate",
    "Comparison",
    "Diagnosis",
    "JointResult",
    "ResidualMap",
    "Step",
    "compare",
    "compare_models",
    "diagnose",
]
