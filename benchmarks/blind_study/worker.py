"""One case from its drawing to the answer of `dynident explain`, in one process."""

from __future__ import annotations

import io
import json
import shutil
import time
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blind_study.cases import Case
from blind_study.filters import state
from blind_study.law_marks import marks
from blind_study.make import Size, make, unavailable
from blind_study.time_limit import TimeUp, time_limit
from blind_study.writing import write_truth
from dynident.errors import DynidentError
from dynident.threads import single_threaded


@dataclass(frozen=True)
class Place:
    """Where a study keeps what: the data, and the truth apart from it.

    Attributes
    ----------
    folder : of everything.
    data : "keep", or "drop" to delete a case's recordings once it is answered.
    limit_s : how long each answer may take; 0 for as long as it takes.
    """

    folder: Path
    data: str = "keep"
    limit_s: float = 0.0

    def data_of(self, case: Case) -> Path:
        return self.folder / "data" / case.name

    def truth_of(self, case: Case) -> Path:
        return self.folder / "truth" / f"{case.name}.json"

    @property
    def answers(self) -> Path:
        return self.folder / "answers.jsonl"


def label(case: Case, filter: str) -> str:
    """Name of an answer: that of its case, and of its setting of [filter] where it has one."""
    return case.name if filter == "none" else f"{case.name}:{filter}"


@single_threaded
def answer(
    case: Case, place: Place, size: Size, filters: Sequence[str] = ("none",)
) -> list[dict[str, Any]]:
    """Make a case, ask for an explanation as a user would, and return what was said.

    One answer a setting of [filter], all of the same recordings.
    """
    each = [_about(case, filter) for filter in filters]
    missing = unavailable(case)
    if missing:
        return [{**said, "skipped": f"no effect {missing} in the catalogue"} for said in each]
    folder = place.data_of(case)
    started = time.process_time()
    try:
        truth = make(case, folder, size)
    except DynidentError as error:
        return [{**said, "skipped": f"not simulated: {error}"} for said in each]
    write_truth(truth, place.truth_of(case))
    made = time.process_time() - started
    for said, filter in zip(each, filters, strict=True):
        if filter != "none":
            state(folder / "study.toml", filter, truth["rate_hz"])
        more = ("--propose",) if case.variant == "laws" else ()
        said |= {"made_s": made, **explain(folder / "study.toml", place.limit_s, more)}
        if more and "answer" in said:
            said["laws"] = marks(folder / "study.toml", truth["law"], said["answer"])
    if place.data == "drop":
        shutil.rmtree(folder)
    return each


def _about(case: Case, filter: str) -> dict[str, Any]:
    said = {"name": label(case, filter), "seed": case.seed, "number": case.number}
    return said if filter == "none" else {**said, "case": case.name, "filter": filter}


def explain(study: Path, limit_s: float = 0.0, more: Sequence[str] = ()) -> dict[str, Any]:
    """Run `dynident explain --json`; return its answer and its processor time.

    Parameters
    ----------
    study : the file.
    limit_s : where no answer has come within it (0: without limit), that is the error.
    more : options.
    """
    from dynident.cli import main

    out, err, status = io.StringIO(), io.StringIO(), 0
    started = time.process_time()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            with time_limit(limit_s):
                main(["explain", str(study), "--json", *more])
        except TimeUp:
            spent = time.process_time() - started
            return {"cpu_s": spent, "status": -1, "error": f"no answer within {limit_s:g} s"}
        except SystemExit as stop:
            status = int(stop.code or 0)
        except Exception as error:  # a traceback is an answer too: a wrong one
            status, message = -1, f"{type(error).__name__}: {error}"
            err.write(message)
    found: dict[str, Any] = {"cpu_s": time.process_time() - started, "status": status}
    if status == 0:
        return {**found, "answer": json.loads(out.getvalue())}
    return {**found, "error": err.getvalue().strip()[-500:]}
