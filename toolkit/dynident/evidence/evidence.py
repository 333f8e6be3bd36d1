"""Recordings as the diagnosis sees them: columns of the model and of every candidate.

Low-passed and decimated like the torque, for every replicate of every run.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import Literal

import numpy as np

from dynident.criteria import DEFAULTS, Criteria
from dynident.effects import Effect
from dynident.evidence.columns.column_cache import ColumnCache, FirstLook
from dynident.evidence.columns.fitted_columns import FittedColumns, recorded
from dynident.evidence.columns.joint_columns import RigidColumns
from dynident.evidence.columns.motion_columns import MotionColumns
from dynident.evidence.noise_model import SpeedClasses
from dynident.evidence.runs import Run, Signals
from dynident.evidence.stacks import Stack
from dynident.fitting.sampling import Sampled
from dynident.model import Model
from dynident.recording.dataset import NoiseSource


@dataclass(frozen=True, eq=False)
class Evidence:
    """Recordings, and the columns that a model and its candidates have along them.

    Payload columns are those of a recording that carries it; who does is for others to apply.

    Attributes
    ----------
    model : whose base parameters are fitted; its effects are kept.
    runs : the recordings in their replicates.
    criteria : thresholds of whoever judges it.
    candidates : further effects whose columns are kept. Those that follow from a sample alone are
        evaluated with the model's in one pass through a motion. Of all other effects, which are
        tried once, only those of the model that asks are kept.
    responses : along whose motion, where columns are taken along simulated ones, the responses
        behind springs and gaps are taken. Along the measured one they fit best, and carry its
        noise; along a simulated one that does not ring yet they have another phase, and no noise.
    cache : of columns, shared with the evidence that this one was made of.
    look : the current first look, see `first_look`.
    """

    model: Model
    runs: tuple[Run, ...]
    _: KW_ONLY
    criteria: Criteria = DEFAULTS
    candidates: tuple[Effect, ...] = ()
    responses: Literal["recording", "simulation"] = "recording"
    cache: ColumnCache = field(default_factory=ColumnCache, repr=False)
    look: FirstLook = field(default_factory=FirstLook, repr=False)

    def with_runs(self, runs: tuple[Run, ...]) -> Evidence:
        """Return the evidence of other runs: what is known of their motions is still known."""
        return replace(self, runs=runs)

    def without_noise_in(self, effect: Effect) -> Evidence:
        """Return the evidence in which an effect's columns have no noise of measured positions.

        The very same where that noise does not enter, or no motion is simulated.
        """
        if not (effect.is_dynamic_response and self.is_simulated and self.responses == "recording"):
            return self
        return replace(self, responses="simulation")

    def looked_at_anew(self) -> Evidence:
        """Return the evidence without a first look: the model has become another one."""
        return replace(self, look=FirstLook())

    @cached_property
    def stacks(self) -> tuple[Stack, ...]:
        """The recordings, those that are cut alike together."""
        return Stack.of(self.runs)

    @cached_property
    def is_simulated(self) -> bool:
        """Whether columns are taken along simulated motions throughout."""
        return all(run.columns_from == "simulation" for run in self.runs)

    @cached_property
    def torque_peaks(self) -> np.ndarray:
        """Largest torque that was measured at each joint, (n,) N m or N."""
        every = (one.tau for run in self.runs for one in run.replicates)
        return np.max([np.abs(tau).max(axis=0) for tau in every], axis=0)

    @cached_property
    def longest_step(self) -> float:
        """The longest time between two samples of any recording, s."""
        return max(1.0 / run.recording.rate_hz for run in self.runs)

    def speed_classes(self, joint: int) -> SpeedClasses:
        """Classes of a joint's speed wherever replicates tell its noise."""
        if joint not in self._speed_classes:
            speed = [one for run in self.runs for one in run.noisy_speeds(joint)]
            self._speed_classes[joint] = SpeedClasses.of(speed, self.criteria.noise)
        return self._speed_classes[joint]

    @cached_property
    def _speed_classes(self) -> dict[int, SpeedClasses]:
        return {}

    # --- of one recording -----------------------------------------------------------------------

    def torque(self, sampled: Sampled, joint: int) -> np.ndarray:
        """Measured torque at a joint (T, 1); one and the same array whenever it is asked for."""
        known, key = self.cache.rows_of(sampled), ("torque", joint)
        if key not in known:
            known[key] = sampled.tau[:, [joint]]
        return known[key]

    def loading(self, sampled: Sampled, joint: int) -> np.ndarray:
        """Which of the base parameters load a joint, (u,)."""
        known, key = self.cache.rows_of(sampled), (self.model.robot, "loading", joint)
        if key not in known:
            known[key] = self.motion.rigid(sampled).places[joint]
        return known[key]

    # --- of runs --------------------------------------------------------------------------------

    def rigid(self, run: int) -> list[RigidColumns]:
        """Columns of the base parameters for each replicate."""
        return [self.motion.rigid(sampled) for sampled in self.runs[run].replicates]

    def of(self, effect: Effect, run: int, model: Model, values: np.ndarray | None) -> Signals:
        """Columns of an effect at the joints where it acts in one run.

        Parameters
        ----------
        effect : of the model, or a candidate for it.
        run : which one.
        model, values : (p,) whose torque and bodies some columns depend on; None for zeros.

        Returns
        -------
        (T, J, k) for each replicate. Of a candidate where the columns are taken along a simulated
        motion: of that motion only. What rings behind a spring or a gap is in its place along the
        motion that `responses` says.
        """
        values = np.zeros(model.size) if values is None else values
        along = self._along(effect, run, model)
        return [self._fitted.of(effect, one, model, values) for one in along]

    def columns(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> list[list[Signals]]:
        """Columns of one effect with several shapes: for each run those of each variant, as `of`.

        Parameters
        ----------
        variants : one effect at one place, with any number of shapes.
        model, values : as for `of`.

        Returns
        -------
        For each run, for each variant: (T, J, k) for each replicate.
        """
        runs = range(len(self.runs))
        first = variants[0]
        if len(variants) > 1 and first.is_dynamic_response and first not in model:
            found = self._together(variants, model, values)
            return [[found[variant, run] for variant in variants] for run in runs]
        along = [self._along(first, run, model) for run in runs]
        every = [one for some in along for one in some]
        if first.depends_on_fit:
            of, shapes = self._fitted.of, variants
            evaluated = [[of(one, each, model, values) for one in shapes] for each in every]
        else:
            evaluated = self.motion.of(variants, every, model)
        of_replicates = iter(evaluated)
        return [
            [list(signals) for signals in zip(*islice(of_replicates, len(some)), strict=True)]
            for some in along
        ]

    def first_look(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> list[list[Signals]]:
        """As `columns`, but as the model had them that asked first; for a first look only.

        Columns that depend on the predicted torque or on the bodies cost an inverse dynamics of
        the whole recording, and change little as effects are added.

        Parameters
        ----------
        variants, model, values : as for `columns`.

        Returns
        -------
        As `columns`.
        """
        if variants[0].linear_in_torque or not variants[0].depends_on_fit:
            return self.columns(variants, model, values)
        seen, latest = self.cache.seen_in(self.look), self._fitted.kept_at(model, values)
        runs = range(len(self.runs))

        def key(variant: Effect, run: int) -> Hashable:
            along = self._along(variant, run, model)
            return variant, tuple((one.motion, one.kept.start, one.kept.stop) for one in along)

        new = [v for v in dict.fromkeys(variants) if any(key(v, r) not in seen for r in runs)]
        if new and len(variants) > 1 and new[0].is_dynamic_response:
            found = self._together(new, model, values)
        else:
            found = {(v, r): self.of(v, r, model, values) for v in new for r in runs}
        for (variant, run), signals in found.items():
            seen.setdefault(key(variant, run), signals)
            # To be looked at closely next, with the same model.
            for one, columns in zip(self._along(variant, run, model), signals, strict=True):
                latest[variant, recorded(one)] = columns
        return [[seen[key(variant, run)] for variant in variants] for run in runs]

    def _together(
        self, variants: Sequence[Effect], model: Model, values: np.ndarray
    ) -> dict[tuple[Effect, int], Signals]:
        """Responses of one effect with several shapes, by shape and run."""
        new, runs = list(dict.fromkeys(variants)), range(len(self.runs))
        along = [(run, one) for run in runs for one in self._along(new[0], run, model)]
        every = self._fitted.together(new, [one for _, one in along], model, values)
        found: dict[tuple[Effect, int], Signals] = {(v, run): [] for v in new for run in runs}
        for (run, _), columns in zip(along, every, strict=True):
            for variant, one in zip(new, columns, strict=True):
                found[variant, run].append(one)
        return found

    def _along(self, effect: Effect, run: int, model: Model) -> tuple[Sampled, ...]:
        """Replicates along which an effect's columns are taken."""
        every = self.runs[run].replicates
        if effect.is_dynamic_response and self.is_simulated and self.responses == "recording":
            # What rings has the phase of the true motion, which a loop without it does not have.
            every = (*every[:-1], every[0])
        # Of a simulated motion, candidates need no more than that one.
        return every[-1:] if self.is_simulated and effect not in model else every

    @cached_property
    def motion(self) -> MotionColumns:
        """Columns that follow from the motions alone."""
        last = frozenset(run.replicates[-1] for run in self.runs)
        return MotionColumns(
            model=self.model,
            candidates=self.candidates,
            every=tuple(one for run in self.runs for one in run.replicates),
            asked_along=last if self.is_simulated else None,
            cache=self.cache,
        )

    @cached_property
    def _fitted(self) -> FittedColumns:
        return FittedColumns(self.motion)


def noise_source(evidence: Evidence, held: Evidence | None) -> NoiseSource:
    """Return where the noise floor that is reported comes from.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings; `held` may be None.
    """
    kinds = {run.kind for run in (*evidence.runs, *(held.runs if held else ()))}
    if "repeated" in kinds:
        return "replicates"
    return "given" if "noise_augmented" in kinds else "unknown"
