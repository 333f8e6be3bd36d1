"""What is claimed of measured records, asked of the diagnoses that notebooks make of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.data_files import find_data
from dynident.diagnosis import Diagnosis
from dynident.errors import FileError

PROBLEMS = Path(__file__).parents[2] / "problems"


def of_emps(found: Diagnosis) -> None:
    """The rigid body alone leads to asymmetric friction and a ripple, and no further."""
    assert found.before.model.effects == ()
    names = [step.effect.name for step in found.steps]
    assert set(names[:2]) == {"coulomb_friction", "viscous_friction"}
    assert names[2:] == ["torque_offset", "asymmetric_friction", "torque_ripple"]
    errors = [step.test_error_after for step in found.steps]
    assert errors == sorted(errors, reverse=True)
    assert found.test_error.after == pytest.approx(0.0297, abs=0.0015)
    # A line in the force every 2.5 mm, whichever half of the record is looked at.
    (k,) = found.steps[-1].effect.shape
    assert 2e3 * np.pi / k == pytest.approx(2.5, abs=0.01)
    assert found.noise_source == "replicates"
    # What remains is four times what differs from one repetition to the next: that is said.
    assert found.verdict == "unexplained"
    assert not any(c.status == "material" for c in found.remaining)


def of_the_drafted_tx40(found: Diagnosis) -> None:
    """A draft of the raw columns is explained as the study by hand."""
    try:
        find_data("staubli_tx40/recording.npz", PROBLEMS / "staubli_tx40")
    except FileError:
        return  # a simulated record stands in its place
    first = {step.effect.label for step in found.steps[:2]}
    assert first == {"joint_coupling@joint5:joint6", "joint_coupling@joint6:joint5"}
    assert found.steps[1].test_error_after <= 0.06


OF_NOTEBOOKS = {
    "01_find_the_missing_effect": "if emps:\n    claims.of_emps(found)",
    "06_your_robot_in_fifteen_minutes": "claims.of_the_drafted_tx40(d)",
}
"""What is asked where a notebook has ended, by its name."""
