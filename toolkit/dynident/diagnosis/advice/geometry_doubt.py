"""When a lack of fit may be one of geometry: of what the catalogue of torques cannot mend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.diagnosis.advice.coupled_pairs import stated_pairs
from dynident.diagnosis.result import Diagnosis
from dynident.evidence.runs import Run
from dynident.wiring.speed_limits import over_speed

_OTHER_JOINTS = {"other joints", "speeds of other joints"}


def with_geometry_doubt(found: Diagnosis, runs: Sequence[Run]) -> Diagnosis:
    """Return a diagnosis that says where positions or the description may be wrong.

    The evidence is a joint that is faster than it can be, while the others keep their limits; or
    that the torque at a joint goes with the motion of another one, beyond what the bodies as
    described make of it, while a residual remains: a coupling that was added, or what a flexible
    regression explains by the other joints.

    Parameters
    ----------
    found : the diagnosis without it.
    runs : the training recordings that it rests on.

    Returns
    -------
    With one note more where there is such evidence.
    """
    if found.wiring:
        return found
    speeds = [run.replicates[0].motion.v for run in runs]
    fast = over_speed(found.before.model.robot, np.concatenate(speeds)) if speeds else None
    if fast is not None:
        return replace(found, too_fast=fast)
    complete = found.verdict != "unexplained" and found.noise_source != "unknown"
    pairs = [] if complete else _pairs(found, stated_pairs(run.recording for run in runs))
    if not pairs:
        return found
    note = (
        "Torque that goes with the motion of another joint, beyond what the bodies as described "
        f"make ({', '.join(pairs)}), may come from geometry: positions may be those of motors that "
        "turn two joints (docs/howto/coupled_motors.md), or axes and lengths of the description "
        "may differ from the robot's."
    )
    return replace(found, notes=(*found.notes, note))


def _pairs(found: Diagnosis, stated: set[frozenset[str]]) -> list[str]:
    """Which torque goes with the motion of which joint, where the study does not say why."""
    pairs = [
        f"{step.effect.joint} goes with {step.effect.source}"
        for step in found.steps
        if step.effect.source is not None
        and frozenset((step.effect.joint, step.effect.source)) not in stated
    ]
    # Where a study states that motors turn two joints, what is left there says nothing new of it.
    known = {
        name
        for effect in found.before.model.effects
        if effect.source is not None
        for name in (effect.joint, effect.source)
    }.union(*stated)
    pairs += [
        f"{one.joint} goes with the other joints"
        for one in found.residual_dependence
        if not _OTHER_JOINTS.isdisjoint(one.told) and one.joint not in known
    ]
    return pairs
