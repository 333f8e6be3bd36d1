"""Which physical effects a model lacks: the search, its verdict, and what to record next.

In: a model (or an estimate) and recordings. Out: a `Diagnosis`.
"""

from dynident.diagnosis.details import Candidate, JointResult, Step
from dynident.diagnosis.procedure import diagnose
from dynident.diagnosis.result import Diagnosis

__all__ = ["Candidate", "Diagnosis", "JointResult", "Step", "diagnose"]
