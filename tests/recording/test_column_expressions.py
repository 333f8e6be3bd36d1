"""Signals as linear expressions of a file's columns: what they are worth, and what is refused."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynident.errors import RecordingError
from dynident.recording import Column, read
from dynident.recording.formats.column_expressions import ColumnExpression, parse


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A file of two motors that move one joint each, and one joint together."""
    rng = np.random.default_rng(4)
    file = tmp_path_factory.mktemp("log") / "log.npz"
    names = {"a-b": 7.0, "left current (A)": 2.0, "x": 3.0, "q.x": 5.0}
    odd: dict[str, Any] = {name: value + rng.standard_normal(9) for name, value in names.items()}
    np.savez(file, t=np.arange(9) * 1e-3, motor=rng.standard_normal((9, 2)), **odd)
    return file, dict(np.load(file))


def _q(log, text, scale=1.0):
    columns = {"q.j": Column(text, scale), "tau.j": "x"}
    return read(log[0], ["j"], columns).q[:, 0]


@pytest.mark.parametrize(
    "text, worth",
    [
        ("motor[1]/32 - motor[0]/45", lambda x: x["motor"][:, 1] / 32 - x["motor"][:, 0] / 45),
        ("-motor[0]/48", lambda x: -x["motor"][:, 0] / 48),
        (" motor[0] - 1.5707963", lambda x: x["motor"][:, 0] - 1.5707963),
        ("(x + q.x) * 2 * pi / 360", lambda x: np.deg2rad(x["x"] + x["q.x"])),
        ("+x - (-2e-3*(x - 4))", lambda x: x["x"] + 2e-3 * (x["x"] - 4)),
        ("x + x + x", lambda x: 3 * x["x"]),
        ("2*`left current (A)` - `a-b`", lambda x: 2 * x["left current (A)"] - x["a-b"]),
        ("2*`motor`[1]", lambda x: 2 * x["motor"][:, 1]),
        # A name that is there is never read as an expression.
        ("a-b", lambda x: x["a-b"]),
        ("left current (A)", lambda x: x["left current (A)"]),
    ],
)
def test_an_expression_is_worth_what_it_says(log, text, worth):
    np.testing.assert_allclose(_q(log, text), worth(log[1]), rtol=1e-14, atol=1e-14)


def test_scale_multiplies_the_whole_and_the_provenance_keeps_the_text(log):
    np.testing.assert_allclose(_q(log, "x - 3", -2.0), -2 * (log[1]["x"] - 3))
    columns = {"q.j": Column("x - 3", -2.0), "tau.j": "x"}
    provenance = read(log[0], ["j"], columns).provenance
    assert ("q.j", "x - 3", -2.0) in provenance.columns


def test_columns_of_csv_and_mat_files(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    t = np.arange(5) * 1e-3
    (tmp_path / "a.csv").write_text(
        "t,motor.1,motor 2,tau.j\n" + "".join(f"{s},{s + 1},{3 * s},1\n" for s in t)
    )
    found = read(tmp_path / "a.csv", ["j"], {"q.j": "`motor.1`/2 - `motor 2`"})
    np.testing.assert_allclose(found.q[:, 0], (t + 1) / 2 - 3 * t)
    # Names of variables hold no dots: `motor.1` is `motor_1` there.
    scipy_io.savemat(tmp_path / "a.mat", {"t": t, "motor_a": t + 1, "tau_j": t, "m": np.eye(5)})
    found = read(tmp_path / "a.mat", ["j"], {"q.j": "motor.a/2 - m[1]"})
    np.testing.assert_allclose(found.q[:, 0], (t + 1) / 2 - np.eye(5)[:, 1])


@pytest.mark.parametrize(
    "text, said",
    [
        ("x*x", "multiplies columns by each other"),
        ("x*(q.x + 1)", "multiplies columns by each other"),
        ("1/x", "divides by a column"),
        ("x/0", "divides by zero"),
        ("x/(2 - 2)", "divides by zero"),
        ("3*pi/2", "names no column"),
        ("x - x", "no column left"),
        ("0*x + 1", "no column left"),
        ("x**2 + 1", "operator other than"),
        ("x - ~x", "operator other than"),
        ("x*1e999", "not finite"),
        ("x*" + "9" * 290 + "*" + "1e99", "not finite"),
        ("x + 0x" + "f" * 290, "too large"),
        ("x + 1j", "no number and no column"),
        ("x + True", "no number and no column"),
        ("x + 'x'", "no number and no column"),
        ("x + motor[x]", "brackets"),
        ("x + motor[0:1]", "brackets"),
        ("x + motor[-1]", "brackets"),
        ("x + motor[True]", "brackets"),
        ("x + motor[0][1]", "no number and no column"),
        ("x +", "cannot be read"),
        ("x + \0", "cannot be read"),
        ("(" * 140 + "x" + ")" * 140, None),
        ("(" * 250 + "x", "cannot be read"),
        ("x +" + " " * 2000 + "x", "longer than 2000"),
        ("(" * 990 + "x" + ")" * 990, "cannot be read"),
        ("-" * 1999 + "x", "cannot be read"),
        ("x + (y := 3)", "no number and no column"),
        ("abs(x)", "a call"),
        ("__import__('os').system('false')", "a call"),
        ("x + (lambda: 0)()", "a call"),
        ("x.__class__.__mro__[1].__subclasses__()", "a call"),
        ("x + [x for x in (1,)][0]", "no number and no column"),
        ("x + f'{x}'", "no number and no column"),
        ("x + (yield)", "no number and no column"),
        ("x if x > 0 else -x", "no number and no column"),
        ("x\n+ x", "cannot be read"),
        ("import os; -x", "cannot be read"),
        ("x + ``", "cannot be read"),
    ],
)
def test_what_is_no_linear_expression_is_refused_in_one_line(log, text, said):
    if said is None:
        np.testing.assert_array_equal(_q(log, text), log[1]["x"])
        return
    with pytest.raises(RecordingError, match=said) as caught:
        _q(log, text)
    assert "\n" not in str(caught.value)
    assert str(log[0]) in str(caught.value)


def test_a_long_row_of_signs_is_read(log):
    np.testing.assert_array_equal(_q(log, "-" * 298 + "x"), log[1]["x"])


@given(st.text(max_size=40) | st.text("x+-*/()[]`.1pi ", max_size=40))
@pytest.mark.slow
def test_any_text_is_an_expression_or_is_refused(text):
    try:
        found = parse(text)
    except RecordingError as error:
        assert "\n" not in str(error)
    else:
        assert found.terms
        assert all(np.isfinite(list(found.terms.values())))


@given(
    a=st.floats(-1e6, 1e6).filter(lambda x: abs(x) > 1e-6),
    b=st.floats(-1e6, 1e6).filter(lambda x: abs(x) > 1e-6),
    c=st.floats(-1e6, 1e6),
)
def test_numbers_keep_their_digits(a, b, c):
    found = parse(f"{a!r}*x + y/{b!r} - {c!r}")
    assert found.terms == {"x": a, "y": 1 / b}
    assert found.offset == -c


def test_a_missing_column_of_an_expression_is_named(log):
    with pytest.raises(RecordingError, match=r"no column 'motr\[1\]' \(for q.j\).*'motor'"):
        _q(log, "x - motr[1]")
    with pytest.raises(RecordingError, match=r"'motor\[1\]'|no column 2"):
        _q(log, "x - motor[2]")
    # None of its words is there: it was meant as a name.
    with pytest.raises(RecordingError, match="no column 'left-current'"):
        _q(log, "left-current")


def test_columns_of_different_lengths_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", t=np.arange(5.0), x=np.ones(5), y=np.ones(4))
    with pytest.raises(RecordingError, match=r"different lengths.*'x' 5, 'y' 4"):
        read(tmp_path / "a.npz", ["j"], {"q.j": "x - y", "tau.j": "x"})


@pytest.mark.parametrize(
    "text",
    [
        "motor[5]/32 - motor[4]/45 + pi/2",
        "-48*x",
        "-x/48.06 - y - pi",
        "pi/180*`a b`/32 + 3*pi/2",
        "0.3*x + 0.1",
    ],
)
def test_an_expression_is_written_as_people_write_it(text):
    assert parse(text).text == text


@given(
    st.dictionaries(
        st.sampled_from(["x", "a b", "m[3]", "pi", "q.x"]),
        st.floats(1e-9, 1e9) | st.floats(-1e9, -1e-9),
        min_size=1,
    ),
    st.floats(-1e6, 1e6),
)
def test_what_is_written_is_read_again(terms, offset):
    one = ColumnExpression(terms, offset)
    again = parse(one.text)
    assert again.terms == pytest.approx(terms, rel=1e-13)
    assert again.offset == pytest.approx(offset, rel=1e-13, abs=1e-300)
