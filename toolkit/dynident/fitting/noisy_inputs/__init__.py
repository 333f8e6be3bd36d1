"""Regressions with noise in the inputs as methods of `fit`, and that noise measured or carried.

The estimators themselves are in `dynident.regression`; they are imported where they are used.
"""

from dynident.fitting.noisy_inputs.encoder_noise import encoder_noise
from dynident.fitting.noisy_inputs.measured import InputNoise, input_noise
from dynident.fitting.noisy_inputs.method import Regression

__all__ = ["InputNoise", "Regression", "encoder_noise", "input_noise"]
