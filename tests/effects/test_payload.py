"""A payload sits on the tip, whatever the order of the joints."""

from __future__ import annotations

import numpy as np

from dynident.effects import catalogue
from dynident.model import Model
from dynident.robot import Robot
from synthetic import ARM, arm, smooth_motion


def test_the_tip_does_not_depend_on_the_order_of_the_joints() -> None:
    plain, turned = arm(), Robot.from_text(ARM, joints=["elbow", "shoulder"])
    assert plain.names[plain.tip] == turned.names[turned.tip] == "elbow"
    t, q, v, a = smooth_motion(2, 0, 50.0, 2.0, 2.0)
    payload = catalogue()["payload"]()
    one, two = Model(plain), Model(turned)
    block = one.block(t, q, v, a, carries_payload=True)
    here = payload.columns(one.with_regressor(block))
    swapped = (x[:, ::-1] for x in (q, v, a))
    block = two.block(t, *swapped, carries_payload=True)
    there = payload.columns(two.with_regressor(block))
    assert np.allclose(here, there[:, ::-1])
    values = (1.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.02)
    for robot in (plain, turned):
        loaded = payload.simulated_robot(values, robot)
        change = (loaded.theta - robot.theta).reshape(2, 10)
        assert np.allclose(change[robot.names.index("elbow")], values)
        assert np.allclose(change[robot.names.index("shoulder")], 0.0)
