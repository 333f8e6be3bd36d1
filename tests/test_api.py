"""The public names: few, documented, plain Python modules and functions behind them."""

from __future__ import annotations

import copy
import inspect
import pickle
import pydoc
import subprocess
import sys
from types import ModuleType
from typing import Any

import cloudpickle
import numpy as np
import pytest

import dynident as di
from study_files import recording, true_model

NAMES = [name for name in dir(di) if not name.startswith("_")]
CORE = [name for name in NAMES if not isinstance(getattr(di, name), ModuleType)]
ROOMS = [name for name in NAMES if isinstance(getattr(di, name), ModuleType)]


def test_the_core_is_small_and_the_rest_is_one_level_down() -> None:
    assert 20 <= len(CORE) <= 32, CORE
    assert {"load", "fit", "compare", "diagnose", "check", "refit", "project", "report"} <= {*CORE}
    assert {"closed_loop", "constraints", "effects", "fitting", "regression"} <= {*ROOMS}
    assert not {*CORE} & {*ROOMS}
    assert sorted(vars(di)["__all__"]) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_every_name_has_help_worth_reading(name: str) -> None:
    found = getattr(di, name)
    text = inspect.getdoc(found) or ""
    assert len(text.splitlines()[0]) > 20
    assert text.splitlines()[0] in pydoc.plain(pydoc.render_doc(f"dynident.{name}"))
    if inspect.isfunction(found):
        many = len(inspect.signature(found).parameters) > 2
        assert not many or "\nParameters\n---" in text


def test_the_package_itself_has_help() -> None:
    text = pydoc.plain(pydoc.render_doc(di))
    assert "import dynident as di" in text and "study.toml" in text


def test_arguments_are_checked_at_the_edge_and_nothing_welcome_is_refused() -> None:
    class Own:
        name = "my own estimator"

        def fit(self, model, dataset):
            return di.LeastSquares().fit(model, dataset)

    data, model = recording(0), true_model()
    found = di.fit(model, di.Dataset([data]), Own())  # pyright: ignore
    assert found.names == di.fit(model, data).names
    welcome: dict[str, Any] = {"cutoff_hz": np.float32(9), "rate_hz": np.int64(50)}
    assert di.Filter(**welcome).rate_hz == 50
    with pytest.raises(TypeError, match="method is the class Own itself"):
        di.fit(model, data, Own)  # pyright: ignore
    assert str(inspect.signature(di.fit)).startswith("(model: 'Model', data:")
    assert pickle.loads(pickle.dumps(di.Filter(cutoff_hz=9.0))) == di.Filter(cutoff_hz=9.0)


def test_a_name_may_be_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """The module is a plain one: what is assigned to it is what it has."""
    assert type(di) is ModuleType
    monkeypatch.setattr(di, "fit", "another")
    assert di.fit == "another"
    monkeypatch.undo()
    assert callable(di.fit)


def test_rooms_are_packages_and_verbs_are_functions() -> None:
    """However they are imported, and in whichever order."""
    lines = (
        "import dynident.fitting as f, dynident as di",
        "assert f.__path__ and callable(di.fit)",
        "import dynident.study, dynident.reporting.html",
        "assert callable(di.load) and callable(di.report) and di.study.load is di.load",
        "from dynident import fit, fitting, check, consistency, diagnose",
        "assert fitting is f and callable(fit) and callable(check) and callable(diagnose)",
    )
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


def test_functions_that_use_the_package_travel() -> None:
    """To another process, as joblib and Dask send them."""

    def count() -> int:
        return len(di.catalogue())

    assert pickle.loads(cloudpickle.dumps(count))() == count()
    assert copy.copy(di.Model) is di.Model
    assert pickle.loads(pickle.dumps(di.fit)) is di.fit


def test_an_unknown_name_is_an_error() -> None:
    with pytest.raises(AttributeError, match="fitt"):
        di.fitt  # noqa: B018  # pyright: ignore
