"""What several commands do with a study."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from dynident import files
from dynident.cli.group import CommandAnswer
from dynident.cli.output import progress
from dynident.errors import FileError, StudyError, UntrustedError
from dynident.tables import printable

if TYPE_CHECKING:
    from dynident.diagnosis import Diagnosis
    from dynident.diagnosis.extension.stage import AskedSwitches, Propose
    from dynident.effect_modules import Permission
    from dynident.effects import Law
    from dynident.evidence import Comparison
    from dynident.study import Study

_TRUST = "dynident.trust"
_PICTURES = (".png", ".svg", ".pdf")
TRUST = click.option(
    "--trust",
    is_flag=True,
    expose_value=False,
    callback=lambda context, _, given: context.meta.update({_TRUST: given}),
    help="Run the effect_modules that are named, which are code, without asking.",
)
_EFFECTS = "dynident.effects"


def with_effects(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command that takes an estimate the option that says where its effects come from."""
    option = click.option(
        "--effects",
        type=click.Path(path_type=Path),
        multiple=True,
        expose_value=False,
        callback=lambda context, _, given: context.meta.update({_EFFECTS: given}),
        help="A file of effects that an estimate has; may be repeated.",
    )
    return option(TRUST(command))


def import_named_effects() -> None:
    """Import the files of --effects, which may be asked for first; see `permitted`."""
    from dynident.effect_modules import import_files

    paths = click.get_current_context().meta[_EFFECTS]
    permitted(lambda modules: import_files(paths, "--effects", modules))


def _with_study(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command its study, and what a user says of the code in it."""
    return click.argument("study", type=click.Path(path_type=Path))(TRUST(command))


STUDY = _with_study


def require_places(study: Path, *paths: Path | None) -> None:
    """Refuse files that could not be written, before the work that they are to hold is done."""
    taken = {study.resolve(): "is the study itself"}
    for path in paths:
        if path is None:
            continue
        files.require_place(path)
        place = path.resolve()
        if place in taken:
            raise FileError(taken[place], str(path), "write to another file")
        taken[place] = "is named for two results"


def require_picture(path: Path | None) -> None:
    """Refuse a picture whose suffix is no format, before it is drawn."""
    if path is not None and path.suffix.lower() not in _PICTURES:
        remedy = f"end its name in {', '.join(_PICTURES)}"
        raise FileError("is no kind of picture that can be written", str(path), remedy)


def load_study(path: Path, *results: Path | None) -> Study:
    """Read a study and everything that it names, none of which a result may replace.

    It may ask before it runs code that the study names; see `permitted`.
    """
    from dynident.study import load

    study = permitted(lambda modules: load(path, modules=modules))
    held = {one.provenance.file: "a recording" for one in (study.train + study.test).recordings}
    if study.robot.description is not None:
        held[study.robot.description.path] = "the robot"
    places = {Path(file).resolve(): what for file, what in held.items()}
    for one in results:
        if one is not None and one.resolve() in places:
            what = f"is {places[one.resolve()]} of the study, which would be lost"
            raise FileError(what, str(one), "write to another file")
    return study


Loaded = TypeVar("Loaded")


def permitted(read: Callable[[Permission], Loaded]) -> Loaded:
    """Read a file that may name code, with the permission that the command was given.

    Without --trust, code that is not trusted yet is asked for on a terminal, and an error
    elsewhere. A yes is remembered, by the content that it was said of.
    """
    try:
        with progress("reading"):
            return read(permission_given())
    except UntrustedError as error:
        if not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise
        for path, _ in error.modules:
            click.echo(f"code, not trusted yet: {printable(path)}", err=True)
        if not click.confirm("run it, now and whenever it is the same?", err=True):
            raise
        sums = [one for _, one in error.modules]
    from dynident.effect_modules import remember

    remember(sums)
    with progress("reading"):
        return read("trusted")


def permission_given() -> Permission:
    """Return what may be run of a study's code, by the options of the command."""
    return "run" if click.get_current_context().meta.get(_TRUST) else "trusted"


def with_drives(study: Study, answer: CommandAnswer) -> CommandAnswer:
    """Put the gains of the drives, and loads, before what was found by them."""
    drives = study.drives
    if drives is None:
        return answer
    return replace(
        answer,
        content=lambda: {"drives": drives.to_dict(), **answer.content()},
        parts=lambda: (*drives.tables(), *answer.parts()),
    )


MOST = click.option(
    "--most",
    type=click.IntRange(min=0),
    help="Effects that are added at most, one at several joints counting once.",
)


PROPOSE = click.option(
    "--propose",
    type=click.Choice(["unexplained", "always", "never"]),
    is_flag=False,
    flag_value="always",
    default="unexplained",
    show_default=True,
    help="When to propose laws for what the catalogue leaves; --propose alone: always.",
)


def diagnosis_of(
    study: Study,
    most: int | None = None,
    propose: Propose = "unexplained",
    switches: AskedSwitches = "none",
) -> Diagnosis:
    """Run the search for what the model lacks.

    Parameters
    ----------
    study : the study.
    most : effects that are added at most; None for the usual.
    propose : when laws are proposed for what is left.
    switches : whether every choice among the effects is fitted, too, as a report shows them.

    Returns
    -------
    What the search found, torques in the unit in which they were recorded.
    """
    from dynident.diagnosis import diagnose as search
    from dynident.diagnosis.recorded_units import (
        begun_again,
        in_recorded_units,
        made_up_for,
        with_gains,
    )

    def searched(one: Study) -> Diagnosis:
        found = search(
            one.model,
            one.train,
            one.test,
            controller=one.controller,
            most=most,
            propose=propose,
            switches=switches,
            criteria=one.criteria,
            progress=show_progress,
        )
        return with_gains(found, one.drives, one.gain_problem)

    with progress("diagnosing") as show_progress:
        found = searched(study)
        wrong = made_up_for(found)
        if wrong and found.drives_anew is not None:
            study = study.with_drives(found.drives_anew)
            found = begun_again(searched(study), wrong)
    return in_recorded_units(found, study.drives)


def proposed_laws(diagnosis: Diagnosis, number: int, study: Path) -> tuple[Law, ...]:
    """Return the laws of the first proposals.

    Parameters
    ----------
    diagnosis : that made them.
    number : of the last one that is wanted, from 1.
    study : for the message.

    Raises
    ------
    StudyError
        If there are fewer.
    """
    if number > len(diagnosis.proposals):
        count = len(diagnosis.proposals)
        what = f"no proposal {number}: " + (f"there are {count}" if count else "none was made")
        raise StudyError(what, str(study), "`dynident explain --propose` shows them")
    return tuple(one.effect.made_of for one in diagnosis.proposals[:number])


def write_laws(path: Path, laws: tuple[Law, ...]) -> None:
    """Write a file of laws, which studies name; none where there is none."""
    import tomlkit

    from dynident.effects import laws_table

    if not laws:
        click.echo(f"no laws: nothing was proposed, and {path} is not written", err=True)
        return
    files.write_text(path, tomlkit.dumps({"laws": laws_table(laws)}))
    click.echo(f"laws: {path}", err=True)


def comparison_of(study: Study, additions: tuple[tuple[str, ...], ...]) -> Comparison:
    """Compare the study's model with those that have some effects more, one model an addition."""
    from dynident.effects import effects_of
    from dynident.evidence import compare_models

    models = {"study": study.model}
    for labels in additions:
        model = study.model
        for label in labels:
            for effect in effects_of(label, study.robot, study.model.laws):
                model = model if effect in model else model + effect
        models["+ " + " + ".join(labels)] = model
    with progress("comparing"):
        return compare_models(models, study.train, study.test, study.controller, study.criteria)


def write_report(study: Study, diagnosis: Diagnosis, to: Path | None) -> None:
    """Write the HTML report, with the final model's loop where the study knows its controller.

    Parameters
    ----------
    study : for its path, its controller and its recordings.
    diagnosis : what is reported.
    to : the file; None for no report.
    """
    if to is None:
        return
    from dynident.reporting import report as write
    from dynident.validation.replay import Judged, loop_of

    with progress("simulating"):
        recordings = study.test if len(study.test) else study.train
        loop = loop_of(
            Judged.of(diagnosis.after), recordings, study.controller, study.criteria.loops
        )
    write(diagnosis, to=to, loop=loop, command=command_line(), study=study.path)
    click.echo(f"report: {to}", err=True)


def command_line() -> str:
    """The command as it was typed, for the provenance of a report."""
    return " ".join(["dynident", *sys.argv[1:]])
