"""Pictures and pages of simulated loops, and of the iterations of instruments."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import escape
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from dynident.errors import DynidentError
from dynident.fitting.history import Convergence, Ending, Round
from dynident.reporting.html import page
from dynident.reporting.loop_content import loop_trace
from dynident.reporting.loop_page import loop_quantity, loop_section
from dynident.reporting.pictures.convergence import convergence
from dynident.reporting.pictures.loop_plots import simulated_loop
from dynident.reporting.pictures.plots import save
from dynident.validation.loop_errors import QUANTITIES, Quantity
from dynident.validation.validation_result import Skipped, Unsimulated, Validation
from reporting.fabricated import diagnosis
from reporting.fabricated_loop import validation
from reporting.read_page import Elements


@pytest.fixture(scope="module")
def found() -> Validation:
    return validation(skipped=(Skipped("old.csv", "no_reference", "it has no column q_ref"),))


def figures_of(html: str) -> dict:
    return json.loads(Elements(html).figures)


def test_thinning_keeps_the_extremes_of_the_differences(found):
    trace = loop_trace(found, found.runs[0], 0, "position")
    measured = trace.measured.copy()
    measured[123] += 3.0
    trace = replace(trace, measured=measured)
    thin = trace.thinned(60)
    assert len(thin.t) <= 60
    for one in ("simulated", "yardstick"):
        left, kept = measured - getattr(trace, one), thin.measured - getattr(thin, one)
        assert left.max() == kept.max() and left.min() == kept.min()


def test_moving_picture(found):
    cases: tuple[tuple[Quantity, str, str], ...] = (
        ("position", "rad", "reference"),
        ("torque", "N m", "by the control law"),
    )
    for quantity, unit, yardstick in cases:
        figure = loop_quantity(loop_trace(found, found.runs[1], 1, quantity))
        titles = [axis.title.text for axis in figure.select_yaxes()]
        assert titles == [f"{quantity} ({unit})", f"difference ({unit})"]
        drawn: Any = figure.data
        names = [trace.name for trace in drawn if trace.showlegend is not False]
        assert names == ["measured", yardstick, "simulated", "noise (2 rms)"]


def test_still_picture(tmp_path):
    figure = simulated_loop(validation(("<i>", "a$b$"), samples=60), joints=("a$b$",))
    assert isinstance(figure, Figure)
    assert save(figure, tmp_path / "loop.png").stat().st_size > 1000
    assert simulated_loop(validation(samples=60, noise=False), "run6.csv").axes


def test_recordings_that_are_not_there(found):
    with pytest.raises(DynidentError, match=r"run5\.csv, run6\.csv"):
        simulated_loop(found, "old.csv")
    with pytest.raises(DynidentError, match="no loop was simulated"):
        simulated_loop(replace(found, runs=()))
    with pytest.raises(DynidentError, match="shoulder, elbow"):
        simulated_loop(found, joints=("wrist",))


def test_the_report_has_the_section_where_there_is_a_loop(found):
    small = diagnosis(("slide",), samples=100)
    html = page(small, loop=found)
    assert "Simulated in closed loop" in html and escape(found.sentence) in html
    for row in found.error_table().rows:
        assert all(cell in html for cell in row)
    figures = figures_of(html)
    pairs = [(i, one) for i in range(4) for one in QUANTITIES]
    assert {f"loop-{i}-{one}" for i, one in pairs} <= set(figures)
    assert re.findall(r'data-figure="loop-0-(\w+)"', html) == list(QUANTITIES)
    section = loop_section(Unsimulated("the loop diverges"))
    assert section is not None and section.failure == "the loop diverges"
    assert loop_section(None) is None


@pytest.mark.slow
def test_a_page_of_its_own(found):
    html = page(found, command="dynident simulate study.toml")
    assert html.count(escape(found.sentence)) == 1
    assert "dynident simulate study.toml" in html and "old.csv: it has no column q_ref." in html
    assert len(figures_of(html)) == 16
    failed = replace(found, runs=())
    html = page(failed)
    assert "No loop could be simulated." in html and figures_of(html) == {}
    hostile = validation(("<script>alert(1)</script>",), samples=50)
    assert "<script>alert" not in page(hostile)


def test_many_joints_stay_small():
    many = validation(tuple(f"joint{i}" for i in range(7)), runs=3, samples=600)
    html = page(many)
    assert len(html) < 6e6
    assert "Of 2 more recordings there are no pictures" in html
    assert len(figures_of(html)) == 7 * 4


def history(rounds: int = 3, names: tuple[str, ...] = ("m$1$", "Fv@elbow")) -> Convergence:
    p = len(names)
    done = tuple(
        Round(
            values=np.full(p, 2.0 - 0.1**k),
            error_measured=0.1,
            error_simulated=0.5 * 0.1**k,
            correlation=0.9,
        )
        for k in range(rounds)
    )
    nothing = np.full(p, np.nan)
    return Convergence(
        names=names,
        units=("kg", "N m s/rad")[:p],
        start=np.zeros(p),
        start_name="regular",
        rounds=done,
        ending=Ending.CONVERGED,
        message="",
        sigma=np.array([0.1, np.nan])[:p],
        textbook_sigma=nothing,
        expected_bias=nothing,
        sampling_bias=nothing,
        position_std=np.zeros(1),
        torque_std=np.zeros(1),
        noise_source="given",
    )


def test_every_parameter_over_the_iterations():
    figure = convergence(history(), {"Fv@elbow": 2.0})
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 3
    line = np.asarray(shown[0].lines[0].get_ydata())
    np.testing.assert_allclose(line, [0.0, 1.0, 1.9, 1.99])
    assert "Fv@elbow" in shown[1].get_title(loc="left")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == "95 % interval" and "true value" in labels
    both = convergence({"least squares": history(), "regular": history(1)})
    assert [np.size(line.get_xdata()) for line in both.axes[0].lines] == [4, 2]


def test_histories_that_do_not_compare():
    with pytest.raises(DynidentError, match="different parameters"):
        convergence({"a": history(), "b": history(names=("m",))})
    with pytest.raises(DynidentError, match="no iterations"):
        convergence({})
