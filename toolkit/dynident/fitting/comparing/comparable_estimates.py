"""Whether two estimates can be compared: of one robot, in common quantities, and independent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.effects.soundness import sample_block
from dynident.errors import FitError
from dynident.fitting.comparing.unlike_effects import shared_effects
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.robot import Robot

_SAME = 1e-6
"""Of placements (m, and entries of rotations), axes, gravity (m/s^2) and relative widths."""


def require_comparable(before: Estimate, after: Estimate) -> None:
    """Refuse two estimates without quantities in common, or that are not independent.

    Parameters
    ----------
    before, after : estimates.

    Raises
    ------
    FitError
        If they are of other robots, an effect that both have is another one or reverses over
        another width, they rest on a recording in common, or have no covariance.
    """
    old, new = before.model, after.model
    if old.robot.names != new.robot.names or old.base.names != new.base.names:
        remedy = "compare two estimates from one description"
        raise FitError("the two estimates are of different robots", remedy=remedy)
    _require_same_tree(old.robot, new.robot)
    labels = shared_effects(old, new)
    _require_same_widths(old, new, labels)
    for label in labels:
        if _parameters(old, label) != _parameters(new, label):
            what = f"{label} has other parameters in the two estimates"
            raise FitError(what, remedy="fit both with one version of it")
    if not (np.any(before.covariance) and np.any(after.covariance)):
        raise FitError("an estimate has no covariance", remedy="take a method that has one")
    shared = {one.sha256 for one in before.sources} & {one.sha256 for one in after.sources} - {""}
    if shared:
        file = next(one.file for one in after.sources if one.sha256 in shared)
        what = f"both estimates rest on {file}: they are not independent"
        raise FitError(what, remedy="fit each to recordings of its own")


def _require_same_tree(old: Robot, new: Robot) -> None:
    """Parameters of other joint frames, or under other gravity, are other quantities."""
    remedy = "compare two estimates from one description"
    if not np.allclose(old.gravity, new.gravity, rtol=0, atol=_SAME):
        gravity = " and ".join(str(one.gravity.tolist()) for one in (old, new))
        raise FitError(f"the two estimates have other gravity: {gravity}", remedy=remedy)
    for one, other in zip(old.joints, new.joints, strict=True):
        if (one.kind, one.parent) != (other.kind, other.parent) or not all(
            np.allclose(getattr(one, part), getattr(other, part), rtol=0, atol=_SAME)
            for part in ("R", "p", "axis")
        ):
            what = f"the two estimates have joint {one.name} placed, or turned, otherwise"
            raise FitError(what, remedy=remedy)


def _parameters(model: Model, label: str) -> list[tuple[str, str]]:
    own = model.slices[label]
    return list(zip(model.names[own], model.units[own], strict=True))


def _require_same_widths(old: Model, new: Model, labels: tuple[str, ...]) -> None:
    """Dry friction that reverses over another speed has another value for the same robot."""
    both = replace(old, effects=tuple(one for one in old.effects if one.label in labels))
    for joint, name in enumerate(old.robot.names):
        widths = old.friction_widths[joint], new.friction_widths[joint]
        if np.isclose(*widths, rtol=_SAME, atol=0) or not _has_dry_friction(both, joint):
            continue
        what = f"friction_width at {name} is {widths[0]:.3g} in one estimate, {widths[1]:.3g} in "
        raise FitError(f"{what}the other", remedy="fit both with the same friction_width")


def _has_dry_friction(model: Model, joint: int) -> bool:
    """Whether the width of a joint's dry friction changes a column of any effect."""
    block = sample_block(model.robot)
    widths = np.array(model.friction_widths)
    slow = replace(block, v=block.v / np.max(np.abs(block.v), axis=0) * widths)
    wider = np.array(widths)
    wider[joint] *= 2.0
    blocks = [replace(slow, friction_width=one) for one in (widths, wider)]
    return any(
        not np.array_equal(*(one.columns(each) for each in blocks), equal_nan=True)
        for one in model.effects
    )
