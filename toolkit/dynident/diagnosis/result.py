"""The answer of `diagnose`, as JSON and as tables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from dynident.diagnosis.answer import Answer
from dynident.diagnosis.dependence.residual_dependence import dependence_sentences, dependence_table
from dynident.diagnosis.details import Step, gain_notes, place, step_notes
from dynident.diagnosis.detection_limits import limit_table
from dynident.diagnosis.effect_groups import hidden_effects
from dynident.fitting.drive_gains import anew_tables
from dynident.tables import Shown, Table, finite, mostly_noise, number, p_value, percent, points
from dynident.wiring import Fault


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis(Answer, Shown):
    """The answer of `diagnose`: see `Answer` for what it holds."""

    def answered_by(self, faults: tuple[Fault, ...]) -> Diagnosis:
        """Return the diagnosis with its verdict withheld where columns or data are not as said.

        Parameters
        ----------
        faults : of the wiring, from `check_wiring`: nothing was added.
        """
        return replace(
            self,
            wiring=faults,
            verdict="unexplained",
            impossible=(),
            steps=(),
            candidates=(),
            remaining=(),
            notes=(),  # of residuals that the fault has made
            following_motion=(),
            training_only=(),
            bursts=(),
            drifting=(),
        )

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `diagnose --json` and `explain --json`."""
        return {
            "verdict": self.verdict,
            "noise": {"source": self.noise_source},
            **({} if self.limit is None else {"limit": self.limit}),
            **({"training_only": list(self.training_only)} if self.training_only else {}),
            **({"following_motion": list(self.following_motion)} if self.following_motion else {}),
            **({"bursts": list(self.bursts)} if self.bursts else {}),
            **({"drifting": list(self.drifting)} if self.drifting else {}),
            **({"friction_widths": dict(self.friction_widths)} if self.friction_widths else {}),
            "joints": [
                {
                    "name": j.name,
                    "error_before": finite(j.error_before),
                    "error_after": finite(j.error_after),
                    "noise_rms": j.noise_rms,
                    "torque_rms": finite(j.torque_rms),
                    "torque_unit": j.torque_unit,
                }
                for j in self.joints
            ],
            "steps": [
                {
                    **place(step.effect),
                    "test_error_before": step.test_error_before,
                    "test_error_after": step.test_error_after,
                    "indistinguishable": [place(effect) for effect in step.indistinguishable],
                    **step.details(),
                }
                for step in self.steps
            ],
            "candidates": [
                {
                    **place(c.effect),
                    "status": c.status,
                    "p_value": c.p_value,
                    "test_gain": c.test_gain,
                }
                for c in self.candidates
            ],
            "test_error": {
                "before": self.test_error.before,
                "after": self.test_error.after,
                "noise_floor": self.test_error.noise_floor,
            },
            "wiring": [fault.to_dict() for fault in self.wiring],
            **({"impossible": list(self.impossible)} if self.impossible else {}),
            "rows": self.rows.to_dict(),
            "withdrawn": [one.to_dict() for one in self.withdrawn],
            **self._limits(),
            **({"drives_anew": self.drives_anew.to_dict()} if self.drives_anew else {}),
            **self._dependence(),
            "proposals": [one.to_dict() for one in self.proposals],
            "notes": [*self.without_noise, *self.whose_position, *self.caveats, *self.when_sampled],
            **({"criteria": self._changed_criteria()} if self.criteria.changed else {}),
        }

    def _limits(self) -> dict[str, Any]:
        said = [one.to_dict() for one in self.detection_limits]
        return {"detection_limits": said} if said else {}

    def _dependence(self) -> dict[str, Any]:
        said = [one.to_dict() for one in self.residual_dependence]
        return {"residual_dependence": said} if said else {}

    def _changed_criteria(self) -> dict[str, Any]:
        return {one.name: one.value for one in self.criteria.changed}

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        if self.wiring:
            return (self.sentence, self.joint_table(), self.map_table(), *self.caveats)
        return (
            self.joint_table(),
            self.map_table(),
            self.candidate_table(),
            self.step_table(),
            *anew_tables(self.drives, self.drives_anew),
            self.sentence,
            *((limit_table(self.detection_limits),) if self.detection_limits else ()),
            *dependence_sentences(self.residual_dependence),
            *((dependence_table(self.residual_dependence),) if self.residual_dependence else ()),
            *self._proposed(),
            *self.caveats,
        )

    def _proposed(self) -> tuple[Table | str, ...]:
        """The laws proposed, each a sentence and its parameters."""
        robot, found = self.after.model.robot, []
        for number_, one in enumerate(self.proposals, 1):
            title = f"Proposal {number_}: {one.torque} at {one.effect.joint}"
            columns = ("parameter", "value", "sigma", "unit")
            found += [one.sentence, Table(title, columns, one.rows(robot))]
        return tuple(found)

    def joint_table(self) -> Table:
        """Errors per joint."""
        rows = tuple(
            (
                j.name,
                percent(j.error_before),
                percent(j.error_after),
                percent(j.noise_share),
                number(j.ratio_before, 3),
                number(j.ratio_after, 3),
            )
            for j in self.joints
        )
        overall = self.test_error
        floor = percent(overall.noise_floor)
        total = ("all", percent(overall.before), percent(overall.after), floor, "", "")
        return Table(
            f"Relative torque error on {self.held_out}",
            ("joint", "before", "after", "noise floor", "systematic / noise", "and after"),
            (*rows, total),
            (
                f"Noise floor: {self._noise_in_words()}.",
                f"Both fitted for the diagnosis, by {self.fitted_by}.",
                *mostly_noise([j.name for j in self.joints], [j.noise_share for j in self.joints]),
            ),
        )

    def map_table(self) -> Table:
        """Where the model fails, one sentence for each thing seen."""
        seen = tuple((m.joint, m.against, m.sentence) for m in self.maps if m.sentence)
        notes = (self.silent_maps,) if self.silent_maps else ()
        title = "Where the given model fails"
        if not seen:
            title += ", by shapes that have a name"
        return Table(title, ("joint", "against", "what is seen"), seen, notes)

    def candidate_table(self, most: int = 10) -> Table:
        """The ranking on the model as given."""
        shown = [c for c in self.candidates if c.status != "absorbed"][:most]
        added = {step.effect.label for step in self.steps}
        rows = tuple(
            (
                c.effect.label,
                p_value(c.p_value),
                points(c.test_gain),
                c.finding_of_added if c.effect.label in added else c.finding,
            )
            for c in shown
        )
        hidden = hidden_effects(self.candidates, len(self.joints))
        unseen = (f"Not identifiable: {one.title}. {one.remark}" for one in hidden)
        notes = (*gain_notes(shown), *unseen)
        columns = ("effect", "p", "gain, points", "finding")
        return Table("Candidates, tried on the model as given", columns, rows, notes)

    def step_table(self) -> Table:
        """The effects added, in order."""
        rows = tuple(
            (
                step.effect.label,
                percent(step.test_error_before),
                percent(step.test_error_after),
                step.fall_in_words,
                ", ".join(self._alternatives(step)) or "none",
            )
            for step in self.steps
        )
        columns = (
            "effect added",
            "held-out error before",
            "after",
            "fall, points",
            "cannot be told from",
        )
        return Table("Effects added", columns, rows, step_notes(self.steps))

    def _alternatives(self, step: Step) -> list[str]:
        # Two effects that share a column may both be added: then only that column is in doubt.
        added = {one.effect.label for one in self.steps}
        return [
            e.label + (" (its constant)" if e.label in added else "")
            for e in step.indistinguishable
        ]

    def _noise_in_words(self) -> str:
        return {
            "replicates": "measured, from the repeated periods",
            "given": "as the study states it, not measured",
            "unknown": "unknown (nothing repeats and no noise is stated), so the verdict is weaker",
        }[self.noise_source]
