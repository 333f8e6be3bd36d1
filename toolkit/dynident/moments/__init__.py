"""Second moments of rows: triangular factors, and moments free of noise from replicates."""

from dynident.moments.factors import TriangularFactors, factorise

__all__ = ["TriangularFactors", "factorise"]
