"""Text as other programs write it: comments, units, decimal commas, dates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.recording import Column, FileLayout, open_table, read
from dynident.recording.formats.column_values import seconds_of

T = np.arange(4) / 100
Q, TAU = np.array([1.5, -2.25, 3.0, 0.125]), np.array([3.0, 4.5, -5.0, 0.0])
ROWS = [f"{t:g},{q:g},{tau:g}" for t, q, tau in zip(T, Q, TAU, strict=True)]
PLAIN = "\n".join(["t,q.a,tau.a", *ROWS]) + "\n"


def german(text: str, separator: str = ";") -> str:
    return text.replace(",", separator).replace(".", ",").replace("q,", "q.").replace("u,", "u.")


SAME = {
    "decimal commas": german(PLAIN),
    "decimal commas behind tabs": german(PLAIN, "\t"),
    "decimal commas, marked, with lines of Windows": "\ufeff" + german(PLAIN).replace("\n", "\r\n"),
    "decimal commas that begin late": german(PLAIN).replace("1,5", "1,5e0"),
    "the separator that Excel writes": "sep=;\n" + german(PLAIN),
    "comments above": "# a controller, 3.1\n#\n\n% of an arm; once\n// or another\n" + PLAIN,
    "comments of one word above": "# log\n" + PLAIN,
    "comments below": PLAIN + "# end of the log\n",
    "comments within": PLAIN.replace("\n0.02", "\n# paused, here, twice\n0.02"),
    "names in a comment": "# made, by hand\n# " + PLAIN,
    "names of ROS": "%" + PLAIN,
    "units below": PLAIN.replace("tau.a\n", "tau.a\ns,rad,N m\n"),
    "units in brackets": PLAIN.replace("tau.a\n", "tau.a\n[s],[rad],[N·m]\n"),
    "units of some": PLAIN.replace("tau.a\n", "tau.a\n,rad,-\n"),
    "comments, units and decimal commas": "#\n"
    + german(PLAIN.replace("tau.a\n", "tau.a\ns,,Nm\n")),
    "text beside": "\n".join(["t,q.a,tau.a,mode", *(f"{row},run" for row in ROWS)]),
}


@pytest.mark.parametrize("kind", SAME)
def test_it_is_read_as_what_it_says(tmp_path: Path, kind: str) -> None:
    (path := tmp_path / "run.csv").write_text(SAME[kind], newline="")
    one = read(path, ["a"])
    np.testing.assert_array_equal(one.t, T)
    np.testing.assert_array_equal(one.q[:, 0], Q)
    np.testing.assert_array_equal(one.tau[:, 0], TAU)


@pytest.mark.parametrize("above", ["", "# log, of one\n"])
def test_rows_without_names_may_hold_decimal_commas(tmp_path: Path, above: str) -> None:
    (path := tmp_path / "run.txt").write_text(above + german("\n".join(ROWS)))
    layout = FileLayout(names=("t", "q.a", "tau.a"))
    np.testing.assert_array_equal(read(path, ["a"], layout=layout).q[:, 0], Q)


def test_units_that_are_not_ours_stand_behind_the_names(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text(PLAIN.replace("tau.a\n", "tau.a\nms,(deg),Nm\n"))
    assert open_table(path).names == ("t [ms]", "q.a [deg]", "tau.a")
    with pytest.raises(RecordingError, match=r"no column 't', 'q.a'. it holds t \[ms\], q.a"):
        read(path, ["a"])
    columns = {"t": Column("t [ms]", 1e-3), "q.a": Column("q.a [deg]", np.pi / 180)}
    np.testing.assert_allclose(read(path, ["a"], columns).q[:, 0], np.deg2rad(Q))


DATES = {
    "of Greenwich": "2026-03-05T10:11:12.{:03d}",
    "marked": "2026-03-05T10:11:12.{:03d}Z",
    "with a blank": "2026-03-05 10:11:12.{:03d}",
    "of a zone": "2026-03-05T11:11:12.{:03d}+01:00",
    "of nanoseconds": "2026-03-05T10:11:12.{:03d}000000",
    "with a comma": "2026-03-05 10:11:12,{:03d}",
}


@pytest.mark.parametrize("kind", DATES)
def test_dates_are_a_clock(tmp_path: Path, kind: str) -> None:
    dates = [DATES[kind].format(round(1000 * t)) for t in T]
    values = [row.split(",")[1:] for row in ROWS]
    rows = [";".join([date, *rest]) for date, rest in zip(dates, values, strict=True)]
    (path := tmp_path / "run.csv").write_text("\n".join(["t;q.a;tau.a", *rows]))
    one = read(path, ["a"])
    np.testing.assert_allclose(one.t - one.t[0], T, atol=1e-6)
    assert one.t[0] == pytest.approx(1772705472.0, abs=1e-6)


def test_a_file_of_many_dates_is_read_in_pieces(tmp_path: Path) -> None:
    count = 120_000
    start = np.datetime64("2026-03-05T10:11:12.000000")
    dates = start + 4000 * np.arange(count)
    rows = "\n".join(f"{date},{k % 7},{k % 5},{'x' * 20}" for k, date in enumerate(dates))
    (path := tmp_path / "run.csv").write_text(f"t,q.a,tau.a,note\n{rows}\n")
    one = read(path, ["a"])
    assert one.samples == count
    np.testing.assert_allclose(one.t - one.t[0], 4e-3 * np.arange(count), atol=1e-6)
    np.testing.assert_array_equal(one.q[:, 0], np.arange(count) % 7)


def test_comments_that_were_skipped_are_said(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text("# one\n# two\n" + PLAIN)
    assert "2 lines of comment" in read(path, ["a"]).provenance.skipped


@pytest.mark.parametrize("above", [0, 3])
def test_the_line_of_a_fault_counts_all_lines_above(tmp_path: Path, above: int) -> None:
    text = "# a\n" * above + PLAIN.replace("0.02,3", "0.02,?")
    (path := tmp_path / "run.csv").write_text(text)
    with pytest.raises(RecordingError, match=rf"line {above + 4}, column q.a: '\?' is not"):
        read(path, ["a"])


def test_text_stands_in_its_columns_where_no_line_has_names(tmp_path: Path) -> None:
    rows = [f"{row},elbow,,run" for row in ROWS]
    (path := tmp_path / "run.csv").write_text("\n".join(rows))
    table = open_table(path, layout=FileLayout(names="numbered"))
    assert table.names == tuple(f"column{k}" for k in range(1, 7))
    assert table.texts == {"column4", "column5", "column6"}
    np.testing.assert_array_equal(table.load(["column2"])["column2"], Q)


@pytest.mark.parametrize("unit", ["ns", "us", "10us", "ms", "s"])
@pytest.mark.parametrize("kind", ["datetime64", "timedelta64"])
def test_dates_of_numpy_are_seconds(unit: str, kind: str) -> None:
    seconds = np.arange(4)
    t = (seconds * np.timedelta64(1, "s")).astype(f"timedelta64[{unit}]")
    if kind == "datetime64":
        t = np.datetime64("2026-03-05T10:11:12").astype(f"datetime64[{unit}]") + t
    begin = 1772705472.0 if kind == "datetime64" else 0.0
    np.testing.assert_allclose(seconds_of(t), begin + seconds, atol=1e-6)


def test_dates_of_numpy_are_a_clock(tmp_path: Path) -> None:
    t = np.datetime64("2026-03-05T10:11:12.000") + 10 * np.arange(4)
    np.savez(path := tmp_path / "run.npz", t=t, **{"q.a": Q, "tau.a": TAU})  # pyright: ignore
    one = read(path, ["a"])
    np.testing.assert_allclose(one.t - one.t[0], T, atol=1e-6)


def test_a_date_that_is_none_is_told_by_its_row(tmp_path: Path) -> None:
    t = np.datetime64(0, "ms") + np.arange(4)
    t[2] = np.datetime64("NaT")
    np.savez(path := tmp_path / "run.npz", t=t, **{"q.a": Q, "tau.a": TAU})  # pyright: ignore
    with pytest.raises(RecordingError, match=r"row 3, column t: .*nan"):
        read(path, ["a"])
