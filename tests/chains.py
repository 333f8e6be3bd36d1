"""Chains of links with possible inertias, noisy estimates of them that are not, and recordings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from dynident.constraints import ParameterSpace, Within
from dynident.constraints.space import body_scale
from dynident.fitting import Estimate, LeastSquares, Prior, fit
from dynident.fitting.consistent.posterior import sized
from dynident.inertia import PARAMETERS, UNITS, distance_rows, from_pseudo_inertia, reference_body
from dynident.model import Model
from dynident.nlp import Problem
from dynident.recording import Dataset, Filter, Recording
from dynident.robot import Robot
from synthetic import smooth_motion

SOLVERS = ("conic", "nlp")

QUIET = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=50.0, edge_s=(0.02, 0.02))

COUNTEREXAMPLE = np.array([1.0, 0, 0, 0, 1, 0, 1, 0, 0, 3])
"""Virtual parameters [1, 0, 0, 0, 1, 0, 0, 1, 0, sqrt 3, 0]: mass 1 and I = diag(1, 1, 3)."""


def chain_text(n: int, seed: int = 0) -> str:
    """A chain of n revolute joints, neighbours at right angles; links are nearly flat plates."""
    rng = np.random.default_rng([n, seed])
    parts = ['<robot name="chain"><link name="base"/>']
    for k in range(n):
        masses, points = rng.uniform(0.2, 1.0, 6), rng.uniform(-0.05, 0.2, (6, 3))
        points[:, k % 3] *= 0.03
        com = masses @ points / masses.sum()
        r = points - com
        J = np.einsum("k,kij->ij", masses, (r**2).sum(1)[:, None, None] * np.eye(3))
        J -= np.einsum("k,ki,kj->ij", masses, r, r)
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="{com[0]} {com[1]} {com[2]}"/>'
            f'<mass value="{masses.sum()}"/><inertia ixx="{J[0, 0]}" ixy="{J[0, 1]}" '
            f'ixz="{J[0, 2]}" iyy="{J[1, 1]}" iyz="{J[1, 2]}" izz="{J[2, 2]}"/></inertial></link>'
            f'<joint name="j{k}" type="revolute">'
            f'<parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="0 0 {0.3 if k else 0.0}" rpy="{[1.5708, -1.5708][k % 2]} 0 0"/>'
            '<axis xyz="0 0 1"/>'
            '<limit lower="-2.5" upper="2.5" velocity="3" effort="100"/></joint>'
        )
    return "\n".join([*parts, "</robot>"])


def chain(n: int, seed: int = 0) -> Robot:
    return Robot.from_text(chain_text(n, seed))


@dataclass(frozen=True, eq=False)
class Case:
    """A problem, and the estimate without constraints and prior that it is about."""

    problem: Problem
    x_hat: np.ndarray


@lru_cache
def chain_model(n: int) -> Model:
    return Model(chain(n)) + "viscous_friction"


@lru_cache(maxsize=64)
def noisy_estimate(
    n: int, seed: int, noise: float, samples: int
) -> tuple[Model, np.ndarray, np.ndarray]:
    """A model whose description is 10 % off, rows in units of noise, and what they tell (s,).

    Torques of a chain with viscous friction, with noise of so much of their size.
    """
    rng = np.random.default_rng([7, seed])
    model = chain_model(n)
    space = ParameterSpace.of(model)
    x_true = space.given * np.repeat(np.append(1 + 0.1 * rng.normal(size=n), 0), [10] * n + [n])
    x_true[10 * n :] = rng.uniform(0.05, 0.3, n)
    q, v, a = model.robot.random_motion(seed, samples)
    columns = model.columns(model.block(0.01 * np.arange(samples), q, v, a))
    columns = columns.reshape(-1, model.size)
    torque = columns @ space.combination @ x_true
    std = noise * np.sqrt(np.mean(torque**2))
    noisy = torque + std * rng.normal(size=len(torque))
    R = np.asarray(np.linalg.qr(np.column_stack([columns, noisy]), mode="r"))
    A = R[:-1, :-1] @ space.combination / std
    x_hat = space.given + np.linalg.pinv(A, rcond=1e-9) @ (R[:-1, -1] / std - A @ space.given)
    return model, A, x_hat


def chain_case(
    n: int,
    seed: int,
    within: Within,
    distance: Literal["quadratic", "entropic"] = "quadratic",
    *,
    noise: float = 0.1,
    samples: int = 100,
    spread: float = 0.3,
) -> Case:
    """The projection of a noisy estimate under X'X and a prior."""
    model, A, x_hat = noisy_estimate(n, seed, noise, samples)
    space = sized(ParameterSpace.of(model), A, n * samples, x_hat)
    prior = Prior(model.robot, distance, spread)
    rows, at = prior.rows(space, np.append(space.given[: 10 * n], x_hat[10 * n :]))
    b = np.append(A @ x_hat, at)
    problem = Problem(space, np.vstack([A, rows]), b, within, entropy=prior.entropy(space))
    return Case(problem.reduced(), x_hat)


def one_body(phi, within: Within, rows: np.ndarray | None = None, length: float = 1.0) -> Problem:
    """The problem of one body near phi (10,), by default in the metric of a body of its size."""
    phi = np.asarray(phi, dtype=float)
    reference = reference_body(phi, 1.0, length)
    rows = distance_rows(reference) if rows is None else rows
    free = np.full(10, np.inf)
    space = ParameterSpace(
        names=tuple(f"{name}.body" for name in PARAMETERS),
        units=UNITS,
        bodies=("body",),
        references=reference[None],
        lower=-free,
        upper=free,
        combination=np.eye(10),
        given=phi,
        scale=body_scale(reference),
    )
    return Problem(space, rows, rows @ phi, within)


def spatial(phi: np.ndarray) -> np.ndarray:
    """[[I, S(h)], [S(h)', m E]] by hand, (6, 6)."""
    m, x, y, z = phi[:4]
    S = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    xx, xy, yy, xz, yz, zz = phi[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.block([[inertia, S], [S.T, m * np.eye(3)]])


def pseudo(phi: np.ndarray) -> np.ndarray:
    """[[tr(I)/2 E - I, h], [h', m]] by hand, (4, 4)."""
    inertia = spatial(phi)[:3, :3]
    P = np.empty((4, 4))
    P[:3, :3] = np.trace(inertia) / 2 * np.eye(3) - inertia
    P[3, :3] = P[:3, 3] = phi[1:4]
    P[3, 3] = phi[0]
    return P


def least(phi: np.ndarray, consistency: str) -> float:
    """Smallest eigenvalue of a body's matrix, its diagonal scaled to one: below 0 is outside."""
    M = pseudo(phi) if consistency == "full" else spatial(phi)
    size = np.sqrt(np.abs(np.diag(M)))
    size[size == 0] = 1.0
    return float(np.linalg.eigvalsh(M / np.outer(size, size))[0])


def recorded(robot: Robot, seed: int = 1, noise: float = 0.1, friction: float = 0.2) -> Recording:
    """Torques of a robot with viscous friction, noise relative to each joint's torque."""
    rng = np.random.default_rng([seed, 5])
    t, q, v, a = smooth_motion(robot.n, seed, 200.0, 4.0, 4.0)
    tau = robot.inverse_dynamics(q, v, a) + friction * v
    tau = tau + noise * np.std(tau, axis=0) * rng.normal(size=tau.shape)
    return Recording(t, q, tau, robot.names, period=4.0)


def estimated(robot: Robot, recording: Recording) -> Estimate:
    return fit(
        Model(robot) + "viscous_friction",
        Dataset((recording,), QUIET),
        LeastSquares(errors="independent"),
    )


def links(robot: Robot) -> dict[str, np.ndarray]:
    return {link.name: link.phi for link in robot.links if link.source != "absent"}


def clipped(phi: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """The nearest fully consistent body in closed form: negative eigenvalues become zero."""
    L = np.linalg.cholesky(pseudo(reference))
    inner = np.linalg.solve(L, np.linalg.solve(L, pseudo(phi)).T)
    values, vectors = np.linalg.eigh(inner)
    return from_pseudo_inertia(L @ (vectors * np.clip(values, 0, None)) @ vectors.T @ L.T)
