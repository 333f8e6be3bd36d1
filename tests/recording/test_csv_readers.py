"""The fast readers of CSV files are taken where nothing is odd, and read nothing else."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynident.errors import RecordingError
from dynident.recording import FileLayout, read, write
from dynident.recording.formats.text import careful_lines, csv_file
from dynident.recording.formats.text.text_head import head_of

REGULAR = {
    "point": "t,q.a,tau.a\n0,1,3\n.01,2,4\n",
    "semicolon": "t;q.a;tau.a\n0;1;3\n.01;2e0;+4",
    "tabs and spaces": "\ufefft\tq.a\ttau.a\r\n0\t 1 \t3\r\n.01\t2\t4\r\n\r\n",
    "quoted names": 't, "q.a", tau.a\n 0, 1, 3\n.01, 2, 4\n \n',
    "other columns": "t,note,q.a,tau.a,\n0,stärt,1,3,\n.01,,2,4,\n",
}
SIGNALS = ("q", "tau", "v", "q_ref")
CELLS = (
    "0",
    "-1.5",
    "+4",
    " 2",
    "2 ",
    ".5",
    "3.",
    "1e5",
    "1E-400",
    "0.1000000000000000055511151231",
)
ODD = ("", " ", "nan", "inf", "1e999", "1_0", "0x1", "1,5", "1e", "1d5", "--1", "text", "１")


@pytest.fixture
def no_careful_reader(monkeypatch):
    def fail(*_):
        pytest.fail("the careful reader was asked")

    monkeypatch.setattr(careful_lines.CarefulLines, "numbers", fail)


@pytest.fixture(params=[0, csv_file._SMALL], ids=["pandas", "NumPy"])
def small(request, monkeypatch):
    """Bytes up to which the fast reader is NumPy's."""
    monkeypatch.setattr(csv_file, "_SMALL", request.param)


@pytest.mark.parametrize("kind", REGULAR)
def test_a_regular_file_is_read_fast(tmp_path, small, no_careful_reader, kind):
    path = tmp_path / "run.csv"
    path.write_bytes(REGULAR[kind].encode())
    recording = read(path)
    np.testing.assert_array_equal(recording.t, [0, 0.01])
    np.testing.assert_array_equal(recording.q[:, 0], [1, 2])
    np.testing.assert_array_equal(recording.tau[:, 0], [3, 4])


def test_what_we_write_is_read_fast(arm, tmp_path, no_careful_reader):
    t = np.arange(4000) / 250
    many = arm.replace(t=t, **{x: np.tile(getattr(arm, x), (4, 1)) for x in SIGNALS})
    again = read(write(many, tmp_path / "run.csv"))
    for signal in SIGNALS:
        np.testing.assert_array_equal(getattr(again, signal), getattr(many, signal))


def test_a_small_file_is_read_without_pandas(arm, tmp_path, monkeypatch, no_careful_reader):
    path = write(arm, tmp_path / "run.csv")
    monkeypatch.setitem(sys.modules, "pandas", None)
    np.testing.assert_array_equal(read(path).tau, arm.tau)


def test_the_fast_reader_leaves_what_is_odd_to_the_careful_one(small):
    for cell in ODD:
        body = f"0;1;3\n.01;{cell};4\n".encode()
        assert csv_file._fast(body, ";", 3, [0, 1, 2]) is None
        assert csv_file._fast(body, ";", 3, [0, 2]) is not None


@pytest.mark.parametrize("read_by", [csv_file._by_numpy, csv_file._by_pandas])
@given(
    rows=st.lists(
        st.lists(st.sampled_from(CELLS + ODD + CELLS * 2), min_size=2, max_size=4), max_size=4
    ),
    end=st.sampled_from(["", "\n", "\n\n", " \n"]),
)
def test_both_readers_agree(read_by, rows, end):
    """Whatever the fast one returns, the careful one returns to the last bit."""
    body = ("\n".join(map(";".join, rows)) + end).encode()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csv_file, "_SMALL", len(body) if read_by is csv_file._by_numpy else 0)
        fast = csv_file._fast(body, ";", 3, [2, 0])
    head = head_of(b"a;b;c\n1;2;3\n", "run.csv", FileLayout())
    try:
        lines = careful_lines.CarefulLines(
            data=body, head=head, names=head.names, file="run.csv", above=1
        )
        careful = lines.numbers([2, 0])
    except RecordingError:
        assert fast is None
    else:
        assert fast is not None
        np.testing.assert_array_equal(np.column_stack(fast), careful)
