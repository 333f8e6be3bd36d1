"""What a diagnosis says: where the model fails, what is missing, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from dynident.criteria import DEFAULTS, Criteria
from dynident.diagnosis.dependence.residual_dependence import (
    JointDependence,
    dependence_sentences,
    dependence_table,
)
from dynident.diagnosis.details import (
    Candidate,
    JointResult,
    Step,
    TestError,
    Trace,
    Withdrawn,
    gain_notes,
    place,
    step_notes,
)
from dynident.diagnosis.detection_limits import DetectionLimit, limit_table
from dynident.diagnosis.effect_groups import hidden_effects
from dynident.diagnosis.leading_effects import LeadingEffects
from dynident.diagnosis.nuisances.sampling_time import SamplingTime
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.switches import Switches
from dynident.diagnosis.track_record import JOINTS, TrackRecord, track_record
from dynident.evidence.maps import ResidualMap
from dynident.fitting.drive_gains import DriveGains, anew_tables
from dynident.fitting.estimate import DataSource, Estimate
from dynident.recording import RowCount
from dynident.recording.dataset import NoiseSource
from dynident.tables import Shown, Table, finite, mostly_noise, number, p_value, percent, points
from dynident.wiring import Fault

Verdict = Literal["nothing_missing", "explained", "unexplained"]

_VERDICTS: dict[Verdict, str] = {
    "nothing_missing": "Nothing is missing: what remains is within the noise.",
    "explained": "Explained: {effects} added, and what remains is within the noise.",
    "unexplained": "None of these explains it: a residual beyond the noise remains, and no effect "
    "in the catalogue takes it away.",
}

_VERDICTS_WITHOUT_NOISE: dict[Verdict, str] = {
    "nothing_missing": "No effect in the catalogue is significant, relevant and of use on held-out "
    "blocks of time; the noise is unknown, so whether something else is missing cannot be said.",
    "explained": "Added: {effects}. No further effect is significant and relevant; the noise is "
    "unknown, so whether something else is missing cannot be said.",
    "unexplained": "Added: {effects}. More effects are significant and relevant; the noise is "
    "unknown.",
}


@dataclass(frozen=True, kw_only=True)
class Diagnosis(Shown):
    """The answer of `diagnose`.

    Attributes
    ----------
    verdict : "nothing_missing", "explained" or "unexplained".
    noise_source : where the noise floor comes from.
    joints, test_error : errors before and after, with the floor.
    steps : effects in the order in which they were added.
    candidates : every effect tried on the model as given, best first.
    remaining : every effect tried on the final model, best first.
    before, after : the estimates of the model as given and of the final one.
    maps, traces : for pictures.
    notes : caveats that belong to the verdict, in plain words.
    test_sources : the test recordings; empty where blocks of time were held out.
    criteria : the numbers by which all this was decided.
    wiring : columns and data that are not what the study says: where there are any, they are the
        answer, nothing is added, and the verdict is "unexplained".
    impossible : inertias and frictions of the final model that no robot has; likewise.
    withdrawn : effects that passed every gate and were taken back, with the reason.
    rows : of the recordings, training and test, that are used, and why the others are not.
    detection_limits : where nothing is missing, how large each effect could have been unseen.
    proposals : laws for what the catalogue leaves, one after the other, each beside those before.
    limit : effects that were allowed, where the search ended there; None where it ended by itself.
    residual_dependence : where the verdict is "unexplained" (or laws are asked for), what the
        residual depends on, before any proposal, at each joint at which something is left.
    reversals_left_out : share of the rows, for joints whose dry friction may follow another law at
        its reversals: these rows count neither in the fit nor in the errors.
    training_only : joints at which the training recordings leave more than their noise, where the
        held-out recordings leave none: the verdict is "unexplained" for that alone.
    following_motion : joints without a noise floor at which what is left is no noise, as functions
        of position and velocity, or of the speeds of all joints, predict it; empty elsewhere.
    sampled : when the torque acts, where that is not when the study says.
    switches : every choice among the effects added, fitted and judged, where that was asked for.
    drives : gains by which currents became torques, and loads that were identified; None where
        nothing had to be found.
    drives_anew : the same, fitted with the effects added; None where none was.
    """

    verdict: Verdict
    noise_source: NoiseSource
    joints: tuple[JointResult, ...]
    test_error: TestError
    steps: tuple[Step, ...]
    candidates: tuple[Candidate, ...]
    remaining: tuple[Candidate, ...]
    before: Estimate
    after: Estimate
    maps: tuple[ResidualMap, ...] = ()
    traces: tuple[Trace, ...] = ()
    notes: tuple[str, ...] = ()
    test_sources: tuple[DataSource, ...] = ()
    criteria: Criteria = DEFAULTS
    wiring: tuple[Fault, ...] = ()
    impossible: tuple[str, ...] = ()
    withdrawn: tuple[Withdrawn, ...] = ()
    detection_limits: tuple[DetectionLimit, ...] = ()
    proposals: tuple[Proposal, ...] = ()
    limit: int | None = None
    rows: RowCount = field(default_factory=RowCount)
    residual_dependence: tuple[JointDependence, ...] = ()
    reversals_left_out: Mapping[str, float] = field(default_factory=dict)
    training_only: tuple[str, ...] = ()
    following_motion: tuple[str, ...] = ()
    sampled: SamplingTime | None = None
    switches: Switches | None = None
    drives: DriveGains | None = None
    drives_anew: DriveGains | None = None

    @property
    def best(self) -> Step | None:
        """The first effect to add; None where nothing is to be added."""
        return self.steps[0] if self.steps else None

    @property
    def held_out(self) -> str:
        """What the errors are of: recordings of their own, or blocks of time of those fitted."""
        return "held-out data" if self.test_sources else "held-out blocks of time"

    @property
    def fitted_by(self) -> str:
        """How both models were fitted; an estimate that was given is not used, but fitted anew."""
        return self.before.method

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        if self.wiring:
            faults = " ".join(fault.sentence for fault in self.wiring)
            return f"The recordings are not what the study says, and nothing was sought. {faults}"
        said = " ".join([self._verdict_in_words, *self.left_out_in_words, *self.when_sampled])
        if self.limit is None:
            return said
        return f"{said} {self.limit_in_words}: allow more (--most)."

    @property
    def limit_in_words(self) -> str:
        """That the search was stopped, without a full stop; empty where it ended by itself."""
        if self.limit is None:
            return ""
        if self.limit == 0:
            return (
                "Nothing was to be added, and more effects are significant and relevant than the "
                "model has"
            )
        additions = "1 addition" if self.limit == 1 else f"{self.limit} additions"
        return (
            f"The search ended at its limit of {additions}, and more effects are significant and "
            "relevant"
        )

    @property
    def left_out_in_words(self) -> tuple[str, ...]:
        """What a verdict does not speak of; empty where it speaks of all rows."""
        shares = self.reversals_left_out.items()
        each = [f"{joint} ({percent(x, 0)} of its rows)" for joint, x in shares]
        if not each:
            return ()
        return (
            f"That leaves out the reversals of {', '.join(each)}, where dry friction may follow "
            "another law than the model's.",
        )

    @property
    def when_sampled(self) -> tuple[str, ...]:
        """That the torque is of another moment than the study says; empty where it is not."""
        return () if self.sampled is None else (self.sampled.sentence,)

    @property
    def _verdict_in_words(self) -> str:
        effects = LeadingEffects.of(self.steps).in_words
        if self.impossible:
            added = f" {effects} added, but" if effects else ""
            return (
                f"None of these explains it:{added} no robot can have what the fit says, "
                f"{', '.join(self.impossible)}. Is the sign, the unit or the order of a column "
                "wrong, or is the description another robot's?"
            )
        if self.limit is not None and self.verdict == "unexplained":
            return self._stopped(effects)
        if self.following_motion:
            added = f"Added: {effects}." if effects else "No effect in the catalogue is of use."
            return (
                f"{added} What is left at {' and '.join(self.following_motion)} is not all noise: "
                "functions of the joint's position and velocity, or of the joints' speeds, or "
                "errors of the measured positions that depend on the position, predict it on "
                "blocks of time that they were not fitted to. How much of it is noise is unknown."
            )
        if self.training_only:
            added = f"Added: {effects}." if effects else "No effect in the catalogue explains it:"
            return (
                f"{added} {'T' if effects else 't'}he training recordings leave more than their "
                f"noise at {' and '.join(self.training_only)}, and the held-out recordings do not "
                "show it."
            )
        if self.noise_source == "unknown" and self.verdict == "unexplained" and not effects:
            return "Effects are significant and relevant, and none was added; the noise is unknown."
        if self.noise_source == "unknown":
            return _VERDICTS_WITHOUT_NOISE[self.verdict].format(effects=effects)
        left = max((j.ratio_after or 0.0 for j in self.joints), default=0.0)
        if self.verdict != "unexplained" and left > self.criteria.verdict.not_nothing:
            found = f"Explained: {effects} added, and" if effects else "No missing effect is found:"
            if left >= 1.0:  # encoders' steps alone excuse so much
                size = (
                    f"{left:.2g} times the noise, and may be what the steps of the encoders leave"
                )
                return f"{found} what remains is {size}."
            return (
                f"{found} what remains is smaller than the noise ({left:.2g} of it), though not "
                "nothing."
            )
        if self.verdict == "unexplained" and effects:
            before, after = percent(self.test_error.before), percent(self.test_error.after)
            return (
                f"Explained in part: adding {effects} brings the error from {before} to {after}. A "
                "residual beyond the noise remains, and none of the effects in the catalogue "
                "explains it."
            )
        if self.verdict == "nothing_missing" and self.withdrawn:
            return (
                "Nothing is missing that held-out data confirm: what remains is within the noise. "
                f"Training recordings call for {self._withdrawn_titles}: withdrawn."
            )
        return _VERDICTS[self.verdict].format(effects=effects)

    @property
    def _withdrawn_titles(self) -> str:
        """What was taken back, each with what cannot be told from it."""
        return " and ".join(
            " or ".join(effect.title for effect in (one.effect, *one.with_it))
            for one in self.withdrawn
        )

    def _stopped(self, effects: str) -> str:
        """The verdict where the limit ended the search: what else the catalogue has is not known.

        Parameters
        ----------
        effects : that were added, in words; may be empty.
        """
        if self.noise_source == "unknown":
            left = "The noise is unknown."
        else:
            left = "A residual beyond the noise remains."
        if not effects:
            return left
        before, after = percent(self.test_error.before), percent(self.test_error.after)
        return f"Adding {effects} brings the error from {before} to {after}. {left}"

    @property
    def track_record(self) -> TrackRecord | None:
        """How often answers like this one were right; None where that is not known.

        It holds for noise that was measured on repetitions, for robots of as many joints as those
        that were counted, for the default criteria, and for searches that ended by themselves.
        """
        floor = self.test_error.noise_floor
        stopped = self.limit is not None and self.verdict == "unexplained"
        if (
            self.wiring
            or self.impossible
            or stopped
            or self.training_only  # no answer that was counted is of this kind
            or not JOINTS[0] <= len(self.joints) <= JOINTS[1]
        ):
            return None
        if self.noise_source != "replicates" or not floor or self.criteria.changed:
            return None
        over = self.test_error.before / floor
        return track_record(self.verdict, named=bool(self.steps), over_floor=over)

    @property
    def confidence(self) -> str:
        """The same in plain words; empty where nothing can be said."""
        return str(self.track_record or "")

    @property
    def caveats(self) -> tuple[str, ...]:
        """How far the verdict can be trusted, in plain words: its record, criteria, notes."""
        changed = ", ".join(str(one) for one in self.criteria.changed)
        return (
            *((self.confidence,) if self.confidence else ()),
            *((f"Criteria of the study, not the defaults: {changed}.",) if changed else ()),
            *(one.sentence for one in self.withdrawn),
            *self.notes,
        )

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `diagnose --json` and `explain --json`."""
        return {
            "verdict": self.verdict,
            "noise": {"source": self.noise_source},
            **({} if self.limit is None else {"limit": self.limit}),
            **({"training_only": list(self.training_only)} if self.training_only else {}),
            **({"following_motion": list(self.following_motion)} if self.following_motion else {}),
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
                    **step.doubt(),
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
            "notes": [*self.caveats, *self.when_sampled],
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
        return Table(
            "Where the given model fails", ("joint", "against", "what is seen"), seen, notes
        )

    @property
    def silent_maps(self) -> str:
        """At which joints something may be left that no map has a name for; empty for none."""
        named = {one.joint for one in self.maps if one.sentence}
        least = self.criteria.verdict.within_noise
        left = [
            one
            for one in sorted(self.joints, key=lambda one: one.error_before, reverse=True)
            if one.error_before > 0
            and one.name not in named
            and (one.ratio_before is None or one.ratio_before > least)
        ]
        if not self.maps or not left:
            return ""
        each = ", ".join(f"{one.name} ({percent(one.error_before)})" for one in left)
        return (
            f"No shape that the catalogue has a name for stands out at {each}; in brackets what "
            "the model leaves of the torque. Each map is against the joint's own motion: what "
            "another joint does to it shows in none."
        )

    def candidate_table(self, most: int = 10) -> Table:
        """The ranking on the model as given."""
        shown = [c for c in self.candidates if c.status != "absorbed"][:most]
        rows = tuple(
            (
                c.effect.label,
                p_value(c.p_value),
                points(c.test_gain),
                c.finding,
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
