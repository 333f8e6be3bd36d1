"""The verb `check_wiring`: recordings against the robot that they are said to be of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.criteria import DEFAULTS, WiringCriteria
from dynident.errors import without_warnings
from dynident.fitting.reversals.standing_joints import without_stops
from dynident.model import Model
from dynident.recording import Dataset
from dynident.threads import single_threaded
from dynident.wiring.assignment import DEGREE, MILLI, Assignment
from dynident.wiring.described_torque import moves_as_described
from dynident.wiring.fault import Fault, FaultKind
from dynident.wiring.fault_words import IN_COLUMNS, column_lines, faults_of
from dynident.wiring.gear_ratios import turns_too_far
from dynident.wiring.hypothesis_search import SearchResult, is_better_by_far, search
from dynident.wiring.mounting import mounting
from dynident.wiring.position_filter import unsuitable_position_filter
from dynident.wiring.regressions.wiring_regression import WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows, rows_of
from dynident.wiring.same_data import shared_recordings, twice_recorded
from dynident.wiring.stated_period import wrong_periods

_SMALL_UNITS: dict[str, tuple[FaultKind, str, float, str]] = {
    "revolute": ("degrees", "degrees", DEGREE, "gear"),
    "prismatic": ("millimetres", "mm", MILLI, "screw or a rack"),
}
"""What a position that is too large may be in, with its factor, and what may be in between."""


@single_threaded
def check_wiring(
    model: Model,
    train: Dataset,
    test: Dataset | None = None,
    criteria: WiringCriteria = DEFAULTS.wiring,
) -> tuple[Fault, ...]:
    """Look for columns and data that are not what the study says they are.

    Parameters
    ----------
    model : of which the robot counts, and for the filter what its effects say of an instant.
    train : recordings to fit.
    test : recordings to judge by, which must be others.
    criteria : by how much another assignment must win.

    Returns
    -------
    Faults, the surest first; empty where nothing contradicts what is said.

    Raises
    ------
    RecordingError
        If a recording does not suit its filter.
    """
    test = test or Dataset(())
    every = Dataset((*train.recordings, *test.recordings), train.filter)
    found = [
        *twice_recorded(train, criteria),
        *shared_recordings(train, test, criteria),
        *wrong_periods(every, criteria),
    ]
    if any(fault.kind == "one_source" for fault in found):
        return tuple(found)  # every assignment of a column that is not there fits badly
    rows = rows_of(_but_stops(model, train), criteria.rows, criteria.independent_hz)
    model, result, mounted = _searched(model, rows, criteria)
    named = (*mounted, *faults_of(model, result, train.recordings[0]))
    far = _out_of_range(model, rows, result, train, criteria)
    faults = (*found, *named, *far)
    # Where a column is not what it is called, no filter makes it so.
    slowest = min(one.rate_hz for one in every.recordings)
    return faults or unsuitable_position_filter(model, train, slowest, criteria)


def _searched(
    model: Model, rows: WiringRows, criteria: WiringCriteria
) -> tuple[Model, SearchResult, tuple[Fault, ...]]:
    """Search the columns, and again under another gravity if that suits them far better.

    A base that is mounted otherwise may look like columns that are not what they are called, and
    these like another mounting: what leaves less by far is taken, and columns if neither does.
    """
    result = search(model, rows, criteria)
    recorded = Assignment.as_recorded(model.robot.n)
    for now in (recorded, result.assignment) if result.accepted else (recorded,):
        found = mounting(model, rows, now, criteria)
        if found is None:
            continue
        other = search(found.model, rows, criteria)
        better = is_better_by_far(other.fit, result.fit, rows, criteria)
        if better and found.suits(other.fit):
            # A base that is tilted a little is no fault of the study, and columns none of it.
            faults = (found.fault,) if found.turn >= criteria.least_turn else ()
            return found.model, other, faults
    return model, result, ()


def _but_stops(model: Model, train: Dataset) -> Dataset:
    """Recordings without the rows around stops: every joint has dry friction in these fits."""
    once = tuple(one.replace(period=None) for one in train.recordings)
    with without_warnings():
        return without_stops(
            Model(model.robot) + "coulomb_friction", replace(train, recordings=once)
        )


def _weighs_as_described(model: Model, rows: WiringRows, result: SearchResult, joint: int) -> bool:
    """Whether the mass that a slide moves, by its force, is about that of the description."""
    regression = WiringRegression.of(model, rows.moved(result.assignment.change))
    return moves_as_described(model, regression, result.fit.inertia, (joint,))


def _out_of_range(
    model: Model, rows: WiringRows, result: SearchResult, train: Dataset, criteria: WiringCriteria
) -> tuple[Fault, ...]:
    """Joints that still turn farther than they can, of which the torques tell nothing."""
    now, robot = result.assignment, model.robot
    found = []
    for j, name in enumerate(robot.names):
        if not turns_too_far(model, rows, now, j, criteria):
            continue
        if robot.kinds[j] == "prismatic" and _weighs_as_described(model, rows, result, j):
            continue  # its limits are narrower than it is
        travel = float(np.ptp(rows.q[:, now.position_of[j]])) * abs(float(now.position_scale[j]))
        limits = robot.joints[j]
        room = limits.upper - limits.lower
        unit = robot.units[j]
        kind, small, factor, gear = _SMALL_UNITS[robot.kinds[j]]
        limit = f", and its limits leave {room:.3g} {unit}" if np.isfinite(room) else ""
        mended = now.positions_scaled(factor, j)
        found.append(
            Fault(
                kind=kind,
                joints=(name,),
                what=f"q.{name}: in {small}, not {unit}, or on the motor side of a {gear}",
                evidence=f"it travels {travel:.4g} {unit}{limit}, which the torques do not tell "
                "apart",
                mend=column_lines(mended, train.recordings[0]),
                where=f"If in {small}, {IN_COLUMNS[0].lower()}{IN_COLUMNS[1:]}",
            )
        )
    return tuple(found)
