"""A fault outside the window does not keep a file from being used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.errors import DynidentError, RecordingError
from dynident.recording import FileLayout, Recording, read, uniform, write
from study_files import STUDY, csv_text, write_study

RATE, COUNT = 100.0, 400
T = np.arange(COUNT) / RATE
Q, TAU = np.sin(3 * T), np.cos(2 * T)
WINDOW = (1.0, 3.0)  # rows 100 to 299
LINES = [
    "t,q.a,tau.a",
    *(f"{t:.9g},{q!r},{x!r}" for t, q, x in zip(T, map(float, Q), map(float, TAU), strict=True)),
]


def changed(row: int, change: Callable[[list[str]], str]) -> list[str]:
    """Lines with that of a row, from 0, as a function makes it of its cells."""
    lines = LINES[:]
    lines[row + 1] = change(lines[row + 1].split(","))
    return lines


def with_shift(row: int, seconds: float) -> list[str]:
    """Lines whose clock jumps before a row, and stays that much off."""
    return [LINES[0]] + [
        ",".join([f"{t + seconds * (k >= row):.9g}", *line.split(",")[1:]])
        for k, (t, line) in enumerate(zip(T, LINES[1:], strict=True))
    ]


FAULTS: dict[str, Callable[[int], list[str]]] = {
    "NaN": lambda k: changed(k, lambda x: f"{x[0]},nan,{x[2]}"),
    "infinite": lambda k: changed(k, lambda x: f"{x[0]},{x[1]},inf"),
    "text": lambda k: changed(k, lambda x: f"{x[0]},error,{x[2]}"),
    "a hole": lambda k: changed(k, lambda x: f"{x[0]},,{x[2]}"),
    "no time": lambda k: changed(k, lambda x: f"nan,{x[1]},{x[2]}"),
    "a row cut short": lambda k: changed(k, lambda x: f"{x[0]},{x[1]}"),
    "an empty line": lambda k: changed(k, lambda _: ""),
    "a stamp there twice": lambda k: changed(k, lambda x: f"{T[k - 1]:.9g},{x[1]},{x[2]}"),
    "a clock that goes back": lambda k: changed(
        k, lambda x: f"{T[k - 1] - 0.001:.9g},{x[1]},{x[2]}"
    ),
    "a gap": lambda k: (
        LINES[: k - 30] + LINES[k + 2 :] if k > COUNT // 2 else LINES[:k] + LINES[k + 30 :]
    ),
}


def written(tmp_path: Path, lines: list[str]) -> Path:
    (path := tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("kind", FAULTS)
@pytest.mark.parametrize("row", [50, 350])
def test_up_to_the_fault_all_is_kept(tmp_path: Path, kind: str, row: int) -> None:
    path = written(tmp_path, FAULTS[kind](row))
    with pytest.raises(RecordingError):
        uniform(read(path, ["a"]))
    one = read(path, ["a"], sound_in=WINDOW)
    uniform(one)
    # Nothing is left out of the window, nor of what a filter needs beside it.
    start = int(np.argmin(np.abs(one.t[0] - T)))
    np.testing.assert_allclose(one.q[:, 0], Q[start : start + one.samples], atol=1e-12)
    assert one.t[0] <= WINDOW[0] and one.t[-1] >= WINDOW[1]
    lost = start if row < 100 else COUNT - one.samples
    assert abs(lost - (row if row < 100 else COUNT - row)) <= 32
    words = one.provenance.skipped[-1]
    assert "beyond faults outside the window [1, 3] s" in words
    # Lines are still those of the file.
    index = 20
    line = one.provenance.line(index)
    assert path.read_text().splitlines()[line - 1].startswith(f"{one.t[index]:.9g},")


@pytest.mark.parametrize("kind", sorted(FAULTS.keys() - {"a gap"}))
def test_a_fault_within_is_told_though_there_is_another_outside(tmp_path: Path, kind: str) -> None:
    lines = changed(50, lambda x: f"{x[0]},nan,{x[2]}")
    lines[201] = FAULTS[kind](200)[201]
    with pytest.raises(RecordingError, match=r"line 202\b"):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)


def with_garbage(start: int, stop: int) -> list[str]:
    """Lines of which some rows are no samples."""
    return LINES[: start + 1] + ["lost"] * (stop - start) + LINES[stop + 1 :]


def without(start: int, stop: int) -> list[str]:
    """Lines without some rows."""
    return LINES[: start + 1] + LINES[stop + 1 :]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (with_garbage(280, 320), r"\(line 282\).* from 2\.79 s on.* end at 2\.79 s"),
        (with_garbage(80, 120), r"\(line 121\).* up to 1\.2 s.* begin at 1\.2 s"),
        (without(280, 320), r"\(line 282\).* from 2\.79 s on"),
        (without(80, 120), r"\(line 81\).* up to 1\.2 s"),
    ],
)
def test_a_fault_across_the_edge_of_the_window_is_told(
    tmp_path: Path, lines: list[str], said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)


def test_a_second_header_of_other_width_is_told(tmp_path: Path) -> None:
    lines = [*LINES[:51], "t,tau.a", *LINES[51:]]
    with pytest.raises(RecordingError, match=r"line 52: a line of words .* t, tau\.a"):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)


@pytest.mark.parametrize("place", [51, 351])
def test_a_second_header_with_other_columns_is_told(tmp_path: Path, place: int) -> None:
    other = [",".join([t, x, q]) for t, q, x in (line.split(",") for line in LINES)]
    lines = LINES[:place] + other[:1] + other[place:]
    with pytest.raises(
        RecordingError, match=rf"line {place + 1}: .*t, tau\.a, q\.a.*split the file"
    ):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)


@pytest.mark.parametrize("head", [["t,q.a,tau.a"], ["t;q.a;tau,a", "s;rad;Nm"], ["t q.a tau.a"]])
def test_the_same_header_again_is_a_fault_like_any_other(tmp_path: Path, head: list[str]) -> None:
    mark = ";" if ";" in head[0] else "," if "," in head[0] else " "
    body = [line.replace(",", mark) for line in LINES[1:]]
    body = [line.replace(".", ",") if mark == ";" else line for line in body]
    path = written(tmp_path, [*head, *body[:50], *head, *body[50:]])
    columns = {"tau.a": "tau,a"} if mark == ";" else None
    one = read(path, ["a"], columns, sound_in=WINDOW)
    np.testing.assert_array_equal(one.tau[:, 0], TAU[50:])


@pytest.mark.parametrize(("cells", "last"), [(0, 41), (1, 41), (2, 41), (0, 31), (1, 31), (2, 31)])
def test_no_quotation_mark_swallows_lines(tmp_path: Path, cells: int, last: int) -> None:
    lines = LINES[:]
    for row, before, after in ((30, '"', ""), (last, "", '"')):
        parts = lines[row].split(",")
        parts[cells] = before + parts[cells] + after
        lines[row] = ",".join(parts)
    path = written(tmp_path, [f"{x},{'note' * (k == 0)}" for k, x in enumerate(lines)])
    columns = {name: name for name in ("t", "q.a", "tau.a")}
    for window in (None, WINDOW):
        with pytest.raises(
            RecordingError, match=rf"line 31: a quotation mark .* to line {last + 1}"
        ):
            read(path, ["a"], columns, sound_in=window)


def test_text_may_go_on_over_lines(tmp_path: Path) -> None:
    noted = [f'{x},"a note,\n\nof 3, say"' for x in FAULTS["NaN"](50)]
    noted[0] = f"{LINES[0]},note"
    one = read(written(tmp_path, noted), ["a"], sound_in=WINDOW)
    np.testing.assert_array_equal(one.q[:, 0], Q[51:])


@pytest.mark.parametrize("window", [(-1.0, 3.0), (1.0, 9.0)])
def test_a_file_may_begin_or_end_within_the_window(
    tmp_path: Path, window: tuple[float, float]
) -> None:
    row = 350 if window[0] < 0 else 50
    one = read(written(tmp_path, FAULTS["text"](row)), ["a"], sound_in=window)
    assert one.samples == (350 if row == 350 else COUNT - 51)


def test_a_sound_file_is_kept_as_a_whole(tmp_path: Path) -> None:
    one = read(written(tmp_path, LINES), ["a"], sound_in=WINDOW)
    assert one.samples == COUNT and one.provenance.skipped == ()


def test_a_window_that_a_clock_passes_twice_is_refused(tmp_path: Path) -> None:
    lines = with_shift(350, -2.0)  # from 1.5 s on again
    with pytest.raises(RecordingError, match=r"line 352\), column t: time goes back from 3\.49"):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)
    assert read(written(tmp_path, lines), ["a"], sound_in=(0.5, 1.4)).samples == 350


def test_a_window_beside_the_clock_is_refused(tmp_path: Path) -> None:
    lines = FAULTS["NaN"](50)
    with pytest.raises(RecordingError, match=r"the window \[7, 8\] s holds no samples"):
        read(written(tmp_path, lines), ["a"], sound_in=(7.0, 8.0))


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([LINES[0], *(f"{x},0" for x in LINES[1:])], "line 2: 4 columns where the header has 3"),
        (LINES[:80] + [f"{x},0" for x in LINES[80:]], "line 81: 4 columns where the header has 3"),
        ([LINES[0], *(f"at {x}" for x in LINES[1:])], "line 2, column t: 'at 0' is not a number"),
    ],
)
def test_where_all_of_the_window_is_at_fault_the_fault_is_told(
    tmp_path: Path, lines: list[str], said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        read(written(tmp_path, lines), ["a"], sound_in=WINDOW)


def test_one_sample_that_is_left_out_is_one(tmp_path: Path) -> None:
    one = read(written(tmp_path, FAULTS["text"](COUNT - 1)), ["a"], sound_in=WINDOW)
    assert one.provenance.skipped[-1].startswith("1 sample beyond faults")


def test_a_rate_in_place_of_a_clock_counts_rows_at_fault(tmp_path: Path) -> None:
    lines = [line.partition(",")[2] for line in FAULTS["text"](50)]
    one = read(written(tmp_path, lines), ["a"], layout=FileLayout(rate_hz=RATE), sound_in=WINDOW)
    assert one.t[0] == pytest.approx(0.51)
    np.testing.assert_array_equal(one.q[:, 0], Q[51:])


def test_arrays_may_have_faults_too(tmp_path: Path) -> None:
    path = write(Recording(t=T, q=Q, tau=TAU, joints=("a",)), tmp_path / "run.npz")
    held = dict(np.load(path))
    held["q.a"][350] = np.nan
    np.savez(path, **held)
    with pytest.raises(RecordingError, match="row 351"):
        read(path, ["a"])
    np.testing.assert_array_equal(read(path, ["a"], sound_in=WINDOW).t, T[:350])


def test_a_study_reads_what_its_windows_ask_for(tmp_path: Path) -> None:
    lines = csv_text(0).splitlines()
    half = len(lines) // 2
    cells = lines[half].split(",")
    end, last = float(cells[0]), float(lines[-1].split(",")[0])
    lines[half] = ",".join([cells[0], "nan", *cells[2:]])
    path = write_study(tmp_path, STUDY)
    name = di.load(path).train.recordings[0].provenance.file
    Path(name).write_text("\n".join(lines) + "\n")
    with pytest.raises(DynidentError, match=rf"line {half + 1}, column"):
        di.load(path)
    entry = f'file = "{Path(name).name}"'
    assert STUDY.count(entry) == 1
    window = f"{entry}\nwindow = [0.0, {end - 0.1}]"
    study = di.load(write_study(tmp_path / "cut", STUDY.replace(entry, window)))
    assert study.train.recordings[0].samples > 0
    (tmp_path / "cut" / Path(name).name).write_text("\n".join(lines) + "\n")
    study = di.load(tmp_path / "cut" / path.name)
    assert study.train.recordings[0].t[-1] < end < last
