from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from IPython.core.formatters import PNGFormatter
from matplotlib.figure import Figure

from dynident.diagnosis.details import Step
from dynident.errors import DynidentError
from dynident.reporting.content import LABEL, bars, seen, thinned
from dynident.reporting.pictures import diagnosis_pictures as pictures
from dynident.reporting.pictures import plots
from reporting.fabricated import RECORDINGS, diagnosis, effect


def traces(figure: go.Figure) -> list[Any]:
    return list(figure.data)


@pytest.fixture(scope="module")
def found():
    return diagnosis()


@pytest.fixture(scope="module")
def unknown():
    return diagnosis(("slide",), noise=False, steps=False, samples=200)


def test_the_waterfall_goes_from_the_given_error_to_the_final_one(found):
    second = Step(
        effect=effect("torque_offset", "elbow"),
        values=(0.1,),
        test_error_before=0.0095,
        test_error_after=0.009,
        indistinguishable=(),
        p_value=1e-4,
    )
    error = replace(found.test_error, after=0.009)
    more = replace(found, steps=(*found.steps, second), test_error=error)
    rows = bars(more)
    assert [row.kind for row in rows] == ["given", "added", "added", "final"]
    assert rows[0].stop == 100 * error.before
    assert rows[1].stop == rows[0].stop
    assert rows[2].start == rows[-1].stop == pytest.approx(0.9)
    (bar,) = traces(pictures.waterfall(more))
    assert np.asarray(bar.base) + np.asarray(bar.x) == pytest.approx([row.stop for row in rows])


@pytest.mark.parametrize("after", [0.9, 0.999, 1.001, 1.1])
def test_no_number_lies_on_the_line_of_the_floor(found, after):
    """Numbers stand where their bars end, or behind the line; inside a bar, clear of it."""
    floor = found.test_error.noise_floor
    error = replace(found.test_error, before=1.2 * floor, after=after * floor)
    step = replace(found.steps[0], test_error_before=error.before, test_error_after=error.after)
    one = replace(found, test_error=error, steps=(step,))
    figure = pictures.waterfall(one)
    (bar,), line = traces(figure), 100 * floor
    room = LABEL * figure.layout.xaxis.range[1]
    behind = {a.y: a.x for a in figure.layout.annotations if a.yref != "paper"}
    for i, row in enumerate(bars(one)):
        place, end = bar.textposition[i], max(row.start, row.stop)
        begin = {"inside": end - room, "outside": end, "none": behind.get(i)}[place]
        assert begin is not None and not begin < line < begin + room
        assert (place == "none") == (i in behind)
    texts: list[Any] = list(plots.waterfall(one).axes[0].texts)  # annotations, at data
    drawn = {text.get_text(): text.xy[0] for text in texts}
    assert all(not begin < line < begin + room for begin in drawn.values())


def test_the_waterfall_names_the_whole_set(found):
    label = " ".join(bars(found)[1].lines)
    assert "stribeck friction at elbow" in label and "or asymmetric friction" in label


def test_an_unknown_floor_is_said(unknown, found):
    def words(one):
        return " ".join(a.text for a in pictures.waterfall(one).layout.annotations)

    assert "unknown" in words(unknown)
    assert f"{100 * found.test_error.noise_floor:.2f} %" in words(found)


def test_axes_have_units(found):
    figures = [pictures.residual_map(found, one) for one in found.maps if one.joint == "elbow"]
    assert [figure.layout.xaxis.title.text for figure in figures] == [
        "velocity (rad/s)",
        "position (rad)",
        "acceleration (rad/s\u00b2)",
        "load (N m)",
        "time (s)",
        "cycles per revolution",
    ]
    assert {figure.layout.yaxis.title.text for figure in figures} == {
        "mean residual (N m)",
        "amplitude (N m)",
    }
    legend = [trace.name for trace in traces(figures[0])]
    assert legend == ["noise band", "model as given", "with stribeck friction at elbow added"]


def test_without_noise_there_is_no_band(unknown):
    for one in unknown.maps:
        assert {t.name for t in traces(pictures.residual_map(unknown, one))} == {"model as given"}


def test_torques_of_a_recording(found):
    first, second = (t for t in found.traces if t.joint == "elbow")
    assert (first.recording, second.recording) == RECORDINGS
    drawn = [traces(pictures.measured_and_predicted(found, one)) for one in (first, second)]
    assert np.allclose(drawn[1][0].y, second.measured, atol=1e-5)
    assert not np.allclose(drawn[0][0].y, drawn[1][0].y)


def test_unknown_joints_list_the_valid_ones(found):
    with pytest.raises(DynidentError, match="shoulder, elbow"):
        plots.residual_maps(found, "wrist")
    with pytest.raises(DynidentError, match="no residual map"):
        plots.residual_maps(replace(found, maps=()), "elbow")


def test_thinning_keeps_every_extreme(found):
    trace = diagnosis(("slide",), samples=5000).traces[0]
    measured = trace.measured.copy()
    measured[1234] += 50.0
    trace = replace(trace, measured=measured)
    kept = thinned(trace, 600)
    assert len(kept) <= 600 and np.all(np.diff(kept) > 0)
    assert kept[0] == 0 and kept[-1] == 4999 and 1234 in kept
    for model in (trace.before, trace.after):
        left = trace.measured - model
        assert left[kept].min() == left.min() and left[kept].max() == left.max()
    assert np.array_equal(thinned(found.traces[0], 4000), np.arange(800))


def test_a_map_without_a_sentence_is_put_into_words(found, unknown):
    quiet = replace(found.maps[1], sentence="")
    assert seen(replace(quiet, before=0 * quiet.before)) == "Within the noise."
    assert "Beyond the noise" in seen(replace(quiet, before=9 * quiet.band))
    assert seen(replace(unknown.maps[1], sentence="")).startswith("Not judged")


def test_candidates_are_ranked_and_the_set_is_bracketed(found):
    figure = pictures.ranking(found)
    assert "quadratic drag<br>at elbow" in figure.layout.yaxis.ticktext
    assert len(figure.layout.yaxis.ticktext) == 5  # the absorbed one is not ranked
    assert [a.text for a in figure.layout.annotations] == ["cannot be<br>told apart"]
    alone = replace(found, steps=(replace(found.steps[0], indistinguishable=()),))
    assert not pictures.ranking(alone).layout.annotations


@pytest.mark.parametrize("names", [("shoulder", "elbow"), ("a$b$", "<i>")])
@pytest.mark.slow
def test_static_pictures(names, tmp_path):
    found = diagnosis(names, samples=200)
    for one in (found, diagnosis(names, noise=False, steps=False, samples=200)):
        for figure in (plots.waterfall(one), plots.residual_maps(one, names[1])):
            assert isinstance(figure, Figure)
            figure.savefig(tmp_path / "picture.png")
            assert PNGFormatter()(figure)  # as a notebook shows it


def test_figures_are_plotly_figures(found):
    for figure in (pictures.waterfall(found), pictures.residual_map(found, found.maps[0])):
        assert isinstance(figure, go.Figure)
