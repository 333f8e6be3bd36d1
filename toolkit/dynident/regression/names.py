"""The names of regressions: what the command line offers before any library is loaded."""

REGRESSIONS = (
    "truncated",
    "ridge",
    "lasso",
    "pls",
    "stepwise",
    "total",
    "corrected",
    "factors",
    "bayes",
)
"""Regressions that `dynident.fitting.Regression` knows by name."""
WITH_INPUT_NOISE = ("corrected", "factors", "bayes")
"""Those that have a place for the noise of their inputs."""
