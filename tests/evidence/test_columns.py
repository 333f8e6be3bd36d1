"""Columns of the evidence: the same whichever way they are made."""

from __future__ import annotations

import numpy as np

from dynident.effects import catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values


def test_columns_linear_in_the_torque_may_be_made_of_filtered_torque() -> None:
    model = Model(arm()) + "viscous_friction" + "coulomb_friction" + "payload"
    truth = true_values(model, Fv__shoulder=1.2, Fc__elbow=0.6, **{"payload.mass": 0.4})
    run = synthetic(model, truth, 0, rate_hz=250.0, payload=True)
    evidence = Evidence(model, gather(Dataset((run,))))
    linear = [e for e in catalogue().values() if e.linear_in_torque]
    assert linear
    for kind in linear:
        for effect in kind.candidates(model.robot):
            quick = evidence.of(effect, 0, model, truth)[0]
            replicate = evidence.runs[0].replicates[0]
            block = replicate.block(model)
            slow = replicate.filtered(model.torque_without_loads(block, truth))
            joint = model.robot.names.index(str(effect.joint))
            assert np.allclose(quick[:, 0, 0], slow[:, joint], rtol=1e-9, atol=1e-9)
