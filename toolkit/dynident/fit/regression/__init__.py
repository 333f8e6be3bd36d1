"""Linear regression from sufficient statistics: noise of the inputs, and what it is compared with.

The estimators have scikit-learn's interface; they are imported where they are used, since that
library takes its time.
"""

from dynident.fit.regression.method import Regression

__all__ = ["Regression"]
