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


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "utf-8"])
def test_umlauts_and_units_of_windows_are_read(tmp_path: Path, encoding: str) -> None:
    text = PLAIN.replace("q.a", "Rückführung [°/s²]").replace("\n", "\r\n")
    (path := tmp_path / "run.csv").write_bytes(
        f"# Prüfstand, Wärme in °C\r\n{text}".encode(encoding)
    )
    table = open_table(path)
    assert table.names == ("t", "Rückführung [°/s²]", "tau.a")
    np.testing.assert_array_equal(table.load(["Rückführung [°/s²]"])["Rückführung [°/s²]"], Q)


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
    np.testing.assert_allclose(one.t, T, atol=1e-6)
    assert one.provenance.began == pytest.approx(1772705472.0, abs=1e-6)


@pytest.mark.slow
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


@pytest.mark.parametrize("names", ["t,q.a,tau.a", "# t,q.a,tau.a"])
def test_comments_among_the_samples_are_counted(tmp_path: Path, names: str) -> None:
    rows = [names, "# of the head", "s,rad,Nm", ROWS[0], "# paused", "// 0.02,1,2", *ROWS[1:], "%"]
    if names.startswith("#"):
        del rows[1:3]
    (path := tmp_path / "run.csv").write_text("\n".join(rows) + "\n")
    one = read(path, ["a"])
    np.testing.assert_array_equal(one.q[:, 0], Q)
    assert "3 lines of comment among the samples" in one.provenance.skipped
    assert ("1 line of comment" in one.provenance.skipped) == (not names.startswith("#"))


def test_comments_above_a_part_are_counted_once(tmp_path: Path) -> None:
    lines = ["t,q.a,tau.a", *(f"{k / 100:.2f},{k % 7},{k % 5}" for k in range(900))]
    for place in (600, 300, 200, 100):
        lines.insert(place, "# a note")
    (path := tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    part = read(path, ["a"]).part(slice(400, 800)).part(slice(10, 350))
    for index in (0, 100, 339):
        assert lines[part.provenance.line(index) - 1].startswith(f"{part.t[index]:.2f},")
    lines[410] = "lost"
    path.write_text("\n".join(lines) + "\n")
    one = read(path, ["a"], sound_in=(5.0, 7.0))
    assert one.t[0] > 4
    for index in (0, 300):
        assert lines[one.provenance.line(index) - 1].startswith(f"{one.t[index]:.2f},")


@pytest.mark.parametrize("mark", [",", " "])
@pytest.mark.parametrize("added", [{500: '# note, "begin of motion'}, {500: '#a,"b', 900: ' % "d'}])
def test_a_quotation_mark_in_a_comment_opens_no_cell(
    tmp_path: Path, mark: str, added: dict[int, str]
) -> None:
    lines = ["t,q.a,tau.a", *(f"{k / 100:.2f},{k % 7},{k % 5}" for k in range(1500))]
    lines = [line.replace(",", mark) for line in lines]
    for place, comment in sorted(added.items(), reverse=True):
        lines.insert(place, comment)
    (path := tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    one = read(path, ["a"])
    np.testing.assert_array_equal(one.q[:, 0], np.arange(1500) % 7)
    assert lines[one.provenance.line(1499) - 1] == lines[-1]


def test_a_row_that_was_commented_out_is_none_where_its_clock_is_not_read(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text(PLAIN.replace("\n0.02", "\n#0.015,7,7\n0.02"))
    np.testing.assert_array_equal(open_table(path).load(["q.a"])["q.a"], Q)


FAULTS = {
    "a number": ("0.03,?,0", r"line {}, column q.a: '\?' is not a number"),
    "a column": ("0.03,1", r"line {}: 2 columns"),
    "the clock": ("0.01,1,1", r"row 4 \(line {}\), column t: time goes back"),
}


@pytest.mark.parametrize("kind", FAULTS)
@pytest.mark.parametrize("before_units", [0, 2])
@pytest.mark.parametrize("within", [0, 3])
def test_lines_are_counted_with_all_comments(
    tmp_path: Path, kind: str, before_units: int, within: int
) -> None:
    row, words = FAULTS[kind]
    head = ["# log", "", "t,q.a,tau.a", *["# of the units"] * before_units, "[s],[rad],[Nm]"]
    lines = [*head, *ROWS[:2], *["# paused"] * within, ROWS[2], row, "# end"]
    (path := tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=words.format(lines.index(row) + 1)):
        read(path, ["a"])


HEADS = {
    "savetxt": ("# t q.a tau.a\n", " ", ("t", "q.a", "tau.a")),
    "savetxt with commas over blanks": ("# t, q.a, tau.a\n", " ", ("t", "q.a", "tau.a")),
    "savetxt with commas over blanks, every word a name's": (
        "# t_1, q.a, tau.a\n",
        " ",
        ("t_1", "q.a", "tau.a"),
    ),
    "blanks over commas": ("% t q.a tau.a\n", ",", ("t", "q.a", "tau.a")),
    "MATLAB": (
        "% Time Joint1Position [rad] Torque_1\n%-----\n".replace(" [rad]", "[rad]"),
        "\t",
        ("Time", "Joint1Position[rad]", "Torque_1"),
    ),
    "ROS": (
        "%time,field.position0,field.effort0\n",
        ",",
        ("time", "field.position0", "field.effort0"),
    ),
    "with units": ("# t,q.a,tau.a\n# ms,deg,Nm\n", ",", ("t [ms]", "q.a [deg]", "tau.a")),
    "words": ("# time, position, torque\n", ",", ("time", "position", "torque")),
}
PROSE = (
    "# made on monday\n",
    "# log of UR10e\n",
    "# made, by hand, today\n",
    "# t,q.a,tau.a\n# made, by hand, today\n",
    "# at 10:11:12 2026-03-05\n",
    "# 0,1,2\n",
    "# a, b c, I\n",
)


@pytest.mark.parametrize("kind", HEADS)
def test_the_last_comment_names_the_columns(tmp_path: Path, kind: str) -> None:
    head, mark, names = HEADS[kind]
    (path := tmp_path / "run.csv").write_text(head + "\n".join(ROWS).replace(",", mark))
    assert open_table(path).names == names


@pytest.mark.parametrize("mark", [" ", ","])
def test_names_of_joints_may_be_plain_words(tmp_path: Path, mark: str) -> None:
    row = "0 1 2 3 4\n".replace(" ", mark)
    (path := tmp_path / "run.csv").write_text(
        "# t shoulder elbow tau_shoulder tau_elbow\n" + 3 * row
    )
    assert open_table(path).names == ("t", "shoulder", "elbow", "tau_shoulder", "tau_elbow")


def test_a_sentence_of_as_many_words_names_no_columns(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text(
        "# this log was made on monday morning\n" + 3 * "0,1,2,3,4,5,6\n"
    )
    with pytest.raises(RecordingError, match="holds numbers, not the names of columns"):
        open_table(path)


@pytest.mark.parametrize("comment", PROSE)
def test_a_sentence_above_names_no_columns(tmp_path: Path, comment: str) -> None:
    (path := tmp_path / "run.csv").write_text(comment + "\n".join(ROWS))
    with pytest.raises(RecordingError, match="holds numbers, not the names of columns"):
        open_table(path)
    path.write_text(comment + PLAIN)
    assert open_table(path).names == ("t", "q.a", "tau.a")


@pytest.mark.parametrize("mark", [";", "\t"])
def test_commas_that_may_be_of_thousands_are_asked_for(tmp_path: Path, mark: str) -> None:
    rows = ["t;q.a;tau.a", "1;1,234;9,876", "2;-5,678;7"]
    (path := tmp_path / "run.csv").write_text("\n".join(rows).replace(";", mark))
    with pytest.raises(RecordingError, match=r"'1,234' may be 1\.234 or 1234\. write decimal poi"):
        open_table(path)


@pytest.mark.parametrize("telling", ["0,500", "1,2345", "12,5", ",500", "1000,500"])
def test_one_comma_that_can_be_of_decimals_alone_tells_what_all_are(
    tmp_path: Path, telling: str
) -> None:
    (path := tmp_path / "run.csv").write_text(f"t;q.a;tau.a\n1;1,234;9,876\n2;-5,678;{telling}\n")
    found = open_table(path).load(["q.a", "tau.a"])
    np.testing.assert_array_equal(found["q.a"], [1.234, -5.678])
    assert found["tau.a"][1] == float(telling.replace(",", "."))
