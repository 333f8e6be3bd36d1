"""Studies without a fault are left alone, and faults in measured records are named."""

from __future__ import annotations

import os
import warnings
from functools import cache
from pathlib import Path

import pytest

import dynident as di
from dynident.errors import DynidentError
from dynident.wiring import check_wiring
from wiring_faults import broken, column_faults

ROOT = Path(__file__).parents[2]
DIAGNOSED = {"panda", "staubli_tx40"}
"""Of these `tests/problems` diagnoses the very study, and no fault is an answer there, too."""
STUDIES = sorted(
    path
    for path in (ROOT / "problems").glob("*/*.toml")
    if path.name.startswith("study") and "[[recordings]]" in path.read_text()
    if path.parent.name not in DIAGNOSED
)
FEW = {"torque_sign", "torque_signs", "torques_exchanged", "joints_exchanged", "degrees"}


@cache
def study(path: Path) -> di.Study:
    folder = Path(os.environ.get("DYNIDENT_DATA") or ROOT.parent / "shared" / "data")
    os.environ.setdefault("DYNIDENT_DATA", str(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return di.load(path)
        except DynidentError as error:
            if "no such data file" not in str(error):
                raise
            pytest.skip(str(error))


@pytest.mark.slow
@pytest.mark.parametrize("path", STUDIES, ids=lambda p: f"{p.parent.name}/{p.name}")
def test_healthy_studies_are_left_alone(path: Path) -> None:
    given = study(path)
    assert check_wiring(given.model, given.train, given.test, given.criteria.wiring) == ()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "every"), [("double_pendulum", 1), ("emps", 1), ("panda", 4)])
def test_faults_in_measured_records_are_named(name: str, every: int) -> None:
    given = study(ROOT / "problems" / name / "study.toml")
    names, named, total = given.robot.names, 0, 0
    revolute = [k for k, kind in enumerate(given.robot.kinds) if kind == "revolute"]
    for fault in list(column_faults(len(names)))[::every]:
        if fault.kind[0] not in FEW or (fault.kind[0] == "degrees" and not revolute):
            continue
        found = check_wiring(given.model, broken(given.train, fault.change))
        named += fault.is_named(found, names)
        total += 1
    assert total and named >= 0.95 * total
