"""Where a model fails, and which physical effects it lacks."""

from dynident.diagnose.compare import Comparison, compare, compare_models
from dynident.diagnose.diagnosis import Candidate, Diagnosis, JointResult, ResidualMap, Step
from dynident.diagnose.procedure import diagnose
from dynident.diagnose.replay import validate
from dynident.diagnose.validation import Validation

__all__ = [
    "Candidate",
    "Comparison",
    "Diagnosis",
    "JointResult",
    "ResidualMap",
    "Step",
    "Validation",
    "compare",
    "compare_models",
    "diagnose",
    "validate",
]
