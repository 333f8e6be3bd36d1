"""Estimators: from a model and recordings to an `Estimate`.

In: a `Model` and a `Dataset`. `fit` refines the shape parameters of effects and hands the rest to a
`Method`: `LeastSquares`, `Constrained` (physically consistent links), `IV` (instrumental variables)
or `Regression` (noise in the inputs). Out: an `Estimate`, that prints, saves and writes its robot;
`project` moves one to the nearest possible robot. A new estimator is one class, see `Method`.
Each is imported when it is asked for: a study needs few of them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
