"""What the next recording is for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.effects import Effect
from dynident.errors import DesignError
from dynident.experiment_design.information import Objective
from dynident.tables import listed


@dataclass(frozen=True, kw_only=True)
class DesignTask:
    """What the next recording is for.

    Attributes
    ----------
    duration : s, of one repetition.
    repeat : how many repetitions: two or more measure the noise.
    harmonics : of the series of each joint.
    intervals : of B-splines, in the place of series; None for series.
    objective : "D", the volume of the confidence region, or "A", the sum of the variances.
    tell : groups of effects, of each of which the recording is to tell which one it is; the first
        of a group is taken for true. Of several groups, the one that is told least counts, and the
        others a little.
    show : effects that the recordings so far could not show.
    joints : whose parameters are meant: the base parameters that are named by their links, and the
        effects at them, all others estimated too; none for all parameters.
    starts, seed : of the search.
    clearance : m, that the robot's links keep from each other; None where that is not looked at.
    loads : kg, masses of what the last link may carry, of which the one is chosen with which the
        recording tells most; none for nothing. What is carried is weighed by the recording, too.
    """

    duration: float = 10.0
    repeat: int = 3
    harmonics: int = 8
    intervals: int | None = None
    objective: Objective = "D"
    tell: tuple[tuple[Effect, ...], ...] = ()
    show: tuple[Effect, ...] = ()
    joints: tuple[str, ...] = ()
    starts: int = 3
    seed: int = 0
    clearance: float | None = None
    loads: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for group in (*self.tell, self.show):
            if not isinstance(group, tuple | list):
                remedy = "give tuples of effects, each of di.effects_of(label, robot)"
                raise DesignError(f"{group!r} where several effects are needed", remedy=remedy)
            if named := [one for one in group if not isinstance(one, Effect)]:
                remedy = "take it of di.effects_of(label, robot)"
                raise DesignError(f"{named[0]!r} where an effect is needed", remedy=remedy)
        for group in self.tell:
            if len(group) < 2:
                raise DesignError("one effect to tell apart", remedy="name two, or use show")
            _require_different(group, "to be told from itself")
        _require_different(self.show, "to be shown twice")
        if self.tell and self.show:
            raise DesignError("tell and show together", remedy="design a recording for each")
        twice = next((one for one in self.joints if self.joints.count(one) > 1), None)
        if twice is not None:
            raise DesignError(f"joint {twice} is named twice", remedy="name different joints")
        if self.joints and (self.tell or self.show):
            what = "joints whose parameters are meant, and effects to tell or to show"
            raise DesignError(what, remedy="design a recording for each")
        if bad := [one for one in self.loads if not 0 <= one < np.inf]:
            raise DesignError(f"a load of {bad[0]:g} kg", remedy="state masses of 0 kg or more")
        if any(one.is_payload for group in self.tell for one in group):
            raise DesignError("a payload to tell apart", remedy="show it, with the load's mass")
        if any(one.is_payload for one in self.show) and (len(self.loads) != 1 or not self.load):
            raise DesignError("a payload to show", remedy="state its mass, in kg, and no other")
        if self.repeat < 1 or self.starts < 1:
            what = f"repeat = {self.repeat}, starts = {self.starts}"
            raise DesignError(what, remedy="choose 1 or more of each")

    @property
    def load(self) -> float:
        """Mass of what is carried, kg: the first of `loads`."""
        return self.loads[0] if self.loads else 0.0

    @property
    def of_what(self) -> str:
        """Whose parameters are told, in words; empty for all."""
        return listed([*(one.title for one in self.show), *self.joints])


def _require_different(effects: tuple[Effect, ...], what: str) -> None:
    labels = [one.label for one in effects]
    twice = next((one for one in labels if labels.count(one) > 1), None)
    if twice is not None:
        raise DesignError(f"{twice} is {what}", remedy="name different effects")
