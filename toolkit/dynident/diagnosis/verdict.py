"""When a model is said to be complete, and when not; and the caveats of either."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.answer import Verdict
from dynident.diagnosis.details import Step
from dynident.diagnosis.nuisances.look_alikes import look_alike_notes
from dynident.diagnosis.nuisances.sticking import sticking_notes
from dynident.diagnosis.search.ranking import Ranking, candidates, carries_noise
from dynident.evidence.evidence import Evidence, noise_source
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut
from dynident.fitting.estimate import nearly_hidden
from dynident.recording import unwrapped_notes
from dynident.recording.dataset import NoiseSource
from dynident.tables import listed


def verdict_of(
    before: HeldOut,
    after: HeldOut,
    trained: HeldOut,
    steps: Sequence[Step],
    last: Ranking,
    criteria: VerdictCriteria,
    bursts: Collection[str] = (),
) -> Verdict:
    """Return the verdict on a search, from what it leaves and its last ranking.

    Parameters
    ----------
    before, after : what the given and the final model miss on held-out data.
    trained : what the final model leaves of the recordings that it was fitted to. What is larger
        than their noise there is missing, whether or not the held-out motion shows it.
    steps : the effects added.
    last : the last ranking.
    criteria : of the verdict.
    bursts : joints at which a few instants hold most of what the final model leaves. Noise of one
        size makes none, so that a model without a step is not called complete beside them.
    """
    if after.least_ratio is None or after.ratio is None or before.ratio is None:
        if last.passing or (bursts and not steps):
            return "unexplained"
        return "explained" if steps else "nothing_missing"
    if beyond_noise(trained, criteria).any():
        return "unexplained"
    if within_noise(after, criteria):
        return "explained" if steps else "nothing_missing"
    explained = 1.0 - float(np.sum(after.ratio**2) / np.sum(before.ratio**2))
    much = explained >= criteria.most_explained
    if steps and much and float(after.ratio.max()) <= criteria.most_left:
        return "explained"
    return "unexplained"


def within_noise(judged: HeldOut, criteria: VerdictCriteria) -> bool:
    """Whether nothing remains at any joint but noise, and what nothing can resolve."""
    return not np.any(_more_than(criteria.within_noise, judged, criteria))


def beyond_noise(judged: HeldOut, criteria: VerdictCriteria) -> np.ndarray:
    """Joints (n,) at which more remains than may be left where most is explained."""
    if judged.least_ratio is None:
        return np.zeros(len(judged.torque_rms), dtype=bool)
    return _more_than(criteria.most_left, judged, criteria)


def _more_than(share: float, judged: HeldOut, criteria: VerdictCriteria) -> np.ndarray:
    """Joints (n,) at which more than a share of the noise remains, and than nothing can resolve."""
    assert judged.least_ratio is not None and judged.noise_std is not None
    power = (judged.least_ratio * judged.noise_std) ** 2
    if judged.rounding is not None:
        power = power - judged.rounding
    systematic = np.sqrt(np.clip(power, 0.0, None))
    matters = systematic > criteria.resolution * judged.torque_rms
    return matters & (systematic > share * judged.noise_std)


def notes_on_steps(steps: Sequence[Step], held: Evidence | None) -> tuple[str, ...]:
    """Return what is doubtful of the falls of a path, in plain words.

    Parameters
    ----------
    steps : the effects added.
    held : of the test recordings; None where blocks of time are held out.
    """
    notes = []
    if steps and held is None:
        notes.append(
            "The held-out blocks of time that judge the effects helped to choose them, too: the "
            "error with them may be a little too low. Test recordings would judge them afresh."
        )
    uncertain = [one.effect.title for one in steps if one.uncertain]
    if uncertain:
        falls = "the fall with it is" if len(uncertain) == 1 else "the fall with each is"
        notes.append(
            f"{', '.join(uncertain)}: {falls} within two standard errors over "
            "blocks of time, and may be chance."
        )
    return tuple(notes)


def _not_tried(evidence: Evidence, fitted: EvidenceFit) -> list[str]:
    """Which effects plain least squares takes for the noise in its columns; empty for none."""
    if not carries_noise(evidence):
        return []
    robot = fitted.model.robot
    responses = [one for one in candidates(fitted.model) if one.is_dynamic_response]
    by_bursts = {one.name for one in responses if one.nonlinear and one.sought_in(robot)}
    names = [
        _spoken(one) for one in dict.fromkeys(r.name for r in responses) if one not in by_bursts
    ]
    if not names:
        return []
    were = "was" if len(names) == 1 else "were"
    return [
        f"{listed(names).capitalize()} {were} not tried: a joint that gives way looks like the "
        "noise in accelerations. A motion that repeats would show it, and `dynident compare STUDY "
        "--with EFFECT` how far the error falls with one, which that noise may bring about."
        + "".join(
            f" {_spoken(one).capitalize()} was sought only at joints where a few rows hold much of "
            "what is left."
            for one in sorted(by_bursts)
        )
    ]


def _spoken(name: str) -> str:
    return name.replace("_", " ")


def notes_on(
    evidence, held, fitted: EvidenceFit, source: NoiseSource, doubtful: Collection[str] = ()
) -> tuple[str, ...]:
    """Return the caveats that belong to a verdict, in plain words.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings; `held` may be None.
    fitted : the final model.
    source : where the noise floor comes from.
    doubtful : joints whose reversals are left out as their dry friction may follow another law.
    """
    recordings = [run.recording for run in (*evidence.runs, *(held.runs if held else ()))]
    notes = [*unwrapped_notes((one.name, one.provenance.unwrapped) for one in recordings)]
    if held is None:
        notes.append("No test recordings: errors are those of held-out blocks of time.")
    elif source != "unknown" and all(run.kind == "single" for run in held.runs):
        notes.append("The test recordings do not repeat: the noise is that of the training ones.")
    if source == "given":
        notes.append("The noise is the study's word, not measured: record a repeated motion.")
    simulated = evidence.runs[0].columns_from == "simulation"
    if noise_source(evidence, None) == "unknown" and simulated:
        notes.append(
            "Nothing repeats in the training recordings and no noise is stated: the instruments "
            "are simulated, and there is no noise floor."
        )
    elif noise_source(evidence, None) == "unknown":
        floor = ", and no noise floor" if source == "unknown" else ""
        notes.append(
            "Nothing repeats in the training recordings and no noise is stated: plain least "
            f"squares, whose columns carry noise{floor}. Small effects may be false; record a "
            "repeated motion."
        )
        notes += _not_tried(evidence, fitted)
    responses = [one.title for one in fitted.model.effects if one.is_dynamic_response]
    if simulated and responses:
        notes.append(
            f"{', '.join(responses)}: significant along the simulated motion, which has no noise, "
            "and fitted along the measured one. The noise of its positions biases value and shape, "
            "and may be part of what the error falls by; no interval allows for that."
        )
    if any(effect.is_payload for effect in fitted.model.effects):
        payload_recordings = [r.recording.name for r in evidence.runs if r.recording.payload]
        payload_recordings += [
            r.recording.name for r in (held.runs if held else ()) if r.recording.payload
        ]
        notes.append(
            f"Payload carried in: {', '.join(payload_recordings)}. Before `dynident add` can write "
            "it into the study, set payload = true in the [[recordings]] of these, and false in "
            "the others."
        )
    notes += look_alike_notes(evidence, fitted)
    notes += sticking_notes(evidence, doubtful)
    first = [run.replicates[0] for run in evidence.runs]
    if any(one.unthinned for one in first):
        rates = listed(sorted({f"{one.parallel.rate_hz:.4g}" for one in first if one.unthinned}))
        notes.append(
            f"Fast recordings were low-passed and thinned to {rates} Hz for this diagnosis, which "
            "leaves its rows at the same instants. Fits and comparisons take every sample."
        )
    return (*notes, *nearly_hidden(fitted.model.base))
