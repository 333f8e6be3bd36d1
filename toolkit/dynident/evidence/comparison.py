"""Models side by side on held-out data."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from dynident.arguments import checked
from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.errors import FitError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import HeldOut, on_blocks, on_recordings
from dynident.evidence.maps import residual_maps
from dynident.evidence.runs import gather
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import sources_of
from dynident.fitting.reversals.misplaced_reversals import (
    misplaced_note,
    without_misplaced_reversals,
)
from dynident.fitting.reversals.standing_joints import standing_in, standing_note, without_stops
from dynident.fitting.row_objective import refine_shapes, shaped_effects
from dynident.model import Model
from dynident.recording import Dataset, Recording, filtered_alike
from dynident.recording.derivatives import ORDERS
from dynident.tables import Shown, Table, finite, mostly_noise, percent
from dynident.threads import single_threaded
from dynident.validation.replay import Judged, loop_of
from dynident.validation.validation_result import Loop, loop_table
from dynident.wiring import Fault, check_wiring


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(Shown):
    """Errors of several estimates on the same recordings.

    Attributes
    ----------
    names : of the estimates.
    models : theirs.
    results : what each misses.
    loops : each in the closed loop of the recordings, see `dynident.validate`; None where the
        controller or the reference is not known.
    criteria : by which noise was measured, and maps are read.
    wiring : columns and data that are not what the study says, where that was checked.
    standing : joints that stand, and how many of their rows therefore do not count; empty for
        none.
    misplaced : joints whose reversals filter and sampling put at another moment; empty for none.
    fitted_to : recordings that an estimate was fitted to: there is no held-out error of these.
    """

    names: tuple[str, ...]
    models: tuple[Model, ...]
    results: tuple[HeldOut, ...]
    loops: tuple[Loop, ...] = ()
    criteria: Criteria = DEFAULTS
    wiring: tuple[Fault, ...] = ()
    standing: str = ""
    misplaced: str = ""
    fitted_to: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `compare --json`."""
        robot, last = self.models[0].robot, self.results[-1]
        return {
            "noise": {"floor": last.floor},
            "wiring": [fault.to_dict() for fault in self.wiring],
            "models": [
                {
                    "name": name,
                    "effects": [effect.label for effect in model.effects],
                    "error": result.error,
                    "joints": [
                        {"name": joint, "error": finite(float(error))}
                        for joint, error in zip(robot.names, result.joint_errors, strict=True)
                    ],
                    **({} if loop is None else {"closed_loop": loop.brief_dict()}),
                }
                for name, model, result, loop in zip(
                    self.names, self.models, self.results, self._loops, strict=True
                )
            ],
            "joints": [
                {
                    "name": joint,
                    "noise_rms": None if last.noise_std is None else float(last.noise_std[j]),
                    "torque_rms": float(last.torque_rms[j]),
                    "torque_unit": robot.torque_units[j],
                }
                for j, joint in enumerate(robot.names)
            ],
        }

    @property
    def _seen_before(self) -> str:
        if not self.fitted_to:
            return ""
        return (
            f"Fitted to: {', '.join(self.fitted_to)}. Of what a fit has seen the error is smaller "
            "than of another motion."
        )

    @property
    def _loops(self) -> tuple[Loop, ...]:
        return self.loops or (None,) * len(self.names)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        # Noise of the positions comes through a model's columns: the floor is the last one's.
        robot, last = self.models[0].robot, self.results[-1]
        shares: list[float | None] = [None] * robot.n
        if last.noise_std is not None:
            pairs = zip(last.noise_std, last.torque_rms, strict=True)
            shares = [float(noise / rms) if rms > 0 else None for noise, rms in pairs]
        rows = [
            (joint, *(percent(float(r.joint_errors[j])) for r in self.results), percent(shares[j]))
            for j, joint in enumerate(robot.names)
        ]
        rows.append(("all", *(percent(r.error) for r in self.results), percent(last.floor)))
        notes = () if last.floor is not None else ("The noise floor is unknown.",)
        notes = (
            *notes,
            *mostly_noise(robot.names, shares),
            *filter(None, (self.standing, self.misplaced, self._seen_before)),
            *(f"Wiring: {fault.sentence}" for fault in self.wiring),
        )
        alone = len(self.names) == 1
        named = ("torque error",) if alone else (f"error, {name}" for name in self.names)
        columns = ("joint", *named, "noise floor")
        held_out = "" if self.fitted_to else "held-out "
        title = f"Relative torque error on {held_out}{last.what}"
        errors = Table(title, columns, tuple(rows), notes)
        loops = loop_table(self.names, self._loops, robot.names)
        if loops and alone:
            # One table: the simulated loop beside what the regression leaves.
            pairs = zip(errors.rows, loops.rows, strict=True)
            errors = replace(
                errors,
                columns=(*columns, *loops.columns[1:]),
                rows=tuple((*row, *more[1:]) for row, more in pairs),
                notes=(*notes, *loops.notes),
            )
            loops = None
        seen = residual_maps(self.models[-1], last, last, self.criteria)
        where = tuple((m.joint, m.against, m.sentence) for m in seen if m.sentence)
        first = (errors, loops) if loops else (errors,)
        title = "Where the model fails" if alone else f"Where '{self.names[-1]}' fails"
        if not where:
            return (*first, f"{title}: no simple shape stands out.")
        return (*first, Table(title, ("joint", "against", "what is seen"), where))


@checked
@single_threaded
def compare(
    estimates: Estimate | Mapping[str, Estimate],
    dataset: Dataset | Recording,
    controller: Controller | None = None,
    criteria: Criteria = DEFAULTS,
) -> Comparison:
    """Compare estimates with measurements that they were not fitted to.

    Parameters
    ----------
    estimates : one, or several by name.
    dataset : recordings, with their filter and, where nothing repeats, their noise; a single one
        takes the filter that suits it.
    controller : of the loop in which they were made: each estimate is simulated in it, too, where
        recordings have their reference.
    criteria : of the noise, of loops and of what residual maps show.

    Returns
    -------
    The error of each estimate, what exceeds the noise, and its simulation where there is one.

    Raises
    ------
    FitError
        If there is no estimate or no recording, or the estimates' robots have other joints.
    """
    named = {"model": estimates} if isinstance(estimates, Estimate) else dict(estimates)
    if not named:
        raise FitError("no estimate to compare", remedy="give one, or several by their names")
    dataset = Dataset.of(dataset, _joints_of(one.model for one in named.values()))
    if not dataset.recordings:
        remedy = 'mark some recordings use = "test"'
        raise FitError("no recording to compare with", remedy=remedy)
    standing = {joint for one in named.values() for joint in one.standing}
    dataset = without_stops([one.model for one in named.values()], dataset, standing)
    marked = dataset
    for estimate in named.values():
        marked = without_misplaced_reversals(estimate, marked)
    runs = gather(dataset, criteria.noise)
    results = []
    for estimate in named.values():
        evidence = Evidence(estimate.model, runs, criteria=criteria)
        results.append(on_recordings(evidence, estimate))
    return Comparison(
        names=tuple(named),
        models=tuple(e.model for e in named.values()),
        results=tuple(results),
        loops=tuple(
            loop_of(Judged.of(e), dataset, controller, criteria.loops) for e in named.values()
        ),
        criteria=criteria,
        standing=standing_note(dataset),
        misplaced=misplaced_note(dataset, marked, "is in this error, and not in the noise floor"),
        fitted_to=_fitted_to(named.values(), dataset),
    )


def _joints_of(models: Iterable[Model]) -> tuple[str, ...]:
    """Joints of models, which have the same ones in one order."""
    first, *others = (one.robot.names for one in models)
    for other in others:
        if other != first:
            what = f"joints {', '.join(other)} where another model has {', '.join(first)}"
            raise FitError(what, remedy="compare models of one robot, its joints in one order")
    return first


def _fitted_to(estimates: Collection[Estimate], dataset: Dataset) -> tuple[str, ...]:
    """Recordings that one of the estimates rests on: the same rows of a file, filtered alike.

    Whatever order of differences suits them together: alone they may have another one.
    """
    known = {source for one in estimates for source in one.sources if source.sha256}
    filters = [dataset.filter]
    if dataset.filter and dataset.filter.suited_order:
        filters = [replace(dataset.filter, suited_order=order) for order in ORDERS]
    every = [source for one in filters for source in sources_of(replace(dataset, filter=one))]
    return tuple(dict.fromkeys(source.file for source in every if source in known))


@single_threaded
def compare_models(
    models: Mapping[str, Model],
    train: Dataset | Recording,
    test: Dataset | Recording,
    controller: Controller | None = None,
    criteria: Criteria = DEFAULTS,
) -> Comparison:
    """Fit models as the diagnosis does, and compare them on data that they have not seen.

    Parameters
    ----------
    models : by name.
    train : recordings to fit, or a single one.
    test : recordings to judge by, or a single one; where it is empty, blocks of time of the
        training recordings are held out.
    controller : as in `compare`; the loops are those of the test recordings, or of the training
        recordings where there are none.
    criteria : of the noise, the fit, of loops and of what residual maps show.

    Returns
    -------
    As `compare`, of the fitted models.
    """
    joints = _joints_of(models.values())
    train, test = filtered_alike(*(Dataset.of(one, joints) for one in (train, test)))
    wiring = check_wiring(next(iter(models.values())), train, test, criteria.wiring)
    train = without_stops(models.values(), train)
    test = without_stops(models.values(), test, standing_in(train))
    runs = gather(train, criteria.noise)
    held = gather(test, criteria.noise) if len(test) else None
    results, compared, loops = [], [], []
    for model in models.values():
        if shaped_effects(model):
            model = refine_shapes(model, train).model
        evidence = Evidence(model, runs, criteria=criteria)
        fitted = fit_evidence(evidence, model)
        if held is None:
            results.append(on_blocks(evidence, fitted))
        else:
            judge = Evidence(model, held, criteria=criteria)
            results.append(on_recordings(judge, fitted))
        compared.append(model)
        judged, recorded = Judged(model, fitted.values), test if held else train
        loops.append(loop_of(judged, recorded, controller, criteria.loops))
    return Comparison(
        names=tuple(models),
        models=tuple(compared),
        results=tuple(results),
        loops=tuple(loops),
        criteria=criteria,
        wiring=wiring,
        standing=standing_note(test if held else train),
    )
