"""The commands that take a study and its recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from dynident import files
from dynident.cli.designs import NextRecording, next_recording
from dynident.cli.group import CommandAnswer, answered, commands
from dynident.cli.output import progress
from dynident.cli.work import (
    MOST,
    PROPOSE,
    STUDY,
    comparison_of,
    diagnosis_of,
    load_study,
    proposed_laws,
    require_picture,
    require_places,
    with_drives,
    write_laws,
    write_report,
)
from dynident.errors import FileError, StudyError

if TYPE_CHECKING:
    from dynident.diagnosis.extension.stage import Propose
    from dynident.effects import Law

_PATH = click.Path(path_type=Path)


@commands.command()
@STUDY
@answered
@MOST
@PROPOSE
@click.option("--report", type=_PATH, help="Also write this HTML report.")
@click.option("--laws", type=_PATH, help="Also write the proposals as a file of laws.")
@click.option("--design", "next_", type=_PATH, help="Also design the next recording, into DIR.")
def explain(
    study: Path,
    most: int | None,
    propose: Propose,
    report: Path | None,
    laws: Path | None,
    next_: Path | None,
) -> CommandAnswer:
    """Run the whole loop: compare, diagnose, add, refit, compare. The study stays as it is.

    Where no effect in the catalogue explains what is left, laws are proposed. `dynident add STUDY
    --proposal 1` writes one into the study; a file of them is named in another study by laws =
    "laws.toml", and then tried with the catalogue.

    With --design the recording is designed that tells apart what the data left open, else one that
    shows what they could not (see `dynident design`).

    Example: dynident explain study.toml --report report.html
    """
    from dynident.reporting.intervals import printed_parameters
    from dynident.reporting.next_steps import in_short, then_record

    if next_ is not None:
        files.require_folder(next_)
    require_places(study, report, laws)
    if laws is not None and laws.exists():
        raise FileError("is there already", str(laws), "name another file: laws may be in it")
    loaded = load_study(study, report, laws)
    diagnosis = diagnosis_of(loaded, most, propose, "none" if report is None else "all")
    loaded = loaded.with_drives(diagnosis.drives)
    following = NextRecording() if next_ is None else next_recording(diagnosis, loaded, next_)
    diagnosis = following.advised(diagnosis)
    write_report(loaded, diagnosis, report)
    if laws is not None:
        write_laws(laws, tuple(one.effect.made_of for one in diagnosis.proposals))
    answer = CommandAnswer(
        content=lambda: {
            **diagnosis.to_dict(),
            **({} if next_ is None else {"next_recording": following.content()}),
        },
        parts=lambda: (
            *diagnosis.tables(),
            *printed_parameters(diagnosis),
            *following.parts(),
            *in_short(diagnosis, study),
            *(then_record(diagnosis, study) if next_ is None else ()),
        ),
    )
    return with_drives(loaded, answer)


@commands.command()
@STUDY
@answered
@click.option("--to", type=_PATH, default=Path("recordings.png"), show_default=True)
def show(study: Path, to: Path) -> CommandAnswer:
    """Draw what a study has read: positions and torques, what is fitted and what is left out.

    The picture is a PNG, SVG or PDF file; rates, jitter, gaps, repetitions and what was not
    read are printed.

    Example: dynident show study.toml --to recordings.png
    """
    require_picture(to)
    require_places(study, to)
    loaded = load_study(study, to)
    from dynident.reporting.record_facts import record_facts, recordings_table, show_recordings

    with progress("drawing"):
        facts = record_facts(loaded)
        show_recordings(loaded, to)
    return CommandAnswer(
        content=lambda: {"picture": str(to), "recordings": [one.to_dict() for one in facts]},
        parts=lambda: (recordings_table(facts), f"The picture: {to}"),
    )


@commands.command()
@STUDY
@answered
@MOST
@PROPOSE
def diagnose(study: Path, most: int | None, propose: Propose) -> CommandAnswer:
    """Say where the model fails and which effects it lacks.

    Example: dynident diagnose study.toml --json
    """
    loaded = load_study(study)
    diagnosis = diagnosis_of(loaded, most, propose)
    loaded = loaded.with_drives(diagnosis.drives)
    answer = CommandAnswer(content=diagnosis.to_dict, parts=diagnosis.tables)
    return with_drives(loaded, answer)


@commands.command()
@STUDY
@answered
@click.option(
    "--with",
    "additions",
    multiple=True,
    metavar="EFFECT[@JOINT]",
    help="Compare with the model that has this effect too; may be repeated.",
)
def compare(study: Path, additions: tuple[str, ...]) -> CommandAnswer:
    """Compare the model with measurements that it was not fitted to.

    Example: dynident compare study.toml --with stribeck_friction@elbow
    """
    loaded = load_study(study)
    comparison = comparison_of(loaded, tuple((label,) for label in additions))
    drives = loaded.drives

    def content() -> dict[str, Any]:
        found = comparison.to_dict()
        if drives is not None:
            found["joints"] = [drives.recorded(one) for one in found["joints"]]
        return found

    return with_drives(loaded, CommandAnswer(content=content, parts=comparison.tables))


@commands.command()
@STUDY
@answered
def payload(study: Path) -> CommandAnswer:
    """Weigh the loads that recordings name: mass, centre, inertia, and if they are possible.

    A load has a name in the study, [loads.crate], and recordings that carry it say so, payload =
    "crate"; at least one recording is without it. What the table of the load leaves out is
    identified. Of currents (torque_unit = "A") the gains of the drives come with it.

    Where files have the columns of a wrench sensor, wrench.LINK.fx to wrench.LINK.tz in the frame
    of that link, the sensor weighs, and no torques are needed: whatever hangs on it in recordings
    that name no load, and the loads that others name.

    Exit status 1 if no rigid body can have the parameters of a load.

    Example: dynident payload study.toml
    """
    from dynident.fitting.wrench_sensor import fit_wrench
    from dynident.study import load_wrenches

    with progress("reading"):
        problems = load_wrenches(study)
    if problems:
        with progress("weighing"):
            sensed = tuple(fit_wrench(problem) for problem in problems)
        return CommandAnswer(
            content=lambda: {"wrench_sensors": [one.to_dict() for one in sensed]},
            parts=lambda: tuple(part for one in sensed for part in one.tables()),
            status=int(not all(one.is_consistent for one in sensed)),
        )
    loaded = load_study(study)
    drives = loaded.drives
    found = () if drives is None else tuple(one for one in drives.loads if not one.load.is_known)
    if drives is None or not found:
        remedy = (
            'add [loads.crate], and payload = "crate" to the [[recordings]] that carry it; or name '
            "the columns of a wrench sensor wrench.LINK.fx to wrench.LINK.tz"
        )
        raise StudyError("no recording names a load that is to be weighed", str(study), remedy)
    broken = any(one.is_whole and not one.is_consistent for one in found)
    return CommandAnswer(content=drives.to_dict, parts=drives.tables, status=int(broken))


_OTHER_FIGURES = (
    "explain may print other figures: beside the effects it adapts friction widths and shapes, and "
    "leaves out rows of contacts and of doubtful reversals."
)


@commands.command()
@STUDY
@click.argument("labels", metavar="EFFECT[@JOINT[:SOURCE]]...", nargs=-1)
@click.option("--proposal", type=click.IntRange(min=1), help="Write this proposed law.")
@answered
@MOST
def add(
    study: Path, labels: tuple[str, ...], proposal: int | None, most: int | None
) -> CommandAnswer:
    """Write effects into the study file; print the error before and after.

    A proposal is written with all that it was found beside: the effects that `explain` adds, but
    those that it is proposed instead of, and the proposals before it. It is sought again: with
    --most as `explain` was told.

    Example: dynident add study.toml stribeck_friction@elbow
    """
    from dynident.effects import effects_of
    from dynident.study import add_effects

    if bool(labels) == (proposal is not None):
        raise StudyError("name effects, or --proposal K", str(study), "see `dynident add --help`")
    if most is not None and proposal is None:
        raise StudyError("--most is of --proposal", str(study), "leave it out")
    loaded = load_study(study)
    files.require_place(study)
    laws: tuple[Law, ...] = ()
    if proposal is not None:
        diagnosis = diagnosis_of(loaded, most, propose="always")
        laws = proposed_laws(diagnosis, proposal, study)
        wider = replace(loaded.model, laws=(*loaded.model.laws, *laws))
        loaded = replace(loaded, model=wider)
        instead_of = diagnosis.proposals[proposal - 1].instead_of
        steps = (e.label for e in (s.effect for s in diagnosis.steps) if e.label not in instead_of)
        new = (one.effect.label for one in diagnosis.proposals[:proposal])
        labels = (*steps, *new)
    every = (one for label in labels for one in effects_of(label, loaded.robot, loaded.model.laws))
    fresh = tuple(dict.fromkeys(one for one in every if one not in loaded.model))
    if not fresh:
        raise StudyError(f"has {', '.join(labels)} already", str(study), "nothing was changed")
    if any(one.is_payload for one in fresh):
        recordings = (loaded.train + loaded.test).recordings
        if not any(r.payload for r in recordings):
            remedy = "set payload = true in the [[recordings]] that carry it"
            raise StudyError("no recording carries a payload", str(study), remedy)
    comparison = comparison_of(loaded, (labels,))
    add_effects(study, fresh, laws)
    return CommandAnswer(
        content=lambda: {"added": [one.label for one in fresh], **comparison.to_dict()},
        parts=lambda: (*comparison.tables()[:1], _OTHER_FIGURES, f"Written into {study}."),
    )


@commands.command()
@STUDY
@answered
@MOST
@click.option("--to", type=_PATH, default=Path("report.html"), show_default=True)
def report(study: Path, most: int | None, to: Path) -> CommandAnswer:
    """Diagnose, and write the HTML report.

    Example: dynident report study.toml --to report.html
    """
    require_places(study, to)
    loaded = load_study(study, to)
    diagnosis = diagnosis_of(loaded, most, switches="all")
    loaded = loaded.with_drives(diagnosis.drives)
    write_report(loaded, diagnosis, to)
    return CommandAnswer(
        content=lambda: {"report": str(to), **diagnosis.to_dict()}, lines=(diagnosis.sentence,)
    )
