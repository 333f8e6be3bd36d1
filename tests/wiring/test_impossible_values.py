"""Inertias and frictions that no robot has are never called complete."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.recording import Dataset
from dynident.wiring import impossible_values
from dynident.wiring.wiring_rows import WiringRows, rows_of
from study_files import recording, true_model
from synthetic import true_values

MODEL = true_model()
POSSIBLE = true_values(MODEL, Fv__shoulder=2.0, Fv__elbow=1.0, Fc__elbow=1.5)


def rows() -> WiringRows:
    return rows_of(Dataset((recording(0),)), 200, 5.0)


def said(values: np.ndarray, std: float = 1e-3) -> tuple[str, ...]:
    covariance = std**2 * np.eye(MODEL.size)
    return impossible_values(MODEL, values, covariance, rows(), DEFAULTS.wiring)


def test_a_true_robot_is_possible() -> None:
    assert said(POSSIBLE) == ()


@pytest.mark.parametrize(
    ("name", "value", "where"),
    [("Fv@shoulder", -2.0, "friction at shoulder"), ("Fc@elbow", -3.0, "friction at elbow")],
)
def test_negative_friction_is_named(name: str, value: float, where: str) -> None:
    values = np.array(POSSIBLE)
    values[MODEL.names.index(name)] = value
    (clause,) = said(values)
    assert where in clause and "-" in clause and " W" in clause
    assert said(values, std=10.0) == ()  # within three standard deviations nothing is said


def test_a_negative_coefficient_alone_may_be_possible() -> None:
    """Friction that falls with speed has a negative slope, and still takes power."""
    values = np.array(POSSIBLE)
    values[MODEL.names.index("Fv@elbow")] = -0.1
    assert said(values) == ()


def test_negative_inertia_is_named() -> None:
    values = -np.array(POSSIBLE)
    clauses = said(values)
    assert [c for c in clauses if "inertia at shoulder" in c and "kg m^2" in c]
    assert [c for c in clauses if "inertia at elbow" in c]
