"""One simulation of the recorded loop, and the same with the encoders' noise fed back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.closed_loop import (
    ClosedLoop,
    Controller,
    EncoderNoise,
    Mechanism,
    Retraced,
    retrace,
)
from dynident.closed_loop.loop import Progress
from dynident.recording import Recording
from dynident.robot import Robot


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulatedRun:
    """What a simulation was made of; see `retrace` for other attributes.

    Attributes
    ----------
    values : (p,) the estimate whose motion it is.
    """

    values: np.ndarray
    mechanisms: tuple[Mechanism, ...]
    recordings: tuple[Recording, ...]
    controller: Controller
    nominal: Robot
    feedback_scale: np.ndarray

    def retraced(self, loop: ClosedLoop, progress: Progress | None = None) -> tuple[Retraced, ...]:
        """Return the recordings run again with ideal sensors."""
        return self._run(loop, progress=progress)

    def disturbed(
        self, position_std: np.ndarray, pairs: int, seed: int
    ) -> list[tuple[Recording, ...]]:
        """Return draws of the recordings run again with encoder noise, each and its mirror image.

        The loop follows the noise: the robot truly trembles, and the torque with it.

        Parameters
        ----------
        position_std : (n,) rad or m.
        pairs : of draws.
        seed : of the noise.

        Raises
        ------
        SimulationError
            If the loop does not bear that noise.
        """
        loop, found = ClosedLoop(repeats=2 * pairs), []
        for draw in range(pairs):
            for sign in (1.0, -1.0):
                noise = EncoderNoise(std=position_std, seed=(seed, draw), sign=sign)
                runs = self._run(loop, noise=noise)
                found.append(tuple(one.recording for one in runs))
        return found

    def _run(
        self,
        loop: ClosedLoop,
        *,
        progress: Progress | None = None,
        noise: EncoderNoise | None = None,
    ) -> tuple[Retraced, ...]:
        return retrace(
            loop,
            self.mechanisms,
            self.recordings,
            self.controller,
            nominal=self.nominal,
            feedback_scale=self.feedback_scale,
            noise=noise,
            progress=progress,
        )
