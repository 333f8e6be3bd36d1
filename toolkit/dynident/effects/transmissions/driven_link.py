"""A link behind a transmission that gives way, along the motion of its motor.

What the recursion in `link_response` runs through: inertia, load and their derivatives by the
link's motion, at the samples of a recording and in steps that follow the fastest oscillation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.effects.block import Block
from dynident.effects.transmissions.along import along_motion, mean_inertia
from dynident.effects.transmissions.dead_zone import Transmitting
from dynident.effects.transmissions.finer import finer
from dynident.errors import EffectError

_PHASE = 0.3
"""rad that an oscillation may turn in a step: its frequency is then wrong by 0.4 %."""
_SHORTEST = 4e-5
"""s: the stiffest transmission on the lightest link that is possible asks for longer steps."""
_RUNG_DOWN = np.log(100.0)
"""Decades of a start that a run-up takes away, as a logarithm."""
_KEPT = 400_000
"""Steps of a motion, of all lengths that are kept of it: 16 MB."""
_LEAST = 0.05
"""Of the mean inertia: no link is lighter, or unlikely estimates would ring beyond reason."""


def driven_link(block: Block, joint: int) -> DrivenLink:
    """Return the link of a joint along a motion; the latest one of each motion is kept.

    Whoever seeks shapes of one joint asks for the same link again and again.

    Parameters
    ----------
    block, joint : as for `DrivenLink`.
    """
    _, along = along_motion(block)
    rotor = 0.0 if block.rotor is None else float(block.rotor[joint])
    asked = (joint, rotor, block.period, block.empty)
    if along.latest is None or along.latest[0] != asked:
        along.latest = asked, DrivenLink(block, joint)
    return along.latest[1]


class DrivenLink:
    """The link of one joint, along the motion of a recording.

    Parameters
    ----------
    block : whole recording, with the fitted model's body and rotor inertias.
    joint : column of the joint.

    Attributes
    ----------
    inertia : kg m^2 or kg, of all that moves with the joint, in the mean over its poses.
    a, whole, load : (T,) acceleration of the motor, and inertia and torque of all that moves.
    step, period : s between samples; samples after which the motion repeats, 0 where it does not
        within the recording.
    M, C, G : (T, n) derivatives of torques by the joint's acceleration, speed and position.
    latest : its response that was asked for last, as `FlexibleJoint` keeps it: a shape's
        derivatives are those of the same response.
    """

    def __init__(self, block: Block, joint: int) -> None:
        robot, along = along_motion(block)
        rotor = 0.0 if block.rotor is None else float(block.rotor[joint])
        self.joint, self.a = joint, block.a[:, joint]
        by = along.by(joint)
        # Samples side by side: they are multiplied by signals, again and again.
        self.M, self.C, self.G = map(np.asfortranarray, (by.by_a, by.by_v, by.by_q))
        self.whole = self.M[:, joint] + rotor
        self.load = along.torque[:, joint] + rotor * self.a
        # What is stiff stays as stiff when a payload is taken up.
        self.inertia = max(mean_inertia(block.empty or robot, joint) + rotor, 1e-9)
        if len(block.t) < 3:
            raise EffectError("its response needs more than two samples")
        self._least_whole = float(self.whole.min())
        self._most_stiffness = float(self.G[:, joint].max())
        self.step = float(np.mean(np.diff(block.t)))
        # A record that is shorter than its period does not hold what came before it.
        whole = 0 if block.period is None else round(block.period / self.step)
        self.period = whole if whole <= len(block.t) else 0
        self._fine: dict[int, Fine] = {}
        self.latest: Any | None = None

    def fine(self, gear: Transmitting) -> Fine:
        """Return the link's motion in steps that follow the oscillation behind a transmission."""
        if not self.follows(gear):
            return self._in_steps(1).begun(0)
        return self._in_steps(self.steps_per_sample(gear)).begun(self._run_up(gear))

    def steps_per_sample(self, gear: Transmitting) -> int:
        """Return how many steps of the recursion follow an oscillation well enough.

        A power of two or three halves of one: many shapes share their steps.
        """
        return _rounded_up(self._least_steps(gear))

    def _in_steps(self, per: int) -> Fine:
        """The motion in so many steps a sample; the latest of them stay."""
        fine = self._fine.pop(per, None)
        self._fine[per] = Fine.of(self, per) if fine is None else fine
        while len(self._fine) > 1 and sum(len(one.a) for one in self._fine.values()) > _KEPT:
            del self._fine[next(iter(self._fine))]
        return self._fine[per]

    def behind(self, gear: Transmitting) -> np.ndarray:
        """Return the inertia behind a transmission, (T,): no less than a part of the mean."""
        return np.maximum(self.whole - gear.rotor, self.least_inertia)

    @property
    def least_inertia(self) -> float:
        """The least inertia behind a transmission: a part of the mean, kg m^2 or kg."""
        return _LEAST * self.inertia

    def follows(self, gear: Transmitting) -> bool:
        """Return whether steps of a sensible length follow it: not where an inertia is impossible.

        A wrong estimate may leave next to no inertia at a joint, or less than none.
        """
        return self.step / self._least_steps(gear) >= min(_SHORTEST, self.step)

    def _least_steps(self, gear: Transmitting) -> int:
        stiffest = max(gear.stiffness + self._most_stiffness, 0.0)
        fastest = np.sqrt(stiffest / max(self._least_whole - gear.rotor, self.least_inertia))
        return max(1, int(np.ceil(fastest * self.step / _PHASE)))

    def _run_up(self, gear: Transmitting) -> int:
        """Return how many samples are run through before the first, where the motion repeats.

        As many as the ringing takes that a start at rest gives rise to, up to two periods.
        """
        decay = gear.damping / (2.0 * (self.inertia - gear.rotor))  # per s
        if not (self.period and decay > 0):
            return 0
        return min(int(np.ceil(_RUNG_DOWN / (decay * self.step))), 2 * self.period)


def _rounded_up(steps: int) -> int:
    """Return the least power of two, or three halves of one, that is as large."""
    power = 1 << (steps - 1).bit_length()
    return 3 * power // 4 if power > 2 and 3 * power // 4 >= steps else power


@dataclass(frozen=True, eq=False, kw_only=True)
class Fine:
    """A link's motion in the steps of a recursion, (S,) each, a run-up before it.

    Attributes
    ----------
    first : samples of the run-up.
    per, step : steps per sample, and their length in s.
    whole, c, g, load, a : inertia of all that moves, damping and stiffness without a transmission,
        torque where nothing gives way, and acceleration of the motor.
    """

    first: int
    per: int
    step: float
    whole: np.ndarray
    c: np.ndarray
    g: np.ndarray
    load: np.ndarray
    a: np.ndarray

    @classmethod
    def of(cls, link: DrivenLink, per: int) -> Fine:
        """Return a link's motion in so many steps a sample, after the longest of run-ups."""
        before = np.arange(-2 * link.period, 0) % max(link.period, 1)
        rows, j = np.concatenate([before, np.arange(len(link.a))]), link.joint
        samples = np.stack([link.C[:, j], link.G[:, j], link.load, link.a], axis=1)[rows]
        # Without kinks, which a second derivative would show; but an inertia stays positive.
        c, g, load, a = finer(samples, per)
        whole = link.whole[rows]
        if per > 1:
            whole = np.interp(
                np.arange((len(rows) - 1) * per + 1) / per, np.arange(len(rows)), whole
            )
        return cls(
            first=len(before),
            per=per,
            step=link.step / per,
            whole=whole,
            c=c,
            g=g,
            load=load,
            a=a,
        )

    def begun(self, before: int) -> Fine:
        """Return the same after a shorter run-up, of so many samples."""
        dropped = (self.first - before) * self.per
        late = {one: getattr(self, one)[dropped:] for one in ("whole", "c", "g", "load", "a")}
        return replace(self, first=before, **late)
