"""The recorded closed loop simulated once more with the identified robot, as a judge of a model.

In: an estimate, recordings and a controller. Out: a `Validation`.
"""

from dynident.validation.loop_validation import Validation
from dynident.validation.replay import validate

__all__ = ["Validation", "validate"]
