"""The simulated loops of several models, beside what their regressions leave."""

from __future__ import annotations

from dynident.tables import Table, percent
from dynident.validation.loop_validation import Unsimulated, Validation

Loop = Validation | Unsimulated | None


def loop_columns(
    names: tuple[str, ...], loops: tuple[Loop, ...], joints: tuple[str, ...]
) -> Table | None:
    """Errors of torque and position of each model in closed loop; None where there is no loop."""
    if all(loop is None for loop in loops):
        return None
    alone = len(names) == 1
    columns = ["joint"]
    for name in names:
        prefix = "in loop" if alone else f"{name}"
        columns += [f"{prefix}: torque", f"{prefix}: position"]
    rows = []
    for j, joint in enumerate((*joints, "all")):
        cells = [joint]
        for loop in loops:
            if not isinstance(loop, Validation):
                cells += ["-", "-"]
                continue
            errors = loop.errors.overall if j == len(joints) else loop.errors.joints[:, j]
            cells += [percent(float(errors[3])), percent(float(errors[0]), 3)]
        rows.append(tuple(cells))
    return Table("Simulated in closed loop", tuple(columns), tuple(rows), _notes(names, loops))


def _notes(names: tuple[str, ...], loops: tuple[Loop, ...]) -> tuple[str, ...]:
    found = []
    for name, loop in zip(names, loops, strict=True):
        whose = "In loop" if len(names) == 1 else name
        if isinstance(loop, Unsimulated):
            found.append(f"{whose}: not simulated. {loop.reason}.")
        elif loop is not None:
            if loop.verdict != "follows":
                found.append(f"{whose}: {loop.sentence}")
            found += [f"{whose}: {one.name} left out: {one.reason}." for one in loop.skipped]
    return tuple(found)
