"""Fits whose passes over recordings are made elsewhere: the same answer, or one line."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError
from typing import Any

import numpy as np
import pytest

import fleets
from dynident import Dataset, Estimate, Model, Recording, fit
from dynident.clusters import over_recordings, spread, working_on
from dynident.errors import FitError, RecordingError
from dynident.fitting import Constrained, LeastSquares, fit_fleet
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
MODELS = {
    "complete": ("viscous_friction", "coulomb_friction"),
    "rejected": ("viscous_friction",),
    "iterated": ("viscous_friction", "coulomb_friction", "load_friction"),
}


class Elsewhere:
    """A cluster without processes: what it is given and gives back has been through pickle."""

    def __init__(self) -> None:
        self.sent = 0
        self.started = 0

    def scatter(self, data: list[Any], /, **_: Any) -> list[Any]:
        self.sent += len(data)
        return [pickle.dumps(one) for one in data]

    def map(
        self, function: Callable[..., Any], /, *iterables: Iterable[Any], **_: Any
    ) -> list[Any]:
        found = []
        for functions, *arguments in zip(*iterables, strict=True):
            self.started += 1
            here = [pickle.loads(x) if isinstance(x, bytes) else x for x in arguments]
            here = pickle.loads(pickle.dumps(here))
            found.append(pickle.dumps(function(functions, *here)))
        return found

    def gather(self, futures: Any, /) -> Any:
        return pickle.loads(futures)


def model_of(effects: Iterable[str]) -> Model:
    found = Model(arm())
    for effect in effects:
        found = found + effect
    return found


@pytest.fixture(scope="module")
def runs() -> tuple[Recording, ...]:
    """Motions that repeat, of unlike lengths."""
    model = model_of(MODELS["complete"])
    truth = true_values(model, **FRICTION)
    return tuple(
        synthetic(
            model,
            truth,
            seed,
            rate_hz=250.0,
            duration=seconds,
            position_std=1e-5,
            torque_std=0.2,
        )
        for seed, seconds in enumerate((24.0, 16.0, 24.0))
    )


def same(there: Estimate, here: Estimate) -> None:
    np.testing.assert_allclose(there.values, here.values, rtol=1e-10)
    size = np.sqrt(np.diag(here.covariance))
    np.testing.assert_allclose(
        there.covariance, here.covariance, atol=1e-10 * np.outer(size, size).max(), rtol=1e-10
    )
    np.testing.assert_allclose(there.joint_errors, here.joint_errors, rtol=1e-10)
    assert (there.headline, there.notes, there.sigma_words, there.rows) == (
        here.headline,
        here.notes,
        here.sigma_words,
        here.rows,
    )
    assert there.sources == here.sources


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.slow
def test_a_cluster_of_two_processes_says_the_same(client, runs, kind) -> None:
    model, data = model_of(MODELS[kind]), Dataset(runs)
    here = fit(model, data)
    assert bool(here.headline) == (kind == "rejected")  # all passes are made
    same(fit(model, data, client=client), here)


def test_all_passes_of_least_squares_are_made_there_and_data_travel_once(runs) -> None:
    cluster, model = Elsewhere(), model_of(MODELS["rejected"])
    same(fit(model, Dataset(runs), client=cluster), fit(model, Dataset(runs)))
    assert cluster.sent == len(runs)
    # Factors, residuals, repetitions, scores, and noise of positions.
    assert cluster.started == 5 * len(runs)
    plain = Elsewhere()
    fit(model, Dataset(runs), LeastSquares(errors="independent"), client=plain)
    assert plain.started == len(runs)


def test_a_method_that_begins_with_least_squares_may_be_given_a_cluster(runs) -> None:
    cluster, model = Elsewhere(), model_of(MODELS["complete"])
    found = fit(model, Dataset(runs[:1]), Constrained(), client=cluster)
    same(found, fit(model, Dataset(runs[:1]), Constrained()))


def test_one_recording_and_no_cluster_afterwards(runs) -> None:
    cluster, model = Elsewhere(), model_of(MODELS["complete"])
    fit(model, runs[0], client=cluster)
    before = cluster.started
    fit(model, runs[0])
    assert before and cluster.started == before


def _refuse(recording: Recording, what: str) -> None:
    raise RecordingError(what, recording.where)


@pytest.mark.filterwarnings("default")
@pytest.mark.slow
def test_what_a_recording_lacks_comes_through(client, runs) -> None:
    short = runs[0].part(slice(0, 30))
    with pytest.raises(RecordingError) as here:
        fit(model_of(MODELS["complete"]), Dataset((*runs, short)))
    with pytest.raises(RecordingError) as there:
        fit(model_of(MODELS["complete"]), Dataset((*runs, short)), client=client)
    assert str(there.value) == str(here.value)


def test_errors_of_a_pass_are_not_the_clusters(runs) -> None:
    with working_on(Elsewhere()), pytest.raises(RecordingError, match="too strange"):
        list(over_recordings(runs, _refuse, "too strange"))


@pytest.mark.parametrize("method", ["scatter", "map", "gather"])
def test_a_cluster_that_fails_is_one_line(runs, monkeypatch, method) -> None:
    def fail(*_: Any, **__: Any) -> None:
        raise CancelledError("lost\nit all")

    cluster = Elsewhere()
    monkeypatch.setattr(cluster, method, fail)
    with pytest.raises(FitError, match=r"the cluster failed \(CancelledError: lost it all\)"):
        fit(model_of(MODELS["complete"]), Dataset(runs), client=cluster)


@pytest.mark.filterwarnings("default")
@pytest.mark.slow
def test_a_fleet_is_fitted_there_all_the_same(client) -> None:
    even, there = (fit_fleet(fleets.model(), fleets.robots(), client=one) for one in (None, client))
    for name, one in even.estimates.items():
        other: Estimate = there.estimates[name]
        np.testing.assert_allclose(other.values, one.values, rtol=1e-10)
        np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-10, atol=1e-14)
    assert [one.robot for one in there.comparisons] == [one.robot for one in even.comparisons]
    with pytest.raises(FitError, match="robot 'bob': no recording"):
        fit_fleet(fleets.model(), {**fleets.robots(), "bob": Dataset(())}, client=client)


@pytest.mark.filterwarnings("default")
@pytest.mark.slow
def test_a_worker_that_dies_is_one_line(client) -> None:
    with pytest.raises(FitError, match=r"the cluster failed \(\w+: ") as caught:
        list(spread(client, os._exit, [1]))
    assert "\n" not in str(caught.value)
    assert list(spread(client, abs, [-1, 2])) == [1, 2]  # the others go on


@pytest.mark.filterwarnings("default")
@pytest.mark.slow
def test_a_closed_client_is_one_line(client, runs) -> None:
    closed = type(client)(client.cluster)
    closed.close()
    with pytest.raises(FitError, match=r"the cluster failed \(.*is its client open") as caught:
        fit(model_of(MODELS["complete"]), Dataset(runs), client=closed)
    assert "\n" not in str(caught.value)
