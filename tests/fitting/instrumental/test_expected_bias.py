"""The bias that is printed for dry friction, against that of many recordings."""

from __future__ import annotations

import numpy as np
import pytest

import dynident as di
import two_link_loop as lab
from dynident.recording import Dataset, Noise

STD, TORQUE = 1e-4, (0.4, 0.2)


@pytest.mark.slow
def test_a_robot_that_follows_its_encoders_blurs_its_friction_by_as_much_as_is_said() -> None:
    """Noise that is only added behind the loop foretells a sixth of it."""
    model = lab.model()
    truth = lab.truth(model)
    at = [model.names.index(name) for name in ("Fv@elbow", "Fc@elbow")]
    loop = lab.Lab(seconds=5.0, position_std=STD, torque_std=TORQUE)
    noise = Noise(np.full(2, STD), np.array(TORQUE))
    errors, said = [], []
    for one in loop.recordings(range(7200, 7216)):
        method = di.IV(lab.controller(), start="description")
        found = di.fit(model, Dataset((one,), None, noise), method)
        assert found.history is not None
        errors.append((found.values - truth)[at])
        said.append(found.history.expected_bias[at])
    errors, said = np.mean(errors, axis=0), np.nanmean(said, axis=0)
    assert errors[0] > 0.01 and errors[1] < -0.02
    np.testing.assert_allclose(said, errors, rtol=0.35)
