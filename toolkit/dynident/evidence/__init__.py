"""What recordings say of a model: replicates, columns, noise, held-out errors, residual maps.

In: models or estimates, and recordings. Out: a `Comparison`, and what the diagnosis works on.
"""

from dynident.evidence.comparison import Comparison, compare, compare_models
from dynident.evidence.maps import ResidualMap

__all__ = ["Comparison", "ResidualMap", "compare", "compare_models"]
