"""One simulation on a fresh `ClosedLoop`."""

from __future__ import annotations

from collections.abc import Sequence

from dynident.closed_loop.controllers import Controller
from dynident.closed_loop.loop import ACCURACY, ClosedLoop, Progress
from dynident.closed_loop.rollout import LEAD_IN, Rollout, Task
from dynident.closed_loop.sensors import Sensors


def simulate(
    tasks: Sequence[Task],
    controller: Controller,
    sensors: Sensors | None = None,
    *,
    lead_in: float = LEAD_IN,
    accuracy: float = ACCURACY,
    progress: Progress | None = None,
) -> tuple[Rollout, ...]:
    """Simulate loops that follow their references, side by side; see `ClosedLoop.simulate`."""
    loop = ClosedLoop(accuracy=accuracy)
    return loop.simulate(tasks, controller, sensors, lead_in=lead_in, progress=progress)
