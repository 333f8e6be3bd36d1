"""The command line of the blind study.

    python benchmarks/blind_study run --count 400 --seed 30000 --jobs 2
    python benchmarks/blind_study table
    python benchmarks/blind_study run --plant mujoco --seed 51000 --count 200 --filter all
    python benchmarks/blind_study report

`run` draws the cases of a seed, makes them, asks `dynident explain` about each, and appends what it
says to answers.jsonl; cases that are in there are not asked again. `table` compares the answers
with the truth; `report` prints what is right and what is claimed without reason. `--plant mujoco`
lets MuJoCo move robots of two to seven joints; `--plant laws` hides laws drawn at random, which no
catalogue has, on robots of either simulator, and `laws` prints what was proposed for them.
`--filter` writes a setting of [filter] into the studies, or each of six in turn; `--healthy-only`
hides nothing. What has no answer within `--limit` counts as a case without an answer; 0 waits for
as long as it takes.

With `--backend dask` joblib spreads the cases over the cluster whose scheduler `--scheduler` names
(its workers need this package and `benchmarks` on their PYTHONPATH, and the folder in common).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed, parallel_config

from blind_study.cases import SHARES, Case, draw
from blind_study.circumstances import draw_mujoco
from blind_study.filters import FILTERS
from blind_study.law_cases import draw_laws
from blind_study.law_table import show_laws
from blind_study.make import Size
from blind_study.report import print_report
from blind_study.table import show
from blind_study.worker import Place, answer, label

USUAL = Path("blind_study_results")
PLANTS: dict[str, Callable[[int, int, int], Sequence[Case]]] = {
    "own": draw,
    "mujoco": draw_mujoco,
    "laws": draw_laws,
}
"""Who moves the robots, and how their cases are drawn; of laws, either may."""


def main(arguments: list[str] | None = None) -> None:
    """Run the study, or show what it found."""
    parser = argparse.ArgumentParser(
        "blind_study",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True)
    run = commands.add_parser("run", help="make cases and ask about them")
    run.add_argument("--plant", choices=tuple(PLANTS), default="own", help="simulator")
    run.add_argument("--filter", choices=("all", *FILTERS), default="none", help="as users write")
    run.add_argument("--healthy-only", action="store_true", help="hide nothing in any robot")
    run.add_argument("--seed", type=int, default=0, help="development: 0 to 999")
    run.add_argument("--count", type=int, default=400, help="cases to draw")
    run.add_argument("--first", type=int, default=0, help="number of the first one")
    run.add_argument("--joints", type=int, nargs="*", choices=range(2, 8), help="only these robots")
    run.add_argument("--kinds", nargs="*", choices=(*SHARES, "law"), help="only these kinds")
    run.add_argument("--effects", nargs="*", help="only cases that hide one of these")
    run.add_argument("--numbers", type=int, nargs="*", help="only these cases")
    run.add_argument("--jobs", type=int, default=2)
    run.add_argument("--limit", type=_seconds, default=600.0, help="s that an answer may take")
    run.add_argument("--backend", default="loky", help="of joblib: loky, dask ...")
    run.add_argument("--scheduler", help="address of a Dask scheduler")
    run.add_argument("--data", choices=("keep", "drop"), default="drop", help="recordings")
    run.add_argument(
        "--rates", type=float, nargs=2, default=(500.0, 250.0), metavar=("TWO", "MANY")
    )
    run.add_argument("--runs", type=int, nargs=2, default=(4, 2), metavar=("TRAIN", "TEST"))
    table = commands.add_parser("table", help="compare the answers with the truth")
    report = commands.add_parser("report", help="what is right, and what is claimed without reason")
    laws = commands.add_parser("laws", help="what proposed laws are worth")
    for one in (run, table, report, laws):
        one.add_argument("--out", type=Path, default=USUAL, help="folder of the study")
    options = parser.parse_args(arguments)
    if options.command == "run":
        place = Place(options.out.resolve(), options.data, options.limit)
        size = Size(*options.rates, *options.runs)
        run_study(_chosen(options), place, size, options)
    if options.command == "laws" or (options.command == "run" and options.plant == "laws"):
        show_laws(options.out)
    elif options.command == "report" or (options.command == "run" and _is_wider(options)):
        print_report(options.out)
    else:
        show(options.out)


def _seconds(text: str) -> float:
    seconds = float(text)
    if not 0 <= seconds < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is no time limit: give seconds, or 0 for none")
    return seconds


def _is_wider(options: argparse.Namespace) -> bool:
    """Whether a run goes beyond what the table is about."""
    return options.plant != "own" or options.filter != "none" or options.healthy_only


def _chosen(options: argparse.Namespace) -> list[Case]:
    found = list(PLANTS[options.plant](options.seed, options.count, options.first))
    if options.healthy_only:
        found = [case.healthy() for case in found]
    for name in ("joints", "kinds", "effects", "numbers"):
        wanted = getattr(options, name)
        if wanted is not None:
            found = [case for case in found if _fits(case, name, set(wanted))]
    return found


def _fits(case: Case, name: str, wanted: set) -> bool:
    if name == "effects":
        return any(one.effect in wanted for one in case.hidden)
    return getattr(case, {"kinds": "kind", "numbers": "number"}.get(name, name)) in wanted


def answered(place: Place) -> set[str]:
    """Names of the cases that have an answer; those that were skipped are tried again."""
    if not place.answers.exists():
        return set()
    lines = (json.loads(line) for line in place.answers.read_text().splitlines() if line)
    return {line["name"] for line in lines if "skipped" not in line}


def run_study(cases: list[Case], place: Place, size: Size, options: argparse.Namespace) -> None:
    """Answer every case that has no answer yet; only this process writes them down."""
    place.folder.mkdir(parents=True, exist_ok=True)
    done = answered(place)
    filters = tuple(FILTERS) if options.filter == "all" else (options.filter,)
    wanted = [(case, [f for f in filters if label(case, f) not in done]) for case in cases]
    todo = [(case, left) for case, left in wanted if left]
    with _spread(options.backend, options.scheduler, options.jobs):
        stream = Parallel(return_as="generator_unordered")(
            delayed(answer)(case, place, size, left) for case, left in todo
        )
        with (
            place.answers.open("a") as handle,
            _progress(sum(len(left) for _, left in todo)) as progress,
        ):
            for answers in stream:
                assert answers is not None
                for said in answers:
                    handle.write(json.dumps(said) + "\n")
                    progress(said)
                handle.flush()


def _spread(backend: str, scheduler: str | None, jobs: int) -> Any:
    """Return the joblib context that says where cases are worked on."""
    if backend != "dask":
        return parallel_config(backend, n_jobs=jobs)
    from dask.distributed import Client  # pyright: ignore[reportMissingImports]

    Client(scheduler)  # joblib finds the client that was made last
    return parallel_config("dask")


@contextmanager
def _progress(total: int) -> Iterator:
    """A bar on a terminal; a line per case in a pipe."""
    if not sys.stderr.isatty():

        def line(said: dict[str, Any]) -> None:
            what = said.get("skipped") or said.get("error") or _summary(said["answer"])
            print(f"{said['name']}: {what} ({said.get('cpu_s', 0.0):.1f} s)", file=sys.stderr)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("cases", total=total)
        yield lambda said: bar.update(task, advance=1, description=said["name"])


def _summary(said: dict[str, Any]) -> str:
    added = [f"{s['effect']}@{s['joint']}" for s in said["steps"]]
    return f"{said['verdict']} {', '.join(added)}"
