"""Diagnoses with plausible curves, made without the diagnosing room."""

from __future__ import annotations

from dataclasses import replace
from xml.sax.saxutils import quoteattr

import numpy as np

from dynident.diagnosis.details import Candidate, JointResult, Step, TestError, Trace
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.switches import SwitchedOn, Switches
from dynident.effects import Effect, catalogue
from dynident.evidence.maps import ResidualMap
from dynident.fitting.estimate import DataSource, Estimate
from dynident.model import Model
from dynident.robot import Robot, base_parameters

NOISE = 0.08
RECORDINGS = ("run5.csv", "run6.csv")


def arm(*names: str) -> Robot:
    """A planar chain under gravity."""
    parts = ['<robot name="bench arm"><link name="base"/>']
    for i, name in enumerate(names):
        parent = "base" if i == 0 else f"link{i}"
        parts.append(
            f'<link name="link{i + 1}"><inertial><origin xyz="0.15 0.01 0"/><mass value="2"/>'
            '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name={quoteattr(name)} type="revolute"><parent link="{parent}"/>'
            f'<child link="link{i + 1}"/><origin xyz="{0.3 * (i > 0)} 0 0"/><axis xyz="0 1 0"/>'
            '<limit lower="-2" upper="2" effort="90" velocity="4"/></joint>'
        )
    return Robot.from_text("".join(parts) + "</robot>", "arms/bench.urdf")


def effect(name: str, *place: str, shape: tuple[float, ...] = ()) -> Effect:
    return catalogue()[name](*place, shape=shape)


def motion(robot: Robot, run: int, samples: int):
    rng = np.random.default_rng(run)
    t = np.linspace(0.0, 16.0, samples)
    w = 2 * np.pi / 8.0 * np.arange(1, 6)
    phase = np.outer(t, w)
    A, B = rng.normal(size=(2, 5, robot.n)) * 0.3 / np.arange(1, 6)[:, None]
    q = np.sin(phase) @ A + np.cos(phase) @ B
    v = np.cos(phase) @ (A * w[:, None]) - np.sin(phase) @ (B * w[:, None])
    a = -np.sin(phase) @ (A * w[:, None] ** 2) - np.cos(phase) @ (B * w[:, None] ** 2)
    return t, q, v, a


def fitted(model: Model, tau: np.ndarray, block) -> Estimate:
    """Ordinary least squares, enough to have a real `Estimate`."""
    columns = model.columns(block).reshape(-1, model.size)
    basis = base_parameters(columns, model.names, 1e-7)
    kept = list(basis.independent)
    X = columns[:, kept]
    x = np.linalg.lstsq(X, tau.reshape(-1), rcond=None)[0]
    values = model.given_values()
    values[kept] = x
    residual = tau - (X @ x).reshape(tau.shape)
    covariance = np.zeros((model.size, model.size))
    covariance[np.ix_(kept, kept)] = residual.var() * np.linalg.inv(X.T @ X)
    source = DataSource("data/run1.csv", "ab12" * 16, "position 40 Hz, all 18 Hz, at 50 Hz")
    return Estimate(
        model=model,
        values=values,
        covariance=covariance,
        basis=basis,
        torque_std=residual.std(axis=0),
        joint_errors=np.linalg.norm(residual, axis=0) / np.linalg.norm(tau, axis=0),
        error=float(np.linalg.norm(residual) / np.linalg.norm(tau)),
        condition_number=42.0,
        rows=residual.size,
        method="least squares",
        status="solved",
        notes=("sigma of Ixx.link2 is large: move the elbow faster",),
        sources=(source,),
    )


def residual_maps(robot, measured, before, after, moves, *, known: bool):
    found = []
    for j, name in enumerate(robot.names):
        old = np.concatenate([m[:, j] - p[:, j] for m, p in zip(measured, before, strict=True)])
        new = np.concatenate([m[:, j] - p[:, j] for m, p in zip(measured, after, strict=True)])
        t, q, v, a = (np.concatenate([x if x.ndim == 1 else x[:, j] for x in xs])
                      for xs in zip(*moves, strict=True))  # fmt: skip
        load = np.concatenate([p[:, j] for p in before])
        stribeck = "spikes beside zero velocity: Stribeck friction, or presliding (83 % of it)"
        for against, unit, x in (
            ("velocity", "rad/s", v),
            ("position", "rad", q),
            ("acceleration", "rad/s^2", a),
            ("load", "N m", load),
            ("time", "s", t),
        ):
            edges = np.linspace(x.min(), x.max() + 1e-9, 25)
            at = np.digitize(x, edges) - 1
            count = np.bincount(at, minlength=24)
            sums = [np.bincount(at, weights=w, minlength=24) for w in (x, old, new)]
            keep = count >= 10
            centre, mean_old, mean_new = (s[keep] / count[keep] for s in sums)
            band = 2 * NOISE / np.sqrt(count[keep]) if known else np.full(keep.sum(), np.nan)
            sentence = stribeck if against == "velocity" and j == robot.n - 1 else ""
            found.append(
                ResidualMap(
                    joint=name,
                    torque_unit="N m",
                    against=against,
                    unit=unit,
                    at=centre,
                    before=mean_old,
                    after=mean_new,
                    band=band,
                    sentence=sentence,
                )
            )
        k = np.arange(1.0, 61.0)
        waves = np.exp(-1j * np.outer(k, q))
        amplitude, remains = (2 * np.abs(waves @ (e - e.mean())) / len(q) for e in (old, new))
        band = np.full(60, 3.5 * NOISE / np.sqrt(len(q)) if known else np.nan)
        what = "cycles per revolution"
        found.append(
            ResidualMap(
                joint=name,
                torque_unit="N m",
                against=what,
                unit=what,
                at=k,
                before=amplitude,
                after=remains,
                band=band,
                sentence="",
            )
        )
    return tuple(found)


def diagnosis(
    joints: tuple[str, ...] = ("shoulder", "elbow"),
    *,
    noise: bool = True,
    steps: bool = True,
    samples: int = 800,
) -> Diagnosis:
    """Stribeck friction hidden at the last joint, found (or nothing found, without steps)."""
    robot, last = arm(*joints), joints[-1]
    stribeck = effect("stribeck_friction", last, shape=(0.16,))
    given = Model(robot) + "viscous_friction" + "coulomb_friction"
    final = given + stribeck
    truth = final.given_values()
    for i, name in enumerate(final.names):
        if name.startswith(("Fv", "Fc", "Fs")):
            truth[i] = {"Fv": 0.4, "Fc": 0.9, "Fs": 1.1}[name[:2]]
    rng = np.random.default_rng(0)
    moves = [motion(robot, run, samples) for run in range(1 + len(RECORDINGS))]
    blocks = [final.block(*move) for move in moves]
    tau = [final.torque(b, truth) + NOISE * rng.normal(size=(samples, robot.n)) for b in blocks]
    old, new = fitted(given, tau[0], blocks[0]), fitted(final, tau[0], blocks[0])
    new = new if steps else old
    measured = tau[1:]
    before = [given.torque(b, old.values) for b in blocks[1:]]
    after = [new.model.torque(b, new.values) for b in blocks[1:]]

    def norm(parts, j: int | slice = slice(None)):
        return float(np.linalg.norm(np.concatenate(parts)[:, j]))

    left = [m - p for m, p in zip(measured, before, strict=True)]
    left_after = [m - p for m, p in zip(measured, after, strict=True)]
    total = np.sqrt(samples * len(RECORDINGS))
    results = tuple(
        JointResult(
            name=name,
            torque_unit="N m",
            error_before=norm(left, j) / norm(measured, j),
            error_after=norm(left_after, j) / norm(measured, j),
            torque_rms=norm(measured, j) / total,
            noise_rms=NOISE if noise else None,
            ratio_before=float(np.sqrt(max((norm(left, j) / total / NOISE) ** 2 - 1, 0)))
            if noise
            else None,
            ratio_after=0.11 if noise else None,
        )
        for j, name in enumerate(joints)
    )
    floor = NOISE * total * np.sqrt(robot.n) / norm(measured) if noise else None
    error = TestError(
        before=norm(left) / norm(measured),
        after=norm(left_after) / norm(measured),
        noise_floor=floor,
    )
    rival = effect("asymmetric_friction", last)
    step = Step(
        effect=stribeck,
        values=tuple(new.effect_values(stribeck.label)) if steps else (),
        test_error_before=error.before,
        test_error_after=error.after,
        indistinguishable=(rival,),
        p_value=3e-41,
    )
    gain = error.before - error.after
    weak = "its gain does not hold on the held-out blocks"
    candidates = (
        Candidate(
            effect=stribeck,
            status="material" if steps else "not_material",
            p_value=3e-41,
            test_gain=gain,
            values=(1.1,),
        ),
        Candidate(
            effect=rival,
            status="material" if steps else "not_material",
            p_value=8e-39,
            test_gain=0.97 * gain,
        ),
        Candidate(
            effect=effect("quadratic_drag", last),
            status="not_material",
            p_value=0.004,
            test_gain=0.2 * gain,
            values=(0.02,),
            remark=weak,
        ),
        Candidate(
            effect=effect("torque_offset", joints[0]),
            status="not_material",
            p_value=0.6,
            test_gain=0.0002,
            values=(0.01,),
            remark=weak,
        ),
        Candidate(
            effect=effect("joint_spring", last),
            status="not_material",
            p_value=1.0,
            test_gain=-0.0004,
            values=(0.1, 0.0),
            remark=weak,
        ),
        Candidate(
            effect=effect("rotor_inertia", joints[0]),
            status="absorbed",
            p_value=None,
            test_gain=None,
            values=(),
            remark="Izz of the first link takes its place; "
            f"lock {joints[0]}'s gravity load to see it.",
        ),
    )
    rows = slice(0, 120)
    switches = Switches(
        effects=((stribeck,),),
        choices=tuple(
            SwitchedOn(
                on=(on,),
                error=error.after if on else error.before,
                joint_errors=np.array([j.error_after if on else j.error_before for j in results]),
                predicted=(after if on else before)[0][rows],
            )
            for on in (False, True)
        ),
        recording=RECORDINGS[0],
        t=moves[1][0][rows],
        measured=measured[0][rows],
    )
    return Diagnosis(
        switches=switches if steps else None,
        verdict="explained" if steps else "nothing_missing",
        noise_source="replicates" if noise else "unknown",
        joints=results,
        test_error=error,
        steps=(step,) if steps else (),
        candidates=candidates,
        remaining=tuple(replace(c, status="not_material", test_gain=0.0) for c in candidates[2:5]),
        before=old,
        after=new,
        maps=residual_maps(robot, measured, before, after, moves[1:], known=noise),
        traces=tuple(
            Trace(
                recording=run,
                joint=name,
                torque_unit="N m",
                t=move[0],
                measured=m[:, j],
                before=p[:, j],
                after=n[:, j],
            )
            for run, move, m, p, n in zip(
                RECORDINGS, moves[1:], measured, before, after, strict=True
            )
            for j, name in enumerate(joints)
        ),
        notes=("One recording warmed up for two minutes only.",),
    )
