"""The report: one HTML file that opens anywhere, without a network."""

from __future__ import annotations

import hashlib
import json
import platform
import shlex
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import jinja2
import plotly.graph_objects as go
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from dynident import files
from dynident.diagnose.diagnosis import Candidate, Diagnosis, JointResult, ResidualMap, Step
from dynident.report import pictures
from dynident.report.content import after_name, first_set, ranked, seen, x_title
from dynident.tables import Table, number, percent

_TRACE_BYTES = 2_400_000
"""What all torque traces together may take in the page."""
_BYTES_PER_POINT = 54
"""Five lines of a torque picture, two single-precision numbers each, in base 64."""


@dataclass(frozen=True)
class _JointMaps:
    """Residual maps of one joint, each with the name of its figure."""

    joint: str
    maps: tuple[tuple[str, ResidualMap], ...]


def report(diagnosis: Diagnosis, to: str | Path = "report.html", *, command: str = "") -> Path:
    """Write a diagnosis as one self-contained HTML file.

    Parameters
    ----------
    diagnosis : Diagnosis
        As `diagnose` returns it.
    to : str or Path
        The file to write; an old one is replaced in one step.
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
    return files.write_text(to, page(diagnosis, command=command))


def page(diagnosis: Diagnosis, *, command: str = "") -> str:
    """Return the report as a string of HTML; see `report`."""
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
    given_order = {joint.name: i for i, joint in enumerate(diagnosis.joints)}
    worst = _worst_joint(diagnosis)
    order = sorted(
        range(len(names)),
        key=lambda i: (diagnosis.traces[i].joint != worst, given_order[diagnosis.traces[i].joint]),
    )
    return _template().render(
        d=diagnosis,
        robot=diagnosis.after.model.robot.name,
        sure=diagnosis.verdict != "unexplained" and diagnosis.noise_source != "unknown",
        added=after_name(diagnosis) if diagnosis.steps else "",
        labels=[shlex.quote(step.effect.label) for step in diagnosis.steps],
        joints=_joint_table(diagnosis),
        steps=_step_table(diagnosis),
        torques=[(names[i], diagnosis.traces[i]) for i in order],
        thinned=any(len(trace.t) > points for trace in diagnosis.traces),
        joint_maps=joint_maps,
        candidates=_candidate_table(diagnosis, ranked(diagnosis)),
        weaker=_candidate_table(diagnosis, ranked(diagnosis, len(diagnosis.candidates))[10:]),
        remaining=_remaining_table(diagnosis),
        absorbed=_absorbed_table(diagnosis),
        parameters=diagnosis.after.tables(),
        given_parameters=diagnosis.before.tables() if diagnosis.steps else (),
        provenance=_provenance(diagnosis, command),
        figures=_json(figures),
        plotly=Markup(get_plotlyjs()),
    )


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dynident.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"percent": percent, "number": number}
    environment.globals |= {"numeric": _numeric, "seen": seen, "x_title": x_title}
    return environment.get_template("report.html")


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


def _joint_table(diagnosis: Diagnosis) -> Table:
    """As `Diagnosis.joint_table`, with every floor both as a part of the torque and in its unit."""
    given = diagnosis.joint_table()
    rows = []
    for joint in diagnosis.joints:
        noise = joint.noise_rms
        floor = noise / joint.torque_rms if noise is not None and joint.torque_rms else None
        rows.append(
            (
                joint.name,
                percent(joint.error_before),
                *([percent(joint.error_after)] if diagnosis.steps else []),
                percent(floor),
                number(joint.ratio_before, 3),
                *([number(joint.ratio_after, 3)] if diagnosis.steps else []),
                f"{number(joint.torque_rms, 3)} {joint.torque_unit}",
                "-" if noise is None else f"{number(noise, 3)} {joint.torque_unit}",
            )
        )
    overall = diagnosis.test_error
    rows.append(
        (
            "all joints",
            percent(overall.before),
            *([percent(overall.after)] if diagnosis.steps else []),
            percent(overall.noise_floor),
            *([""] * (4 if diagnosis.steps else 3)),
        )
    )
    columns = (
        "joint",
        *(("error as given", "error after") if diagnosis.steps else ("error",)),
        "noise floor",
        *(
            f"systematic / noise{when}"
            for when in ((" as given", " after") if diagnosis.steps else ("",))
        ),
        "torque rms",
        "noise rms",
    )
    return Table(given.title, columns, tuple(rows), given.notes)


def _step_table(diagnosis: Diagnosis) -> Table:
    rows = tuple(
        (
            step.effect.title,
            step.effect.law,
            _values(diagnosis, step),
            percent(step.test_error_before),
            percent(step.test_error_after),
            number(step.p_value, 2),
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
        "p",
        "cannot be told from",
    )
    return Table("Effects added, in order", columns, rows)


def _values(diagnosis: Diagnosis, step: Step) -> str:
    robot = diagnosis.after.model.robot
    linear = zip(step.effect.parameters(robot), step.values, strict=True)
    shapes = zip(step.effect.shape_parameters(robot), step.effect.shape, strict=True)
    return ", ".join(f"{p.name} = {number(x)} {p.unit}" for p, x in (*linear, *shapes))


def _candidate_table(diagnosis: Diagnosis, shown: tuple[Candidate, ...]) -> Table:
    bracketed = first_set(diagnosis)
    rows = tuple(
        (
            ("\u2503 " if c.effect.label in bracketed else "") + c.effect.title,
            c.status.replace("_", " "),
            number(c.p_value, 2),
            f"{100 * c.test_gain:.2f}",
            c.remark,
        )
        for c in shown
    )
    columns = ("effect", "status", "p", "gain, points", "remark")
    notes = ("\u2503 These cannot be told apart with this data.",) if bracketed else ()
    return Table("Candidates, tried on the model as given", columns, rows, notes)


def _remaining_table(diagnosis: Diagnosis) -> Table:
    final = replace(diagnosis, candidates=diagnosis.remaining).candidate_table()
    return replace(final, title="Candidates, tried on the final model", notes=())


def _absorbed_table(diagnosis: Diagnosis) -> Table:
    rows = tuple(
        (c.effect.title, c.remark or c.effect.advice)
        for c in diagnosis.candidates
        if c.status == "absorbed"
    )
    return Table("Absorbed effects", ("effect", "what would show it"), rows)


def _provenance(diagnosis: Diagnosis, command: str) -> tuple[Table, Table]:
    description = diagnosis.after.model.robot.description
    rows = []
    if description is not None:
        digest = hashlib.sha256(description.text.encode()).hexdigest()
        rows.append((description.path, "robot description", digest, ""))
    used = (("training", diagnosis.after.sources), ("test", diagnosis.test_sources))
    for use, sources in used:
        rows += [(s.file, use, s.sha256, s.filter) for s in sources]
    columns = ("file", "used as", "SHA-256", "filter")
    versions = [("Python", platform.python_version())]
    for package in ("dynident", "pin", "drake", "numpy", "scipy", "plotly"):
        versions.append(("pinocchio (pin)" if package == "pin" else package, _version(package)))
    if command:
        versions.append(("command", command))
    return Table("Files", columns, tuple(rows)), Table("Made with", ("what", ""), tuple(versions))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
