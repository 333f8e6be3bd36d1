"""How well least squares knows what it says: rows that share noise, and models that do not fit.

In: a model, recordings and a solution. Out: its covariance, and words for what that holds.
"""
