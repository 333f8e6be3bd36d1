"""Many motions by compiled loops: which of them can be had, in as many threads as processors."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from dynident.batch import wish
from dynident.closed_loop.compiled.body_numbers import BodyNumbers, body_numbers
from dynident.closed_loop.compiled.loop_function import CompiledLoop, LoopInput, compiled_loop
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.motion_plan import Plan, Stacked
from dynident.closed_loop.plant.drive import ReferenceSamples
from dynident.closed_loop.rollout import Rollout
from dynident.closed_loop.stepped_motion import Hold, SteppedMotion, runaway

_TOGETHER = 64
"""Motions whose references and noise are in memory at a time."""


class CompiledLoops:
    """The compiled loops that a simulator has used.

    Parameters
    ----------
    repeats : see `dynident.closed_loop.ClosedLoop`.

    Attributes
    ----------
    notes : why motions could not be made.
    """

    def __init__(self, repeats: int) -> None:
        self.notes: dict[str, None] = {}
        self._used: set[CompiledLoop] = set()
        self._repeats = repeats

    @property
    def builds(self) -> int:
        """How many loops of different structures."""
        return len(self._used)

    def rollouts(
        self, plans: Sequence[Plan], advance: Callable[[float], None]
    ) -> dict[Plan, Rollout]:
        """Return the rollouts of those motions that compiled loops could make.

        Parameters
        ----------
        plans : of one run.
        advance : called now and then with the share of the plans that are done.

        Raises
        ------
        SimulationError
            If a reference is not finite, or too large.
        """
        able = self._able(plans)
        wanted = [one for one in plans if one in able]
        found: dict[Plan, Rollout] = {}
        known: dict[tuple[int, int], ReferenceSamples] = {}
        bodies: dict[tuple[int, float], BodyNumbers] = {}
        for first in range(0, len(wanted), _TOGETHER):
            some = wanted[first : first + _TOGETHER]
            inputs = [loop_input(one, known, bodies) for one in some]
            functions = [able[one] for one in some]
            for plan, given, motion in zip(some, inputs, _made(functions, inputs), strict=True):
                if isinstance(motion, str):
                    self.notes |= {f"Drake simulates {_named(plan)}: {motion}.": None}
                else:
                    found[plan] = plan.rollout(motion, given.reference)
            advance(len(found) / len(plans))
        return found

    def _able(self, plans: Sequence[Plan]) -> dict[Plan, tuple[CompiledLoop, Any]]:
        """Return the loop of each motion that has one, and its function."""
        loops: dict[Plan, CompiledLoop] = {}
        by_id: dict[tuple[int, int], CompiledLoop | str] = {}
        for one in plans:
            # Of what the tasks hold: its identity lasts.
            key = id(one.task.mechanism), id(one.nominal)
            if key not in by_id:
                by_id[key] = _loop_of(one)
            loop = by_id[key]
            if not isinstance(loop, str):
                loops[one] = loop
            elif wish() != "never":
                self.notes |= {f"Drake simulates {_named(one)}: {loop}.": None}
        functions = {}
        for loop in dict.fromkeys(loops.values()):
            samples = sum(one.samples for one, own in loops.items() if own is loop)
            # Not what was done before: the same call makes the same motions again.
            functions[loop] = loop.function(self._repeats * samples)
            if functions[loop] is not None:
                self._used.add(loop)
            elif loop.choice.failed:
                note = f"Drake simulates, which takes longer: {loop.choice.failed}."
                self.notes |= {note: None}
        return {
            plan: (loop, functions[loop])
            for plan, loop in loops.items()
            if functions[loop] is not None
        }


def _named(plan: Plan) -> str:
    return f"'{plan.task.name}'" if plan.task.name else "a motion"


def _loop_of(plan: Plan) -> CompiledLoop | str:
    """The loop of a motion, or why there is none."""
    nominal = _nominal(plan)
    if plan.run.controller.law.through_model and nominal.memory:
        return "the model inside the controller remembers"
    return compiled_loop(plan.task.mechanism, nominal)


def _nominal(plan: Plan) -> Mechanism:
    """The mechanism inside the controller; the plan's own where none is asked at each sample."""
    if not plan.run.controller.law.through_model:
        return plan.task.mechanism
    given = plan.nominal
    return given if isinstance(given, Mechanism) else Mechanism(given)


def loop_input(
    plan: Plan,
    known: dict[tuple[int, int], ReferenceSamples],
    bodies: dict[tuple[int, float], BodyNumbers],
) -> LoopInput:
    """Return what a loop makes a motion of.

    Parameters
    ----------
    plan : the motion.
    known, bodies : references and numbers of bodies that were made before, by what they are of;
        they are added to.
    """
    task, run = plan.task, plan.run
    key = id(task.trajectory), plan.samples
    if key not in known:
        known[key] = plan.reference(plan.samples)
    stacked = Stacked.along([plan], [known[key]])

    def numbers(owner: object, mechanism: Mechanism, start: float) -> BodyNumbers:
        own = id(owner), start
        if own not in bodies:
            bodies[own] = body_numbers(mechanism, start)
        return bodies[own]

    truth, through_model = task.mechanism, run.controller.law.through_model
    acting = numbers(truth, truth, task.start)
    return LoopInput(
        truth=acting,
        nominal=numbers(plan.nominal, _nominal(plan), 0.0) if through_model else acting,
        through_model=through_model,
        drive=stacked.drive.numbers,
        reference=known[key],
        measurement=stacked.measurement,
        time=float(run.time(plan.kept)[0]),
        rate=run.rate,
        hold=Hold.of(run.controller.delay_s, run.rate),
        beyond=runaway(known[key].q, known[key].v),
        accuracy=run.accuracy,
    )


def _made(
    loops: Sequence[tuple[CompiledLoop, Any]], inputs: Sequence[LoopInput]
) -> list[SteppedMotion | str]:
    """Return the motions, or why they could not be made."""

    def make(number: int) -> SteppedMotion | str:
        loop, function = loops[number]
        return loop.run(function, inputs[number])

    if len(inputs) == 1:
        return [make(0)]
    # The functions run without Python's lock.
    with ThreadPoolExecutor(min(len(inputs), _processors())) as pool:
        return list(pool.map(make, range(len(inputs))))


def _processors() -> int:
    """How many this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
