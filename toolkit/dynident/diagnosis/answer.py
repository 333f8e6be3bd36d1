"""The answer of a diagnosis in plain words: what it holds, the verdict, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from dynident.criteria import DEFAULTS, Criteria
from dynident.diagnosis.dependence.residual_dependence import JointDependence
from dynident.diagnosis.details import (
    Candidate,
    HidingFilter,
    JointResult,
    Step,
    TestError,
    Trace,
    Withdrawn,
    together,
)
from dynident.diagnosis.detection_limits import DetectionLimit
from dynident.diagnosis.effect_groups import every_joint
from dynident.diagnosis.leading_effects import LeadingEffects
from dynident.diagnosis.nuisances.sampling_time import SamplingTime
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.switches import Switches
from dynident.diagnosis.track_record import JOINTS, TrackRecord, track_record
from dynident.evidence.maps import ResidualMap
from dynident.fitting.drive_gains import DriveGains
from dynident.fitting.estimate import DataSource, Estimate
from dynident.recording import RowCount
from dynident.recording.dataset import NoiseSource
from dynident.tables import listed, percent
from dynident.wiring import Fault
from dynident.wiring.speed_limits import OverSpeed

Verdict = Literal["nothing_missing", "explained", "unexplained"]
Rest = Literal["within the noise", "smaller than the noise", "larger than the noise"]

_VERDICTS: dict[Verdict, str] = {
    "nothing_missing": "Nothing is missing: what remains is within the noise.",
    "explained": "Explained: {effects} added, and what remains is within the noise.",
    "unexplained": "None of these explains it: a residual beyond the noise remains, and no effect "
    "in the catalogue was seen to take it away.",
}

_VERDICTS_WITHOUT_NOISE: dict[Verdict, str] = {
    "nothing_missing": "No effect in the catalogue is significant, relevant and of use on held-out "
    "blocks of time. The torque error is {error}; the noise is unknown, so whether something else "
    "is missing cannot be said.",
    "explained": "Added: {effects}. No further effect is significant and relevant; the noise is "
    "unknown, so whether something else is missing cannot be said.",
    "unexplained": "Added: {effects}. More effects are significant and relevant; the noise is "
    "unknown.",
}


@dataclass(frozen=True, kw_only=True, repr=False)
class Answer:
    """What a diagnosis has found, and what is said of it.

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
    stops_left_out : the same of joints that stick, where no data tell the dry friction.
    training_only : joints at which the training recordings leave more than their noise, where the
        held-out recordings leave none: the verdict is "unexplained" for that alone.
    following_motion : joints without a noise floor at which what is left is no noise, as functions
        of position and velocity, or of the speeds of all joints, predict it; empty elsewhere.
    bursts : joints at which a few instants, not those of their reversals, hold most of what is left
        of the training recordings.
    drifting : joints whose repetitions differ the more, the longer they lie apart: what changes
        from one to the next is measured as noise.
    friction_widths : of every joint, rad/s or m/s, where fits need others than the model's: both
        models were fitted with those.
    sampled : when the torque acts, where that is not when the study says.
    too_fast : the joint that is faster than it can be, as the study reads its position.
    hiding_filter : the study's low-pass of the positions where it hides motion and something is
        left that this may have made; else None.
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
    stops_left_out: Mapping[str, float] = field(default_factory=dict)
    training_only: tuple[str, ...] = ()
    following_motion: tuple[str, ...] = ()
    bursts: tuple[str, ...] = ()
    drifting: tuple[str, ...] = ()
    friction_widths: Mapping[str, float] = field(default_factory=dict)
    sampled: SamplingTime | None = None
    too_fast: OverSpeed | None = None
    hiding_filter: HidingFilter | None = None
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
            said = "The recordings and the study contradict each other, and nothing was sought."
            return f"{said} {faults}"
        said = " ".join(
            [
                *self.whose_position,
                self._verdict_in_words,
                *self.left_out_in_words,
                *self.not_judged_in_words,
                *self.when_sampled,
            ]
        )
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
        law = "where dry friction may follow another law than the model's"
        if self.only_reversals_left:
            return (
                f"Left out are the reversals of {', '.join(each)}, {law}: which, or what looks "
                "like one, these data do not tell.",
            )
        return (f"That leaves out the reversals of {', '.join(each)}, {law}.",)

    @property
    def not_judged_in_words(self) -> tuple[str, ...]:
        """Where joints stick, of which a verdict that all is well does not speak; else empty."""
        joints = list(self.stops_left_out)
        if not joints or self.verdict == "unexplained":
            return ()
        where = f"at {listed(joints)}"
        if len(joints) == len(self.joints) > 1:
            where = f"at {every_joint(len(joints))}"
        return (f"What happens around stops {where} is not judged.",)

    @property
    def whose_position(self) -> tuple[str, ...]:
        """That a joint is faster than it can be; empty where none is."""
        return () if self.too_fast is None else (self.too_fast.sentence,)

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
            left = (
                "The training recordings leave more than their noise at "
                f"{' and '.join(self.training_only)}, and the held-out recordings do not show it."
            )
            added = f"Added: {effects}. " if effects else ""
            if self.withdrawn:
                return (
                    f"{added}{left} The training recordings call for {self._withdrawn_titles}, "
                    "which was withdrawn."
                )
            return (
                f"{added}{left}" if effects else f"{left} No effect in the catalogue explains it."
            )
        if self.only_bursts:
            return (
                "No effect in the catalogue is of use, and what is left at "
                f"{' and '.join(self.bursts)} is hardly noise: a few bursts hold most of it, as "
                "noise of one size never does. How much of the rest is noise is unknown."
            )
        if self.noise_source == "unknown" and self.verdict == "unexplained" and not effects:
            return "Effects are significant and relevant, and none was added; the noise is unknown."
        if self.noise_source == "unknown":
            error = percent(self.test_error.after)
            return _VERDICTS_WITHOUT_NOISE[self.verdict].format(effects=effects, error=error)
        if self.verdict != "unexplained" and self.rest != "within the noise":
            found = f"Explained: {effects} added, and" if effects else "No missing effect is found:"
            size = "smaller than the noise ({} of it), though not nothing"
            if self.rest == "larger than the noise":
                size = "{} times the noise, and may be what the steps of the encoders leave"
            return f"{found} what remains is {size.format(f'{self._left:.2g}')}."
        if self.verdict == "unexplained" and effects:
            before, after = percent(self.test_error.before), percent(self.test_error.after)
            none = ", and none of the effects in the catalogue explains it"
            if self.withdrawn:
                none = "; what training recordings call for besides was withdrawn"
            return (
                f"Explained in part: adding {effects} brings the error from {before} to {after}. A "
                f"residual beyond the noise remains{none}."
            )
        if self.verdict == "nothing_missing" and self.withdrawn:
            return (
                "Nothing is missing that held-out data confirm: what remains is within the noise. "
                f"Training recordings call for {self._withdrawn_titles}: withdrawn."
            )
        if self.only_withdrawn:
            several = "several of these together, " if self.withdrawn[1:] else ""
            return (
                "A residual beyond the noise remains. What training recordings call for was "
                f"withdrawn: {self._withdrawn_titles}. Missing may be {several}something that "
                "differs between recordings, or what the catalogue does not have."
            )
        if self.only_reversals_left:
            where = listed(list(self.reversals_left_out))
            return (
                f"Away from the reversals of {where} nothing is missing, and what remains is "
                "within the noise."
            )
        return _VERDICTS[self.verdict].format(effects=effects)

    @property
    def only_reversals_left(self) -> bool:
        """Whether all is well but at reversals, which are left out."""
        return self.verdict == "nothing_missing" and bool(self.reversals_left_out)

    @property
    def only_bursts(self) -> bool:
        """Whether bursts are all that speaks for something missing, and no noise floor is known."""
        others = self.steps or self.following_motion or self.withdrawn or self.impossible
        alone = self.verdict == "unexplained" and not others and self.limit is None
        return alone and bool(self.bursts) and self.noise_source == "unknown"

    @property
    def only_withdrawn(self) -> bool:
        """Whether a residual is left for which training recordings call for effects in vain.

        That the catalogue does not hold what is missing is then not known.
        """
        return self.verdict == "unexplained" and not self.steps and bool(self.withdrawn)

    @property
    def rest(self) -> Rest:
        """How large what remains is where it is not called missing, for the worst joint."""
        if self._left <= self.criteria.verdict.not_nothing:
            return "within the noise"
        # The steps of encoders alone excuse as much as the noise and more.
        return "smaller than the noise" if self._left < 1.0 else "larger than the noise"

    @property
    def _left(self) -> float:
        """Systematic residual over noise, of the joint where that is largest."""
        return max((joint.ratio_after or 0.0 for joint in self.joints), default=0.0)

    @property
    def _withdrawn_titles(self) -> str:
        """What was taken back, each with what cannot be told from it."""
        return listed(
            [
                " or ".join(effect.title for effect in (one.effect, *one.with_it))
                for one in self.withdrawn
            ]
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
            or self.only_withdrawn
            or self.too_fast is not None
            or self.reversals_left_out  # of these rows nothing is claimed
            or self.drifting  # nor of what is smaller than that
            or not JOINTS[0] <= len(self.joints) <= JOINTS[1]
        ):
            return None
        if self.noise_source != "replicates" or not floor or self.criteria.changed:
            return None
        over = self.test_error.before / floor
        return track_record(self.verdict, effects=len(together(self.steps)), over_floor=over)

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

    @property
    def without_noise(self) -> tuple[str, ...]:
        """The verdict in words, where its name alone says more than is known without a noise."""
        named = self.verdict != "unexplained" and self.noise_source == "unknown"
        return (self._verdict_in_words,) if named else ()

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
