"""Results in notebooks: the same tables and sentences as in a terminal, never a dump of fields."""

from __future__ import annotations

import math

import pytest

import dynident as di
from dynident.tables import (
    MOSTLY_NOISE,
    WIDTH,
    Table,
    mostly_noise,
    print_tables,
    relative,
    two_percent,
)
from study_files import recording, true_model


def test_results_are_tables_in_a_notebook() -> None:
    fit = di.fit(true_model(), recording(1))
    compared = di.compare(fit, di.Dataset((recording(2),)))
    for one in (fit, compared):
        page = one._repr_html_()
        tables = [part for part in one.tables() if isinstance(part, Table)]
        assert page.count("<table") == len(tables) > 0
        assert "Recording(" not in page and "shoulder" in page


def test_sentences_are_escaped() -> None:
    class Odd(di.Estimate):
        def tables(self) -> tuple[Table | str, ...]:
            return ("<b>1 < 2</b>",)

    assert Odd.__new__(Odd)._repr_html_() == "<p>&lt;b&gt;1 &lt; 2&lt;/b&gt;</p>"


def test_joints_of_noise_are_marked_and_no_others() -> None:
    assert mostly_noise(["a", "b", "c"], [None, 0.9 * MOSTLY_NOISE, 0.01]) == ()
    (note,) = mostly_noise(["a", "b", "c"], [None, 1.1 * MOSTLY_NOISE, 0.01])
    assert "At b noise" in note


def test_a_fit_that_leaves_much_says_what_to_do() -> None:
    one = recording(1)
    poor = di.fit(di.Model(true_model().robot), one)
    assert max(poor.joint_errors) > 0.2
    assert "dynident explain" in str(poor.error_table())
    assert "dynident explain" not in str(di.fit(true_model(), one).error_table())


def test_names_never_command_a_terminal(capsys) -> None:
    Table("a\x1b[31m", ("b\u202e",), (("c\x07",),), ("d\x9b",)).show()
    said = capsys.readouterr().out
    assert "a\\u001b[31m" in said and "c\\u0007" in said
    assert not {"\x1b", "\u202e", "\x07", "\x9b"} & set(said)


def test_a_table_without_rows_says_none_instead_of_showing_its_headings() -> None:
    empty = Table("Effects added", ("effect added", "after"), (), ("A note.",))
    assert str(empty).split("\n")[:2] == ["Effects added: none", "  A note."]
    assert empty._repr_html_() == "<p>Effects added: none</p><p>A note.</p>"


def test_words_of_headings_stay_whole_where_there_is_room() -> None:
    few = Table("few", ("joint", *["acceleration and load"] * 6), (("j", *["(0 ± 0)"] * 6),))
    assert str(few).count("acceleration") == 6
    # Where there is none, they are broken, and every column is there.
    many = Table("many", ("joint", *["joint_elasticity@shoulder"] * 7), (("j", *"1234567"),))
    assert all(digit in str(many) for digit in "1234567")


def test_what_is_typed_is_not_broken_where_a_line_ends(capsys: pytest.CaptureFixture) -> None:
    command = "dynident add study.toml " + " ".join(f"torque_offset@joint{k}" for k in range(9))
    print_tables(f"Next: {'long ' * 40}\n    {command}")
    lines = capsys.readouterr().out.splitlines()
    assert f"    {command}" in lines and max(map(len, lines[:-1])) <= WIDTH


@pytest.mark.parametrize(
    ("value", "spread", "said"),
    [
        (-2.0, 0.5, "25.0 %"),
        (2.0, 2.0, "100.0 %"),
        (1e-9, 1.0, "> 100 %"),
        (0.0, 1.0, "-"),
        (math.nan, 1.0, "-"),
        (1.0, math.inf, "-"),
    ],
)
def test_a_spread_beyond_its_value_has_no_figure(value: float, spread: float, said: str) -> None:
    assert relative(value, spread) == said


@pytest.mark.parametrize(
    ("before", "after", "shown"),
    [
        (0.05, 0.04, ("5.00 %", "4.00 %")),
        (0.00601, 0.00597, ("0.601 %", "0.597 %")),
        (0.006, 0.006, ("0.60 %", "0.60 %")),
    ],
)
def test_two_errors_have_as_many_digits_as_tell_them_apart(before, after, shown) -> None:
    assert two_percent(before, after) == shown
