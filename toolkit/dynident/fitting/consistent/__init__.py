"""Estimates under constraints: metric, prior, projection, constrained least squares."""
