"""Instrumental variables: estimates that are right although the positions are noisy.

In: a model, recordings, and a choice of `Instruments` (the simulated loop, the other periods, or
filtered measurements). Out: an estimate with the history of its iterations and a covariance that
carries the noise of encoders and torque. Janot, Vandanjon and Gautier, "An instrumental variable
approach for rigid industrial robots identification" (preprint 2010).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
