"""The verb `fit`: from a model and recordings to an `Estimate`, by whichever estimator."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import ClassVar, Protocol

from dynident.arguments import checked
from dynident.clusters import Cluster, working_on
from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import LeastSquares
from dynident.fitting.reversals.misplaced_reversals import fitted_without, misplaced_note
from dynident.fitting.reversals.standing_joints import (
    standing_in,
    standing_note,
    too_wide_note,
    without_stops,
)
from dynident.fitting.reversals.unsuited_width import with_unsuited_width
from dynident.fitting.row_objective import refine_shapes, shaped_effects
from dynident.fitting.uncertainty.granted_effects import with_granted_effects
from dynident.fitting.uncertainty.lack_of_fit import lack_of_fit
from dynident.fitting.uncertainty.shape_errors import with_shape_errors
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.threads import single_threaded


class Method(Protocol):
    """An estimator: a frozen dataclass of its settings, that fits a model to recordings.

    A new one is a class with these two; `fit` and the command line know no others by their kind,
    and `tests/fitting/test_estimator_contract.py` says what each keeps to.

    Attributes
    ----------
    name : in words, as `Estimate.method` begins.
    """

    name: ClassVar[str]

    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are fixed.

        Raises
        ------
        FitError
            If there is no recording, or the data cannot carry the model.
        RecordingError
            If a recording does not suit its filter.
        """
        ...


@checked
@single_threaded
def fit(
    model: Model,
    data: Dataset | Recording,
    method: Method | None = None,
    *,
    client: Cluster | None = None,
) -> Estimate:
    """Identify the parameters of a model.

    Shape parameters of effects are refined first, by variable projection; the linear parameters
    follow from the method. Rows around stops of joints that stand do not count, see
    `Recording.stops`: no data tell their dry friction. Nor do rows around reversals that the filter
    and the sampling put at another moment, where that would bias the estimate: which they are
    depends on the friction and the residual of a first fit, so that two models may count others.

    Parameters
    ----------
    model : the robot and its effects.
    data : recordings with their filter; a single recording takes the filter that suits it. Their
        joints are those of the robot by their names, in any order.
    method : an estimator: `LeastSquares`, `Constrained`, `IV`, `Regression`, or any other class
        with their `fit`; default: least squares, weighted per joint.
    client : of dask.distributed, whose workers make the passes of least squares over recordings:
        each recording is sent to one of them, once, and sums come back. What else a method does,
        and the refinement of shape parameters, is done here. Without it all is.

    Returns
    -------
    The estimate, of the model with its shape parameters as refined.

    Raises
    ------
    FitError
        If the data cannot carry the model, memory does not suffice, or the cluster fails.
    RecordingError
        If a recording does not suit its filter, or has not every joint of the robot.
    """
    try:
        dataset = Dataset.of(data, model.robot.names)
        with working_on(client):
            return _fitted(model, dataset, method or LeastSquares())
    except MemoryError:
        where = data.where if isinstance(data, Recording) else None
        remedy = "use fewer or shorter recordings, or a lower rate"
        raise FitError("out of memory", where, remedy) from None


def _fitted(model: Model, dataset: Dataset, method: Method) -> Estimate:
    dataset = without_stops(model, dataset)
    counted = dataset
    estimate, dataset = fitted_without(partial(_with_shapes, model, method=method), dataset)
    if not isinstance(method, LeastSquares):  # which widens its sigma by what speaks against it
        judged = lack_of_fit(estimate.model, dataset, estimate.values)
        said = (estimate.headline, judged.headline if judged is not None else "")
        estimate = replace(estimate, headline=" ".join(filter(None, said)))
    else:
        with suppress(FitError):  # of a wider model than was asked for
            estimate = with_granted_effects(estimate, lambda one: method.fit(one, dataset))
        if not estimate.headline:
            estimate = with_unsuited_width(estimate, dataset, method)
    notes = (
        standing_note(counted),
        too_wide_note(model, counted),
        misplaced_note(counted, dataset, "would bias the fit: these rows do not count in it"),
    )
    notes = (*estimate.notes, *filter(None, notes))
    return replace(estimate, notes=notes, standing=standing_in(counted))


def _with_shapes(model: Model, dataset: Dataset, method: Method) -> Estimate:
    if not shaped_effects(model):
        return method.fit(model, dataset)
    shaped = refine_shapes(model, dataset)
    estimate = method.fit(shaped.model, dataset)
    estimate = replace(estimate, status=f"{estimate.status}, {shaped.status}")
    again = isinstance(method, LeastSquares)
    return with_shape_errors(estimate, (lambda one: method.fit(one, dataset)) if again else None)
