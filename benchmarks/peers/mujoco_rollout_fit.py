"""mujoco.sysid: rollouts from the measured states under the commands, fitted to the positions.

Windows of half a second, as an arm under recorded torques drifts away from where it was. All ten
parameters of each link as pseudo-inertia, rotor inertia and damping: from the description's, which
is wrong by as much as the work says.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from answering import answer
from mujoco import sysid

mj: Any = mujoco
tool: Any = sysid

WINDOW = 0.5  # s
ROUNDS = 15
ROWS, COLUMNS = (0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2)
"""Of the six moments of inertia."""


def described(work: Any) -> Any:
    """The description with motors, sensors and a step of one sample."""
    spec = mj.MjSpec.from_string(str(work["urdf"]))
    spec.option.timestep = float(np.mean(np.diff(work["t_sim"])))
    spec.option.integrator = mj.mjtIntegrator.mjINT_RK4
    spec.option.disableflags |= mj.mjtDisableBit.mjDSBL_CONTACT | mj.mjtDisableBit.mjDSBL_LIMIT
    for k, joint in enumerate(spec.joints):
        assign(joint, "armature", float(work["rotors"][k]))
        assign(joint, "damping", float(work["viscous"][k]))
        joint.actfrclimited = False
        motor = spec.add_actuator(name=f"u{k}", target=joint.name)
        motor.trntype = mj.mjtTrn.mjTRN_JOINT
        for kind, name in (
            (mj.mjtSensor.mjSENS_JOINTPOS, "q"),
            (mj.mjtSensor.mjSENS_JOINTVEL, "v"),
        ):
            spec.add_sensor(
                name=f"{name}{k}", type=kind, objtype=mj.mjtObj.mjOBJ_JOINT, objname=joint.name
            )
    return spec


def sequences(work: Any, spec: Any) -> Any:
    """Windows of the recording, each from its measured state."""
    model = spec.compile()
    t, q, v, u = (work[f"{name}_sim"] for name in ("t", "q", "v", "tau"))
    length = round(WINDOW / (t[1] - t[0]))
    states, controls, sensors, names = [], [], [], []
    order = [s.name for s in spec.sensors]
    places = [2 * int(name[1:]) + (name[0] == "v") for name in order]
    both = np.stack([q, v], axis=2).reshape(len(q), -1)[:, places]
    for start in range(0, len(t) - length, length):
        rows = slice(start, start + length + 1)
        clock = t[rows] - t[start]
        states.append(tool.create_initial_state(model, q[start], v[start], np.empty(0)))
        controls.append(tool.TimeSeries(clock, u[rows]))
        sensors.append(tool.TimeSeries.from_names(clock, both[rows], model))
        names.append(f"w{start}")
    return tool.ModelSequences("arm", spec, names, states, controls, sensors)


def parameters(spec: Any) -> Any:
    model = spec.compile()
    found = tool.ParameterDict()
    for joint in spec.joints:
        found.add(
            tool.body_inertia_param(
                spec,
                model,
                joint.parent.name,
                inertia_type=tool.InertiaType.Pseudo,
                modifier=lambda s, p, b=joint.parent.name: apply_inertia(s, p, b),
            )
        )
        for name in ("armature", "damping"):
            start = float(np.ravel(getattr(joint, name))[0])
            found.add(
                tool.Parameter(
                    f"{joint.name}_{name}",
                    nominal=start,
                    min_value=0.1 * start,
                    max_value=10 * start,
                    modifier=lambda s, p, j=joint.name, n=name: assign(s.joint(j), n, p.value[0]),
                )
            )
    return found


def apply_inertia(spec: Any, parameter: Any, body: str) -> None:
    """Do what its own modifier does, whose quaternion of NaN version 4.0.0 does not compile."""
    tool.apply_body_inertia(spec, body, parameter)
    spec.body(body).iquat = [1.0, 0.0, 0.0, 0.0]


def assign(joint: Any, name: str, value: float) -> None:
    """Set a number of a joint; damping is a polynomial whose first coefficient is viscous."""
    size = np.size(getattr(joint, name))
    setattr(joint, name, value if size == 1 else np.r_[value, np.zeros(size - 1)])


def values(spec: Any, work: Any) -> np.ndarray:
    """Ten of each link, rotor inertias, viscous friction."""
    model = spec.compile()
    ten = []
    for joint in spec.joints:
        body = model.body(joint.parent.name)
        rotation = np.zeros(9)
        mj.mju_quat2Mat(rotation, body.iquat)
        R, m, c = rotation.reshape(3, 3), body.mass[0], np.array(body.ipos)
        about = R @ np.diag(body.inertia) @ R.T + m * (c @ c * np.eye(3) - np.outer(c, c))
        ten += [m, *(m * c), *about[ROWS, COLUMNS]]
    names = [model.joint(j.name) for j in spec.joints]
    rotors = [float(j.armature[0]) for j in names]
    viscous = [float(np.ravel(j.damping)[0]) for j in names]
    return np.array([*ten, *rotors, *viscous])


def solve(work: Any, settings: dict[str, str]) -> np.ndarray:
    spec = described(work)
    residual = tool.build_residual_fn(models_sequences=[sequences(work, spec)], n_threads=1)
    rounds = int(settings.get("rounds", ROUNDS))
    found, _ = tool.optimize(
        initial_params=parameters(spec), residual_fn=residual, verbose=False, max_iters=rounds
    )
    tool.apply_param_modifiers_spec(found, spec)
    return values(spec, work)


answer(solve)
