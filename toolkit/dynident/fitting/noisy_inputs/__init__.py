"""Regressions with noise in the inputs as methods of `fit`, and that noise measured or carried.

In: a model, recordings, and the noise of the inputs (`input_noise` from repetitions,
`encoder_noise` from the stated noise). Out: an estimate by any regression of
`dynident.regression`, which is loaded when it is used.
"""

from dynident.fitting.noisy_inputs.encoder_noise import encoder_noise
from dynident.fitting.noisy_inputs.measured import InputNoise, input_noise
from dynident.fitting.noisy_inputs.method import Regression

__all__ = ["InputNoise", "Regression", "encoder_noise", "input_noise"]
