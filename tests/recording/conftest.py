import os
from pathlib import Path

import numpy as np
import pytest

from dynident.recording import Recording

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def measured():
    """Path of a measured data set, or the reason why it is not there."""
    folder = Path(os.environ.get("DYNIDENT_DATA") or ROOT.parent / "shared" / "data")

    def find(name: str) -> Path:
        path = folder / name
        if not path.exists():
            pytest.skip(f"no {name} in {folder} (DYNIDENT_DATA names the folder)")
        return path

    return find


@pytest.fixture
def arm():
    """Two joints, 4 s at 250 Hz, period 1 s."""
    t = np.arange(1000) / 250
    w = 2 * np.pi
    q = np.column_stack([np.sin(w * t) + 0.2 * np.cos(3 * w * t), 0.5 * np.cos(2 * w * t)])
    v = np.gradient(q, t, axis=0)
    return Recording(
        t, q, 3 * q, ("shoulder", "elbow"), v=v, q_ref=q + 1e-3, period=1.0, name="arm"
    )
