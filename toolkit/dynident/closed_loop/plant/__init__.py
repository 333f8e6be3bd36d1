"""The plant in Drake: bodies, effects and drivetrains as one diagram, stepped sample by sample.

In: mechanisms side by side, the samples of their references, and a drive. Out: a `SteppedMotion`.
"""
