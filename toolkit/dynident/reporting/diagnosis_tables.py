"""Tables of the report that the diagnosis itself does not have."""

from __future__ import annotations

import hashlib
import platform
import re
from collections import Counter
from dataclasses import replace
from datetime import datetime
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from dynident import files
from dynident.batch import evaluations
from dynident.closed_loop import loop_evaluations
from dynident.diagnosis.details import Candidate, Step, gain_notes, step_notes
from dynident.diagnosis.effect_groups import hidden_effects
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.result import Diagnosis
from dynident.reporting.content import first_set
from dynident.reporting.joint_states import states
from dynident.tables import Table, number, p_value, percent, points


def joint_table(diagnosis: Diagnosis) -> Table:
    """As `Diagnosis.joint_table`, the noise also in its unit, and in words how each joint does."""
    given, after = diagnosis.joint_table(), bool(diagnosis.steps)
    known = diagnosis.noise_source != "unknown"
    words = {one.joint.name: one.words for one in states(diagnosis)}
    rows = []
    for joint in diagnosis.joints:
        unit, noise = joint.torque_unit, joint.noise_rms
        ratios = (joint.ratio_before, *([joint.ratio_after] if after else []))
        judged = (percent(joint.noise_share), *(number(ratio, 3) for ratio in ratios))
        size = "-" if noise is None else f"{number(noise, 3)} {unit}"
        rows.append(
            (
                joint.name,
                percent(joint.error_before),
                *([percent(joint.error_after)] if after else []),
                *(judged if known else ()),
                f"{number(joint.torque_rms, 3)} {unit}",
                *((size,) if known else ()),
                words[joint.name],
            )
        )
    overall = diagnosis.test_error
    errors = (percent(overall.before), *([percent(overall.after)] if after else []))
    floor = (percent(overall.noise_floor),) if known else ()
    ratio = (" as given", " after") if after else ("",)
    columns = (
        "joint",
        *(("error as given", "error after") if after else ("error",)),
        *(("noise floor", *(f"systematic / noise{when}" for when in ratio)) if known else ()),
        "torque rms",
        *(("noise rms",) if known else ()),
        "how it does",
    )
    last = ("all joints", *errors, *floor)
    rows.append((*last, *[""] * (len(columns) - len(last))))
    return Table(given.title, columns, tuple(rows), given.notes)


def step_table(diagnosis: Diagnosis) -> Table:
    """Effects added, with their laws and values."""
    rows = tuple(
        (
            step.effect.title,
            step.effect.formula,
            _values(diagnosis, step),
            percent(step.test_error_before),
            percent(step.test_error_after),
            step.fall_in_words,
            p_value(step.p_value),
            ", ".join(effect.title for effect in step.indistinguishable) or "nothing",
        )
        for step in diagnosis.steps
    )
    columns = (
        "effect added",
        "torque",
        "values when added",
        "error before",
        "error after",
        "fall, points",
        "p",
        "cannot be told from",
    )
    return Table("Effects added, in order", columns, rows, step_notes(diagnosis.steps))


def _values(diagnosis: Diagnosis, step: Step) -> str:
    robot = diagnosis.after.model.robot
    linear = zip(step.effect.parameters(robot), step.values, strict=True)
    shapes = zip(step.effect.shape_parameters(robot), step.effect.shape, strict=True)
    return ", ".join(f"{p.name} = {number(x)} {p.unit}" for p, x in (*linear, *shapes))


def proposal_table(proposal: Proposal, diagnosis: Diagnosis) -> Table:
    """Parameters of a proposed law."""
    rows = proposal.rows(diagnosis.after.model.robot)
    return Table("Its parameters", ("parameter", "value", "sigma", "unit"), rows)


def candidate_table(diagnosis: Diagnosis, shown: tuple[Candidate, ...]) -> Table:
    """Candidates, those that cannot be told from the first effect marked."""
    bracketed = first_set(diagnosis)
    added = {step.effect.label for step in diagnosis.steps}
    rows = tuple(
        (
            ("\u2503 " if c.effect.label in bracketed else "") + c.effect.title,
            p_value(c.p_value),
            points(c.test_gain),
            f"{c.finding}; added" if c.effect.label in added else c.finding,
        )
        for c in shown
    )
    columns = ("effect", "p", "gain, points", "finding")
    told = ("\u2503 These cannot be told apart with this data.",) if bracketed else ()
    notes = (*told, *gain_notes(shown))
    return Table("Candidates, tried on the model as given", columns, rows, notes)


def remaining_table(diagnosis: Diagnosis) -> Table:
    """Candidates on the final model."""
    final = replace(diagnosis, candidates=diagnosis.remaining).candidate_table()
    return replace(final, title="Candidates, tried on the final model", notes=())


def not_identifiable_table(diagnosis: Diagnosis) -> Table:
    """Effects that this data cannot show, and what would."""
    found = hidden_effects(diagnosis.candidates, len(diagnosis.joints))
    rows = tuple((one.title, one.remark) for one in found)
    return Table("Effects that are not identifiable", ("effect", "what would show it"), rows)


def provenance(diagnosis: Diagnosis, command: str, study: Path | None) -> tuple[Table, ...]:
    """Files, versions and changed criteria that a diagnosis rests on.

    Parameters
    ----------
    diagnosis : the diagnosis.
    command : the command line that led to it; may be empty.
    study : the study file; None where there is none.

    Returns
    -------
    A table each; that of the criteria has no rows where nothing was changed.
    """
    description = diagnosis.after.model.robot.description
    rows = []
    if study is not None and study.is_file():
        digest = files.sha256(study)
        rows.append((str(study), "study", digest, ""))
    if description is not None:
        digest = hashlib.sha256(description.text.encode()).hexdigest()
        rows.append((description.path, "robot description", digest, ""))
    used = (("training", diagnosis.after.sources), ("test", diagnosis.test_sources))
    # A file that is used in parts stands here once.
    parts: dict[tuple[str, str, str], Counter[str]] = {}
    for use, sources in used:
        for s in sources:
            parts.setdefault((s.file, s.sha256, s.filter), Counter())[use] += 1
    for (file, digest, settings), uses in parts.items():
        words = (f"{use} ({n} parts)" if n > 1 else use for use, n in uses.items())
        rows.append((file, ", ".join(words), digest, settings))
    columns = ("file", "used as", "SHA-256", "filter")
    changed = tuple(one.cells for one in diagnosis.criteria.changed)
    names = ("criterion", "value", "default")
    return (
        Table("Files", columns, tuple(rows)),
        versions(command),
        Table("Criteria that are not the defaults", names, changed),
    )


def versions(command: str) -> Table:
    """When and with what the page was made; the command line where there was one."""
    made = [
        ("written", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M:%S %z")),
        *([("command", command)] if command else []),
        ("dynident", _version("dynident")),
        ("Python", f"{platform.python_version()} on {platform.platform()}"),
    ]
    if used := evaluations():
        made.append(("equations of motion", "; ".join(map(str, used))))
    if used := loop_evaluations():
        made.append(("closed loops", "; ".join(map(str, used))))
    packages = (f"{package} {_version(package)}" for package in _dependencies())
    made.append(("with", ", ".join(packages)))
    return Table("Made", ("what", "value"), tuple(made))


def _dependencies() -> list[str]:
    """Packages that dynident itself asks for, without those of its extras."""
    try:
        wanted = requires("dynident") or []
    except PackageNotFoundError:
        return []
    always = [line for line in wanted if "extra ==" not in line]
    return sorted(re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in always)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
