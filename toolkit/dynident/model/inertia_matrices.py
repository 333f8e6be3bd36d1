"""The joint-space inertia of a robot as a function of the model's parameters."""

from __future__ import annotations

import numpy as np

from dynident.errors import SimulationError
from dynident.model.torque_model import Model


class InertiaMatrices:
    """The joint-space inertia at some poses, as a function of the model's parameters.

    It is linear in them, so base parameters suffice, possible or not: no body is ever made.

    Parameters
    ----------
    model : Model
    poses : (P, n) rad or m.
    """

    def __init__(self, model: Model, poses: np.ndarray) -> None:
        count, n = poses.shape
        t, still = np.zeros(count), np.zeros((count, n))
        # Poses are no recording: effects that need a whole one change no inertia here.
        whole = {
            e.label: np.zeros((count, n, len(e.parameters(model.robot))))
            for e in model.effects
            if e.needs_recording
        }
        rest = model.columns(model.block(t, poses, still, still), known=whole)
        self._columns = np.empty((count, n, n, model.size))
        for j in range(n):
            a = still.copy()
            a[:, j] = 1.0
            block = model.block(t, poses, still, a)
            self._columns[:, :, j] = model.columns(block, known=whole) - rest
        self._poses, self._names = poses, model.robot.names

    def of(self, values: np.ndarray) -> np.ndarray:
        """Joint-space inertia at each pose, (P, n, n)."""
        return self._columns @ values

    def joint_inertias(self, values: np.ndarray) -> np.ndarray:
        """J_j, the largest M_jj over the poses, (n,) kg m^2 or kg (Janot et al., equation 38)."""
        return np.einsum("pjj->pj", self.of(values)).max(axis=0)

    def require_positive(self, values: np.ndarray) -> None:
        """Refuse values with which the inertia is not positive definite at some pose.

        Raises
        ------
        SimulationError
            Naming the pose.
        """
        M = self.of(values)
        if not np.all(np.isfinite(M)):
            raise SimulationError("the joint-space inertia is not finite")
        least = np.linalg.eigvalsh((M + M.transpose(0, 2, 1)) / 2)[:, 0]
        worst = int(np.argmin(least))
        if not least[worst] > 0:
            at = zip(self._names, self._poses[worst], strict=True)
            raise SimulationError(
                f"the joint-space inertia is not positive (least eigenvalue {least[worst]:.3g})",
                "at " + ", ".join(f"{joint} = {x:.3g}" for joint, x in at),
            )
