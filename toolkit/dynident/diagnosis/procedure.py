"""The way of data through a diagnosis: compare -> rank -> add -> refit -> judge.

Before it, recordings are checked against the robot (`dynident.wiring`): where a column is not what
it is called, that is the answer, and nothing is added.

- *compare*: the model as given is fitted to the recordings, where they repeat with one repetition
  as the instrument of another, so that noise in the columns does no harm. What is no missing
  physics is allowed for: contacts are left out, dry friction may reverse over another width.
- *rank*: every effect that the model lacks is scored by what it would take off the residual; the
  best are refined in their shapes and cross-validated; gates say which are significant and
  relevant.
- *add*: the best of these, or a simpler one that explains nearly as much; what every joint has, at
  all joints that call for it.
- *refit*: all parameters anew, shapes too; values that no robot can have refuse the effect, and so
  does an effect that explains less than it promised: the next best is tried. Then rank again, until
  no effect passes the gates. Where a residual remains, a search through all shapes of effects that
  ring or have backlash follows.
- *judge*: what the others have made superfluous is dropped, and what raises the error on recordings
  (or blocks of time) that were not fitted is withdrawn, with what cannot be told from it. Then the
  search goes on with what is left, a few times at most. Errors before and after, and the verdict,
  are those on the same data. A residual that no effect explains is asked what it depends on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dynident.arguments import checked
from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.diagnosis.advice.coupled_pairs import alike_notes
from dynident.diagnosis.advice.geometry_doubt import with_geometry_doubt
from dynident.diagnosis.advice.hiding_filter import with_filter_doubt
from dynident.diagnosis.assembly import Search, assemble
from dynident.diagnosis.dependence.what_is_left import doubted, with_dependence
from dynident.diagnosis.details import Withdrawn
from dynident.diagnosis.extension.extending import extend, rank_stage
from dynident.diagnosis.extension.other_ways import by_other_ways
from dynident.diagnosis.extension.stage import AskedSwitches, DiagnosisTask, Propose, Stage
from dynident.diagnosis.nuisances.contacts import Contacts
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.nuisances.sticking import seen_alike, without_sticking
from dynident.diagnosis.proposals.law_search import LawSearch
from dynident.diagnosis.proposals.proposals_of import proposals_of
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.search.path import Path, path_of, responses_in_place
from dynident.diagnosis.search.payload_recordings import marked
from dynident.diagnosis.search.ranking import candidates
from dynident.diagnosis.search.refusal import narrower
from dynident.diagnosis.search.selection import without_superfluous
from dynident.diagnosis.search.shaped_fit import shaped
from dynident.diagnosis.switches import switches_of
from dynident.effects import Effect
from dynident.errors import FitError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.evidence.simulated_motion import motion_of_loop
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.progress import logged
from dynident.recording import Dataset, Recording, filtered_alike, numbered
from dynident.threads import single_threaded
from dynident.wiring import check_wiring


@checked
@single_threaded
def diagnose(
    model: Model | Estimate,
    train: Dataset | Recording,
    test: Dataset | Recording | None = None,
    *,
    controller: Controller | None = None,
    most: int | None = None,
    propose: Propose = "unexplained",
    switches: AskedSwitches = "none",
    criteria: Criteria = DEFAULTS,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Find where a model fails and which physical effects it lacks.

    Parameters
    ----------
    model : the model as given (or an estimate of it: it is fitted anew, with instruments where
        the motion repeats).
    train : recordings to fit; a single one takes the filter that suits it.
    test : recordings to judge by; without any, blocks of the training recordings are held out.
    controller : of the closed loop behind the recordings; where nothing repeats, the simulated
        loop gives the instruments.
    most : effects that are added at most, one at several joints counting once; None for
        `SearchCriteria.most_effects`.
    propose : when laws are proposed for what the catalogue leaves: "unexplained", where a residual
        beyond a known noise remains, or one that follows the motion, and no effect of the catalogue
        could be added; "always", and what the residual depends on is looked for whatever the
        verdict; "never".
    switches : "all": every choice among the effects added is fitted and judged, too, for a page
        on which they are switched on and off (`dynident.diagnosis.switches`).
    criteria : the numbers that decide the answer, see `dynident.criteria`.
    progress : is called with what is being done, for a display; by default a line of the log every
        ten seconds, see `dynident.progress`.

    Returns
    -------
    Errors before and after, the effects added, every candidate, and the verdict.

    Raises
    ------
    FitError
        If there is no recording.
    RecordingError
        If a recording is too short, does not repeat with its period, or lacks a joint.
    """
    given = model.model if isinstance(model, Estimate) else model
    every = (Dataset.of(one, given.robot.names) for one in (train, test) if one is not None)
    train, *others = numbered(*filtered_alike(*every))
    if not train.recordings:
        raise FitError("no recording to diagnose", remedy='mark some recordings use = "train"')
    if most is None:
        per_joint = criteria.search.most_effects_per_joint * given.robot.n
        most = max(criteria.search.most_effects, per_joint)
    progress = progress or logged("diagnosing")
    progress("checking the wiring")
    held_out = others[0] if others else None
    faults = check_wiring(given, train, held_out, criteria.wiring)
    most = 0 if faults else most
    task = DiagnosisTask(
        train=train,
        test=held_out,
        most=most,
        progress=progress,
        propose=propose,
        switches=switches,
    )
    start = _compare(given, controller, criteria, task)
    extended = extend(rank_stage(start, task), task)
    settled, path = _settle(by_other_ways(start, extended, task), task)
    found = _judge(settled, path, task)
    if faults:
        return found.answered_by(faults)
    # The data that judge a regression, or a law, show nothing of what only training leaves.
    left = found.verdict == "unexplained" and not found.training_only
    asked = left or propose == "always"
    if asked:
        progress("looking for what the residual depends on")
        found = with_dependence(found, settled.evidence, settled.judging, path)
    found = replace(found, notes=(*found.notes, *alike_notes(found)))
    return with_filter_doubt(with_geometry_doubt(found, settled.evidence.runs), train, held_out)


def _compare(
    given: Model, controller: Controller | None, criteria: Criteria, task: DiagnosisTask
) -> Stage:
    """Gather the evidence, and fit the model as given to it."""
    task.progress("reading the motion")
    loop = motion_of_loop(given, task.train, controller, task.progress, criteria)
    noise, samples_hz = criteria.noise, criteria.fit.samples_hz
    runs = loop.runs or gather(task.train, noise, samples_hz=samples_hz)
    evidence = Evidence(given, runs, criteria=criteria, candidates=_variants(given))
    held = None
    if task.test is not None and len(task.test):
        tested = gather(task.test, noise, samples_hz=samples_hz)
        held = Evidence(given, tested, criteria=criteria)
    task.progress("evaluating every effect")
    start = with_friction_width(evidence, shaped(evidence, given))
    whole = evidence
    evidence, held = without_sticking(evidence, held, start)
    if evidence is not whole:
        start = with_friction_width(evidence, shaped(evidence, start.model))
    task.progress("looking for contacts")
    contacts = Contacts.find(evidence, held, start)
    evidence, held = contacts.left_out(evidence), contacts.left_out_of_test(held)
    if contacts.pulses:
        start = with_friction_width(evidence, shaped(evidence, start.model))
    return Stage(
        evidence=evidence,
        held=held,
        narrow=narrower(evidence, task.train),
        loop=loop,
        contacts=contacts,
        start=start,
        fitted=start,
    )


def _variants(given: Model) -> tuple[Effect, ...]:
    """Every variant of every effect that is asked about in each round."""
    return tuple(v for effect in candidates(given) for v in effect.variants(given.robot))


def _settle(stage: Stage, task: DiagnosisTask) -> tuple[Stage, Path]:
    """Drop what is superfluous and withdraw what does harm; then go on with what is left.

    Held-out data that withdraw an effect choose what comes in its place, and judge it: they are
    asked a few times at most, and never about what is indistinguishable from what they withdrew.
    """
    withdrawn: tuple[Withdrawn, ...] = ()
    most = stage.evidence.criteria.search.withdrawals
    for looks in range(1, most + 2):
        many = len(stage.found)
        stage, path = _pruned(stage, task)
        withdrawn = (*withdrawn, *path.withdrawn)
        if len(path.found) < many:
            refused = dict(stage.refused)
            for one in path.withdrawn:
                refused |= one.refusals
            stage = rank_stage(replace(stage, refused=refused), task)
        wider = extend(stage, task) if path.withdrawn and looks <= most else stage
        if wider.found == stage.found:
            return wider, replace(path, withdrawn=withdrawn, looks=looks)
        stage = wider
    raise AssertionError("the last time nothing is added")


def _pruned(stage: Stage, task: DiagnosisTask) -> tuple[Stage, Path]:
    """Drop what is superfluous, confirm contacts, and withdraw what raises the held-out error."""
    evidence, start = stage.evidence, stage.start
    held = stage.judging
    kept = without_superfluous(evidence, held, stage.fitted, list(stage.found), task.progress)
    final = kept.final
    contacts = stage.contacts.confirmed(evidence, held, final)
    evidence, held = contacts.left_out(evidence), contacts.left_out_of_test(held)
    if contacts.pulses != stage.contacts.pulses:
        start = fit_evidence(evidence, start.model, start)
        final = fit_evidence(evidence, final.model, final)
    found = tuple(kept.found)
    if not stage.loop.runs:  # measured columns would credit a response with noise
        found = responses_in_place(evidence, start, final, found)
    path = path_of(evidence, held, start, final, found, task.progress)
    withdrawn = (*kept.unhelpful, *path.withdrawn)
    said = [one.payload for one in task.train.recordings]
    marks = [run.recording.payload for run in evidence.runs]
    if marks != said and not any(effect.is_payload for effect in path.final.model.effects):
        # Nobody knows any more who carries it: every fit is to recordings as the study has them.
        evidence = marked(evidence, said)
        start = fit_evidence(evidence, start.model, start)
        final = fit_evidence(evidence, path.final.model, path.final)
        path = path_of(evidence, held, start, final, path.found, task.progress)
        withdrawn = (*withdrawn, *path.withdrawn)
    path = replace(path, withdrawn=withdrawn)
    pruned = replace(
        stage,
        evidence=evidence,
        held=contacts.left_out_of_test(stage.held),
        contacts=contacts,
        start=start,
        fitted=path.final,
        found=path.found,
    )
    return pruned, path


def _judge(stage: Stage, path: Path, task: DiagnosisTask) -> Diagnosis:
    """Say what held-out data say of the path that the model has gone."""
    reached, held = stage.proposals >= task.most, stage.judging
    search = Search(
        evidence=stage.evidence,
        path=path,
        rounds=stage.rounds,
        disturbances=stage.contacts.disturbances(stage.evidence, held, stage.start),
        doubtful=tuple(stage.doubtful),
        notes=(*stage.loop.notes, *stage.notes),
        limit=task.most if reached and stage.rounds[-1].passing else None,
    )
    answer = assemble(search, task.train, task.test, held)
    if answer.noise_source == "unknown" and task.most:
        task.progress("looking for what the residual depends on")
        narrow = seen_alike(stage.narrow, stage.evidence, stage.doubtful)
        answer = doubted(answer, stage.evidence, narrow, path)
    if task.switches == "all":
        task.progress("switching effects on and off")
        answer = replace(answer, switches=switches_of(stage.evidence, held, path))
    if not _asks_for_laws(answer, task):
        return answer
    laws = LawSearch(evidence=stage.evidence, held=held, train=task.train, progress=task.progress)
    return replace(answer, proposals=proposals_of(laws, path))


def _asks_for_laws(answer: Diagnosis, task: DiagnosisTask) -> bool:
    """Whether laws are sought for what is left."""
    if task.propose == "never" or answer.impossible or not task.most:
        return False
    known = answer.noise_source != "unknown" or answer.following_motion
    left = answer.verdict == "unexplained" and known and not answer.training_only
    # Where its limit ended the search, what the catalogue leaves is not known yet.
    return (bool(left) and answer.limit is None) or task.propose == "always"
