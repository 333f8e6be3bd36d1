"""Linear regression from sufficient statistics: noise of the inputs, and what it is compared with.

In: rows, or their `SecondMoments`. Out: estimators with scikit-learn's interface. They are imported
when they are asked for, since that library takes its time.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
