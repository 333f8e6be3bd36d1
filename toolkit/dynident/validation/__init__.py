"""The recorded closed loop simulated once more with the identified robot, as a judge of a model.

In: an estimate, recordings and a controller. Out: a `Validation`.
"""

from dynident.validation.replay import validate
from dynident.validation.validation_result import Validation

__all__ = ["Validation", "validate"]
