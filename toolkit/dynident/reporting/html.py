"""The report: one HTML file that opens anywhere, without a network."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import jinja2

from dynident import files
from dynident.arguments import checked
from dynident.diagnosis.dependence.residual_dependence import dependence_sentences, dependence_table
from dynident.diagnosis.detection_limits import limit_table
from dynident.diagnosis.result import Diagnosis
from dynident.evidence.maps import ResidualMap
from dynident.fitting.drive_gains import anew_tables
from dynident.reporting.content import after_name, left, ranked, recording_titles, seen
from dynident.reporting.diagnosis_tables import (
    candidate_table,
    joint_table,
    not_identifiable_table,
    proposal_table,
    provenance,
    remaining_table,
    step_table,
    versions,
)
from dynident.reporting.glossary import glossary, use_of
from dynident.reporting.headline import headline
from dynident.reporting.intervals import parameter_table, widening_after, widening_before
from dynident.reporting.joint_states import State, opened, states
from dynident.reporting.loop_page import LoopSection, loop_section
from dynident.reporting.next_steps import FIRST, THIS_REPORT, Advice, next_steps, of_study
from dynident.reporting.packing import compressed, packed
from dynident.reporting.pictures import diagnosis_pictures as pictures
from dynident.reporting.pictures.joint_errors import joint_errors
from dynident.reporting.switch_page import switch_section
from dynident.tables import Table, number, percent
from dynident.validation.loop_errors import QUANTITIES
from dynident.validation.validation_result import Unsimulated, Validation

_TRACE_BYTES = 600_000
"""What all torque traces together may take in the page."""
_BYTES_PER_POINT = 32
"""Five lines of a torque picture over one time, in single precision and base 64."""
_HASH = 64
"""Characters of a SHA-256."""
_MOST_POINTS = 6600
"""Six extremes for each pixel of a wide screen."""

_KINDS = {
    "follows": "nothing_missing",
    "no_nearer": "unexplained",
    "other_controller": "unexplained",
    "not_simulated": "unknown",
}
"""Class of the page by verdict: its colour."""


@dataclass(frozen=True, kw_only=True)
class _JointMaps:
    """Residual maps of one joint, each with the name of its figure.

    Attributes
    ----------
    joint, state, words : the joint and how it does, as `JointState` has it.
    shown : whether they are shown without asking.
    maps : name of the figure and what it shows.
    """

    joint: str
    state: State
    words: str
    shown: bool
    maps: tuple[tuple[str, ResidualMap], ...]


@checked
def report(
    found: Diagnosis | Validation,
    to: str | Path = "report.html",
    *,
    loop: Validation | Unsimulated | None = None,
    command: str = "",
    study: str | Path | None = None,
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
    study : str or Path, optional
        The study file, for the provenance.

    Returns
    -------
    Path of the file.

    Raises
    ------
    FileError
        If the folder is missing or may not be written; an old file is then untouched.
    """
    return files.write_text(to, page(found, loop=loop, command=command, study=study))


def page(
    found: Diagnosis | Validation,
    *,
    loop: Validation | Unsimulated | None = None,
    command: str = "",
    study: str | Path | None = None,
) -> str:
    """The report as a string of HTML.

    Parameters
    ----------
    found, loop, command, study : as in `report`.

    Returns
    -------
    The page, complete in itself.
    """
    if isinstance(found, Validation):
        return _validation_page(found, command)
    path = None if study is None else Path(study)
    tables = provenance(found, command, path)
    return _diagnosis_page(found, loop_section(loop), tables, path)


def _diagnosis_page(
    diagnosis: Diagnosis, closed: LoopSection | None, made: tuple[Table, ...], study: Path | None
) -> str:
    joint_maps = _joint_maps(diagnosis)
    switch = switch_section(diagnosis)
    names = [f"torque-{i}" for i in range(len(diagnosis.traces))]
    points = max(16, min(_MOST_POINTS, _TRACE_BYTES // _BYTES_PER_POINT // max(len(names), 1)))
    figures = {"waterfall": pictures.waterfall(diagnosis)}
    if switch is not None:
        figures["switch"] = switch.figure
    if len(diagnosis.joints) > 1:
        figures["joints"] = joint_errors(diagnosis)
    if any(one.test_gain is not None for one in ranked(diagnosis)):
        figures["ranking"] = pictures.ranking(diagnosis)
    for name, trace in zip(names, diagnosis.traces, strict=True):
        figures[name] = pictures.measured_and_predicted(diagnosis, trace, points)
    for group in joint_maps:
        for name, one in group.maps:
            # The page has one legend for all of them.
            figures[name] = pictures.residual_map(diagnosis, one).update_layout(showlegend=False)
    figures |= dict(closed.figures) if closed else {}
    laws = [f"law-{k}" for k, one in enumerate(diagnosis.proposals) if one.picture]
    for name, one in zip(laws, (p for p in diagnosis.proposals if p.picture), strict=True):
        figures[name] = pictures.law_picture(one)
    titles = recording_titles(
        [(f"{trace.joint}, {trace.recording}", trace.t) for trace in diagnosis.traces]
    )
    place = {one.joint.name: i for i, one in enumerate(states(diagnosis))}
    order = sorted(range(len(names)), key=lambda i: place[diagnosis.traces[i].joint])
    advice, terms = tuple(map(_read_here, next_steps(diagnosis))), glossary(diagnosis)
    advice = advice if study is None else of_study(advice, study)
    known = diagnosis.noise_source
    parameters = parameter_table(diagnosis.after, widening_after(diagnosis), known)
    bodies = diagnosis.after.model.base.rank
    return _template("report.html").render(
        d=diagnosis,
        head=headline(diagnosis),
        closed=closed,
        robot=diagnosis.after.model.robot.name,
        added=after_name(diagnosis) if diagnosis.steps else "",
        advice=advice[:FIRST],
        more_advice=advice[FIRST:],
        switch=switch,
        proposals=[
            (f"law-{k}", p, proposal_table(p, diagnosis)) for k, p in enumerate(diagnosis.proposals)
        ],
        depends=dependence_sentences(diagnosis.residual_dependence),
        dependence=dependence_table(diagnosis.residual_dependence),
        joints=joint_table(diagnosis),
        steps=step_table(diagnosis),
        torques=[(names[i], titles[i]) for i in order],
        thinned=any(len(trace.t) > points for trace in diagnosis.traces),
        joint_maps=joint_maps,
        candidates=candidate_table(diagnosis, ranked(diagnosis)),
        gains="ranking" in figures,
        weaker=candidate_table(diagnosis, ranked(diagnosis, len(diagnosis.candidates))[10:]),
        remaining=remaining_table(diagnosis),
        limits=limit_table(diagnosis.detection_limits) if diagnosis.detection_limits else None,
        not_identifiable=not_identifiable_table(diagnosis),
        drives=(
            *(diagnosis.drives.tables() if diagnosis.drives else ()),
            *anew_tables(diagnosis.drives, diagnosis.drives_anew),
        ),
        of_effects=replace(parameters, rows=parameters.rows[bodies:]),
        of_bodies=replace(parameters, rows=parameters.rows[:bodies], notes=()),
        fit_error=diagnosis.after.error_table(),
        given_parameters=parameter_table(diagnosis.before, widening_before(diagnosis), known)
        if diagnosis.steps
        else None,
        glossary=terms,
        anchors={term.word: term.anchor for term in terms},
        provenance=made,
        packed=packed(figures),
        data=compressed(json.dumps(switch.data)) if switch else "",
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
        packed=packed(dict(closed.figures)),
        data="",
    )


def rendered(name: str, **parts: object) -> str:
    """Fill a template of the page.

    Parameters
    ----------
    name : of the template.
    parts : what it shows, by the names that it has for them.
    """
    return _template(name).render(**parts)


def _read_here(advice: Advice) -> Advice:
    """The advice to somebody who reads the report."""
    return replace(advice, commands=tuple(one for one in advice.commands if one != THIS_REPORT))


def _template(name: str) -> jinja2.Template:
    return _environment().get_template(name)


@cache
def _environment() -> jinja2.Environment:
    """Where templates are found, and what they can use; it keeps those that it has compiled."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dynident.reporting"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": percent,
        "number": number,
        "capitalize_first": lambda words: words[:1].upper() + words[1:],
    }
    words = {"left": left, "seen": seen, "use_of": use_of}
    environment.globals |= {"numeric": _numeric, **words}
    return environment


def _numeric(table: Table) -> list[bool]:
    """Which columns hold numbers, and are set flush right; a hash is none."""
    return [
        any(row[i] for row in table.rows)
        and all(
            not row[i] or (row[i][0] in "<>-+.0123456789" and len(row[i]) < _HASH)
            for row in table.rows
        )
        for i in range(len(table.columns))
    ]


def _joint_maps(diagnosis: Diagnosis) -> tuple[_JointMaps, ...]:
    shown = opened(diagnosis)
    numbered = [(f"map-{i}", one) for i, one in enumerate(diagnosis.maps)]
    groups = (
        _JointMaps(
            joint=one.joint.name,
            state=one.state,
            words=one.words,
            shown=one.joint.name in shown,
            maps=tuple(pair for pair in numbered if pair[1].joint == one.joint.name),
        )
        for one in states(diagnosis)
    )
    return tuple(group for group in groups if group.maps)
