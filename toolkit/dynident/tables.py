"""A table of results, to be shown in a terminal, in a notebook or in the report."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, fields
from html import escape
from typing import Any

WIDTH = 110
"""Characters of a line where no terminal says how wide it is."""


@dataclass(frozen=True)
class Table:
    """Rows of text with a title, and notes in plain words below them.

    Attributes
    ----------
    title : above the table.
    columns : headings; columns whose cells are numbers are set flush right.
    rows : cells as they are to be read; where there are none, "none" stands in their place.
    notes : sentences that belong to the table.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def show(self) -> None:
        """Print the table to the terminal."""
        print_tables(self)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(c)}</th>" for c in self.columns)
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
            for row in self.rows
        )
        notes = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        title = escape(self.title)
        if not self.rows:
            return f"<p>{title}: none</p>{notes}"
        return f"<table><caption>{title}</caption><tr>{head}</tr>{body}</table>{notes}"

    def __str__(self) -> str:
        from rich.console import Console

        console = Console(width=WIDTH, color_system=None, force_terminal=False)
        with console.capture() as capture:
            _print(console, self)
        return capture.get()


def mostly_noise(joints: Sequence[str], shares: Sequence[float | None]) -> tuple[str, ...]:
    """Return a note on joints at whose torque a relative error means little; none as a rule.

    Parameters
    ----------
    joints : names.
    shares : noise over torque, root mean square, of each; None where the noise is not known.
    """
    pairs = zip(joints, shares, strict=True)
    names = [name for name, share in pairs if share is not None and share > MOSTLY_NOISE]
    if not names:
        return ()
    return (
        f"At {', '.join(names)} noise makes more than {percent(MOSTLY_NOISE, 0)} of the little "
        "torque there is: a relative error means little there.",
    )


MOSTLY_NOISE = 0.3
"""Share of noise in a joint's torque from which on a relative error means little."""


class Shown:
    """What is shown as tables and sentences: in a terminal, a notebook, a file of text."""

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        raise NotImplementedError

    def show(self) -> None:
        """Print the tables and sentences to the terminal."""
        print_tables(*self.tables())

    def summary(self) -> str:
        """The tables and sentences as text, which is what Python prints of it as well."""
        return "\n".join(str(part) for part in self.tables())

    def __repr__(self) -> str:
        # In place of all fields, arrays of residuals among them, which nobody can read.
        return self.summary()

    def _repr_html_(self) -> str:
        """Show the same in a notebook."""
        return "".join(
            f"<p>{escape(part)}</p>" if isinstance(part, str) else part._repr_html_()
            for part in self.tables()
        )


def printable(text: str) -> str:
    """Return a text without what a terminal would obey: control and bidirectional characters."""
    # Names of files, joints and columns come from anywhere; their letters may be of any script.
    hidden = (c for c in set(text) if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c != "\n")
    return text.translate({ord(c): f"\\u{ord(c):04x}" for c in hidden})


def print_tables(*tables: Table | str) -> None:
    """Print tables and sentences to standard output, one after another."""
    import sys

    from rich.console import Console

    class Terminal(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError  # for the command to handle; rich would end the process

    # A file, a pipe or a notebook has no width of its own: wide enough for every column. No colours
    # either: notebooks ask for them, but text reads the same wherever the page is shown.
    terminal = sys.stdout.isatty()
    console = Terminal(
        highlight=False,
        emoji=False,
        width=None if terminal else WIDTH,
        color_system="auto" if terminal else None,
        force_jupyter=False,
    )
    for table in tables:
        if isinstance(table, str):
            # What is to be typed is set in by four blanks, and not broken where a line ends.
            for line in printable(table).split("\n"):
                console.print(line, markup=False, soft_wrap=line.startswith("    "))
        else:
            _print(console, table)


def number(value: float | None, digits: int = 4) -> str:
    """A number in a table: `digits` significant ones, a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{value:.{digits}g}"


LEAST_P = 1e-3
"""p values below it are shown as being below it: their tails are nobody's knowledge."""


def p_value(value: float | None) -> str:
    """A p value in a table or a sentence; JSON has the number."""
    if value is not None and value < LEAST_P:
        return f"< {LEAST_P:g}"
    return number(value, 2)


def percent(value: float | None, digits: int = 2) -> str:
    """A fraction as a percentage with `digits` decimals, a dash where there is none."""
    if value is None or value != value:
        return "-"
    if abs(value) >= 1e3:  # nobody counts the digits of ten million times too much
        return f"{100 * value:.1e} %"
    return f"{100 * value:.{digits}f} %"


def two_percent(before: float, after: float) -> tuple[str, str]:
    """Return two fractions as percentages, with as many decimals as tell them apart.

    Parameters
    ----------
    before, after : the fractions; six decimals at most.
    """
    digits = 2
    while percent(before, digits) == percent(after, digits) and before != after and digits < 6:
        digits += 1
    return percent(before, digits), percent(after, digits)


def relative(value: float, spread: float) -> str:
    """A spread over the size of its value; no figure above 100 %, for it says no more.

    Parameters
    ----------
    value : of a parameter; a dash where it is zero or not known.
    spread : a standard deviation, or half an interval, in the unit of the value.
    """
    if not value or not math.isfinite(value) or not math.isfinite(spread):
        return percent(None)
    return percent(spread / abs(value), 1) if spread <= abs(value) else "> 100 %"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names as a sentence has them: "a, b and c"."""
    return f" {last} ".join([*([", ".join(names[:-1])] if names[1:] else []), *names[-1:]])


def points(value: float | None) -> str:
    """A difference of two fractions in percentage points, a dash where there is none."""
    if value is None or value != value:
        return "-"
    return f"{round(100 * value, 2) + 0.0:.2f}"


def _print(console, table: Table) -> None:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    shown = RichTable(
        title=Text(printable(table.title), style="bold"), title_justify="left", box=box.SIMPLE_HEAD
    )
    words = [max(map(len, column.split()), default=1) for column in table.columns]
    first = max((len(row[0]) for row in table.rows), default=0)
    # Words of headings stay whole where there is room for all of them.
    fits = max(first, words[0]) + sum(words[1:]) + 3 * len(words) <= console.width
    for index, column in enumerate(table.columns):
        cells: Sequence[str] = [row[index] for row in table.rows]
        numeric = bool(cells) and all(_is_number(cell) for cell in cells)
        # The first column names things that a user types: never shortened.
        justify = "right" if numeric else "left"
        shown.add_column(
            Text(printable(column)),
            justify=justify,
            no_wrap=index == 0,
            overflow="fold",
            min_width=words[index] if fits else None,
        )
    for row in table.rows:
        shown.add_row(*(Text(printable(cell)) for cell in row))
    if table.rows:
        console.print(shown)
    else:
        console.print(Text.assemble((printable(table.title), "bold"), ": none"))
    for note in table.notes:
        console.print(Text(printable(f"  {note}")))
    if table.notes or not table.rows:
        console.print()


def _is_number(cell: str) -> bool:
    return not cell or cell[0] in "<-+.0123456789"


def finite(value: float) -> float | None:
    """A number as JSON has it: None where it is not finite."""
    return float(value) if math.isfinite(value) else None


def json_row(record: Any) -> dict[str, Any]:
    """The fields of a flat dataclass as JSON has them."""
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {k: finite(x) if isinstance(x, float) else x for k, x in values.items()}
