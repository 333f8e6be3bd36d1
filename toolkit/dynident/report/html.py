"""The report: one HTML file that opens anywhere, without a network."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path

import jinja2
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from dynident import files
from dynident.diagnose.diagnosis import Diagnosis, JointResult, ResidualMap
from dynident.diagnose.loop_run import QUANTITIES
from dynident.diagnose.validation import Unsimulated, Validation
from dynident.report import pictures
from dynident.report.content import after_name, ranked, seen, x_title
from dynident.report.diagnosis_tables import (
    absorbed_table,
    candidate_table,
    joint_table,
    provenance,
    remaining_table,
    step_table,
    versions,
)
from dynident.report.loop_page import LoopSection, loop_section
from dynident.tables import Table, number, percent

_TRACE_BYTES = 2_400_000
"""What all torque traces together may take in the page."""
_BYTES_PER_POINT = 54
"""Five lines of a torque picture, two single-precision numbers each, in base 64."""

_KINDS = {
    "follows": "nothing_missing",
    "no_nearer": "unexplained",
    "other_controller": "unexplained",
    "not_simulated": "unknown",
}
"""Class of the page by verdict: its colour."""


@dataclass(frozen=True)
class _JointMaps:
    """Residual maps of one joint, each with the name of its figure."""

    joint: str
    maps: tuple[tuple[str, ResidualMap], ...]


def report(
    found: Diagnosis | Validation,
    to: str | Path = "report.html",
    *,
    loop: Validation | Unsimulated | None = None,
    command: str = "",
) -> Path:
    """Write a diagnosis, or a validation in closed loop, as one self-contained HTML file.

    Parameters
    ----------
    found : Diagnosis or Validation
        As `diagnose` or `validate` returns it.
    to : str or Path
        The file to write; an old one is replaced in one step.
    loop : Validation, optional
        Of the diagnosis's final model: adds the section on the simulated loop. `Unsimulated` adds
        the reason why there is none.
    command : str, optional
        The command line that led to it, for the provenance.

    Returns
    -------
    Path of the file.

    Raises
    ------
    FileError
        If the folder is missing or may not be written; an old file is then untouched.
    """
    return files.write_text(to, page(found, loop=loop, command=command))


def page(
    found: Diagnosis | Validation,
    *,
    loop: Validation | Unsimulated | None = None,
    command: str = "",
) -> str:
    """Return the report as a string of HTML; see `report`."""
    if isinstance(found, Validation):
        return _validation_page(found, command)
    return _diagnosis_page(found, loop_section(loop), command)


def _diagnosis_page(diagnosis: Diagnosis, closed: LoopSection | None, command: str) -> str:
    joint_maps = _joint_maps(diagnosis)
    names = [f"torque-{i}" for i in range(len(diagnosis.traces))]
    points = max(16, min(3000, _TRACE_BYTES // _BYTES_PER_POINT // max(len(names), 1)))
    figures = {"waterfall": pictures.waterfall(diagnosis)}
    if ranked(diagnosis):
        figures["ranking"] = pictures.ranking(diagnosis)
    for name, trace in zip(names, diagnosis.traces, strict=True):
        figures[name] = pictures.torques(diagnosis, trace, points)
    for group in joint_maps:
        for name, one in group.maps:
            # The page has one legend for all of them.
            figures[name] = pictures.residual_map(diagnosis, one).update_layout(showlegend=False)
    figures |= dict(closed.figures) if closed else {}
    given_order = {joint.name: i for i, joint in enumerate(diagnosis.joints)}
    worst = _worst_joint(diagnosis)
    order = sorted(
        range(len(names)),
        key=lambda i: (diagnosis.traces[i].joint != worst, given_order[diagnosis.traces[i].joint]),
    )
    return _template("report.html").render(
        d=diagnosis,
        closed=closed,
        robot=diagnosis.after.model.robot.name,
        sure=diagnosis.verdict != "unexplained" and diagnosis.noise_source != "unknown",
        added=after_name(diagnosis) if diagnosis.steps else "",
        labels=[shlex.quote(step.effect.label) for step in diagnosis.steps],
        joints=joint_table(diagnosis),
        steps=step_table(diagnosis),
        torques=[(names[i], diagnosis.traces[i]) for i in order],
        thinned=any(len(trace.t) > points for trace in diagnosis.traces),
        joint_maps=joint_maps,
        candidates=candidate_table(diagnosis, ranked(diagnosis)),
        weaker=candidate_table(diagnosis, ranked(diagnosis, len(diagnosis.candidates))[10:]),
        remaining=remaining_table(diagnosis),
        absorbed=absorbed_table(diagnosis),
        parameters=diagnosis.after.tables(),
        given_parameters=diagnosis.before.tables() if diagnosis.steps else (),
        provenance=provenance(diagnosis, command),
        figures=_json(figures),
        plotly=Markup(get_plotlyjs()),
    )


def _validation_page(validation: Validation, command: str) -> str:
    closed = loop_section(validation)
    assert closed is not None
    closed = replace(closed, sentence="")  # the head of the page has it
    errors = zip(QUANTITIES, validation.error_table().rows[-1][1:], strict=False)
    used = tuple((s.file, s.sha256, s.filter) for s in validation.sources)
    return _template("validation.html").render(
        closed=closed,
        robot=validation.robot,
        kind=_KINDS[validation.verdict],
        mark="\u2713" if validation.verdict == "follows" else "?",
        sentence=validation.sentence,
        errors=list(errors) if validation.runs else [],
        provenance=(Table("Files", ("file", "SHA-256", "filter"), used), versions(command)),
        figures=_json(dict(closed.figures)),
        plotly=Markup(get_plotlyjs()),
    )


def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dynident.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"percent": percent, "number": number}
    environment.globals |= {"numeric": _numeric, "seen": seen, "x_title": x_title}
    return environment.get_template(name)


def _json(figures: dict[str, go.Figure]) -> Markup:
    # Plotly writes "<", ">" and "/" as escapes, so that no text can close the script element.
    pairs = (f"{json.dumps(name)}:{figure.to_json()}" for name, figure in figures.items())
    return Markup("{" + ",\n".join(pairs) + "}")


def _numeric(table: Table) -> list[bool]:
    """Which columns hold numbers, and are set flush right."""
    return [
        any(row[i] for row in table.rows)
        and all(not row[i] or row[i][0] in "-+.0123456789" for row in table.rows)
        for i in range(len(table.columns))
    ]


def _worst_joint(diagnosis: Diagnosis) -> str:
    """The joint to show first: where something was added, or where the given model fails most."""
    first = diagnosis.best

    def badness(joint: JointResult) -> tuple[bool, float]:
        named = first is not None and first.effect.joint == joint.name
        ratio = joint.ratio_before
        return named, joint.error_before if ratio is None else ratio

    return max(diagnosis.joints, key=badness).name if diagnosis.joints else ""


def _joint_maps(diagnosis: Diagnosis) -> tuple[_JointMaps, ...]:
    worst = _worst_joint(diagnosis)
    joints = sorted(diagnosis.joints, key=lambda joint: joint.name != worst)
    numbered = [(f"map-{i}", one) for i, one in enumerate(diagnosis.maps)]
    groups = (
        _JointMaps(joint.name, tuple(pair for pair in numbered if pair[1].joint == joint.name))
        for joint in joints
    )
    return tuple(group for group in groups if group.maps)
