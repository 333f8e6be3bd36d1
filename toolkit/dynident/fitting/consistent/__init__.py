"""Estimates under constraints: metric, prior, projection, constrained least squares.

In: an estimate with what its data know (`Metric`), or recordings; a `Prior`; the set that is
allowed. Out: the nearest robot within it, with a certificate (`Projection`, `Constrained`).
"""
