"""Second moments of rows, of which every linear estimate is made.

In: blocks of rows [instruments | regressor | torque]. Out: `TriangularFactors`, their square root,
for least squares and instrumental variables; or `SecondMoments`, their products, for the
regressions and, free of noise, for the diagnosis. Both add up over blocks, recordings and joints.
"""

from dynident.moments.factors import TriangularFactors, factorise
from dynident.moments.second_moments import SecondMoments

__all__ = ["SecondMoments", "TriangularFactors", "factorise"]
