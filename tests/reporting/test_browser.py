"""The report in a real browser, as a reader sees it on a desk and on a phone."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from browsers import DESK, HEIGHT, PHONE, Tab, needs_browser, opened, serious_faults
from dynident.reporting import report
from dynident.tables import percent
from reporting.fabricated import diagnosis
from reporting.fabricated_loop import validation

pytestmark = [needs_browser, pytest.mark.slow]

SMALLEST_TEXT = 12.0  # pixels

_DRAWN = """() => [...document.querySelectorAll(".plot")]
  .filter((node) => !node.closest("details:not([open])"))
  .map((node) => ({
    name: node.dataset.figure,
    height: node.getBoundingClientRect().height,
    // Lines, bars, marks: what is drawn of the data, not axes or the grid.
    shapes: [...node.querySelectorAll(".overplot .trace path")]
      .filter((path) => (path.getAttribute("d") ?? "").length > 5).length,
  }))"""
_SMALL_TEXT = """(smallest) => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement, box = parent.getBoundingClientRect();
    if (!node.data.trim() || !box.width || !box.height) continue;
    if (parseFloat(getComputedStyle(parent).fontSize) < smallest) found.push(node.data);
  }
  return found;
}"""
_UNFOLD = """() => {
  const joints = [...document.querySelectorAll("details.joint")], alike = joints.slice(1, -1);
  document.querySelectorAll("details").forEach((part) => { part.open = !alike.includes(part); });
}"""
_RANGE = 'document.getElementById("torque")._fullLayout.xaxis.range'


@pytest.fixture(scope="module")
def two_joints(tmp_path_factory) -> Path:
    to = tmp_path_factory.mktemp("two") / "report.html"
    return report(diagnosis(samples=300), to, loop=validation())


@pytest.fixture(scope="module")
def seven_joints(tmp_path_factory) -> Path:
    found = diagnosis(tuple(f"joint{i}" for i in range(1, 8)), samples=300)
    # A model that is rejected, at its last joint.
    joints = (*found.joints[:-1], replace(found.joints[-1], ratio_after=2.3))
    calm = tuple(replace(one, ratio_before=0.1) for one in joints[:-1])
    found = replace(found, verdict="unexplained", joints=(*calm, joints[-1]))
    return report(found, tmp_path_factory.mktemp("seven") / "report.html")


class Visit(Tab):
    """The report: one file, and nothing beside it."""

    def assert_quiet(self) -> None:
        super().assert_quiet()
        assert set(self.requests) == {self.home}


@pytest.fixture(scope="module")
def visit(browser) -> Callable[[Path, int], Visit]:
    visits: dict[tuple[Path, int], Visit] = {}

    def at(path: Path, width: int) -> Visit:
        if (path, width) not in visits:
            visits[path, width] = _visited(browser, path, width)
        return visits[path, width]

    return at


def _visited(browser, path: Path, width: int) -> Visit:
    found = opened(browser, path.as_uri(), width, Visit)
    # Drawn in the order of the page, and all at once.
    found.page.locator(".js-plotly-plot").nth(2).wait_for()
    return found


def assert_readable(one: Visit) -> None:
    """Every picture in sight is drawn, no text is tiny, nothing sticks out to the side."""
    pictures = one.page.evaluate(_DRAWN)
    assert pictures and all(picture["height"] > 60 for picture in pictures)
    assert [picture["name"] for picture in pictures if not picture["shapes"]] == []
    one.assert_fits()
    assert one.page.evaluate(_SMALL_TEXT, SMALLEST_TEXT) == []
    one.assert_quiet()


@pytest.mark.parametrize("width", [PHONE, DESK])
@pytest.mark.parametrize("which", ["two_joints", "seven_joints"])
def test_it_is_readable(which, width, visit, request):
    one = visit(request.getfixturevalue(which), width)
    assert_readable(one)
    sentence = one.page.locator(".sentence").bounding_box()
    assert sentence["y"] + sentence["height"] < HEIGHT  # the verdict is seen without scrolling
    first = one.page.locator(".plot").first.bounding_box()
    assert first["y"] + 150 < HEIGHT  # and so is the first picture


def test_zoom(visit, two_joints):
    one = visit(two_joints, DESK)
    page = one.page
    plot = page.locator("#torque .nsewdrag").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    whole = page.evaluate(_RANGE)
    height = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.4 * box["width"], height)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], height, steps=4)
    page.mouse.move(box["x"] + 0.6 * box["width"], height + 2, steps=4)
    page.mouse.up()
    page.wait_for_function(f"{_RANGE}[1] - {_RANGE}[0] < {0.3 * (whole[1] - whole[0])}")
    near = page.evaluate(_RANGE)
    assert whole[0] < near[0] < near[1] < whole[1]
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], height)
    page.wait_for_function(f"Math.abs({_RANGE}[0] - {whole[0]}) < 1e-6")
    one.assert_quiet()


def test_a_finger_scrolls_until_the_glass_is_chosen(visit, two_joints):
    mode = 'document.getElementById("torque")._fullLayout.dragmode'
    one = visit(two_joints, PHONE)
    assert one.page.evaluate(mode) is False
    one.page.locator('#torque [data-val="zoom"]').tap()
    assert one.page.evaluate(mode) == "zoom"
    one.assert_quiet()


def test_only_the_joints_that_fail_are_unfolded(visit, seven_joints):
    shown = (
        "[...document.querySelectorAll('details.joint[open] summary strong')].map(n => n.innerText)"
    )
    one = visit(seven_joints, DESK)
    assert one.page.evaluate(shown) == ["joint7"]
    folded = one.page.locator("details.joint").nth(1)
    assert folded.locator(".js-plotly-plot").count() == 0
    folded.locator("summary").click()
    folded.locator(".js-plotly-plot").nth(5).wait_for()
    one.page.locator("#final-only").check()
    assert_readable(one)


def test_what_is_chosen_is_drawn(visit, two_joints):
    torque = 'document.getElementById("torque")._fullData[0].y[7]'
    loop = 'document.querySelector("[data-quantity=torque]")._fullData[0].y[7]'
    one = visit(two_joints, DESK)
    before = one.page.evaluate(f"[{torque}, {loop}]")
    one.page.locator("[data-chooses=torque]").select_option(index=1)
    one.page.locator("[data-chooses=loop]").select_option(index=1)
    after = one.page.evaluate(f"[{torque}, {loop}]")
    assert all(a != b for a, b in zip(before, after, strict=True))
    one.assert_quiet()


def test_switching_an_effect_on_lets_the_error_fall(visit, two_joints):
    one = visit(two_joints, PHONE)
    found = diagnosis(samples=300)
    shown = one.page.locator("#switched-error")
    drawn = 'document.getElementById("switched-torque")._fullData[2].y[60]'
    bar = "document.querySelectorAll('.bar .now')[1].style.width"
    box = one.page.get_by_role("checkbox", name="stribeck friction at elbow")
    seen = []
    for check in (box.uncheck, box.check, box.uncheck):
        check()
        seen.append((shown.inner_text(), one.page.evaluate(drawn), one.page.evaluate(bar)))
    assert seen[0] == seen[2]
    assert [text for text, *_ in seen[:2]] == [
        percent(found.test_error.before),
        percent(found.test_error.after),
    ]
    assert found.switches is not None
    assert seen[1][1] == pytest.approx(found.switches.choices[1].predicted[60, 1], rel=1e-4)
    assert float(seen[1][2].rstrip("%")) < float(seen[0][2].rstrip("%"))
    one.assert_quiet()


def test_it_prints_on_less_than_ten_pages(visit, seven_joints):
    pdf = visit(seven_joints, DESK).page.pdf(format="A4", prefer_css_page_size=True)
    assert 1 < len(re.findall(rb"/Type\s*/Page\b", pdf)) < 10


def test_pictures_are_lower_on_paper_and_as_before_afterwards(visit, two_joints):
    page = visit(two_joints, DESK).page
    before = page.evaluate(_DRAWN)
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.set_viewport_size({"width": 688, "height": HEIGHT})  # A4, less its margins
    page.wait_for_timeout(1000)
    both = zip(page.evaluate(_DRAWN), before, strict=True)
    printed = {was["name"]: one["height"] / was["height"] for one, was in both}
    assert printed.pop("waterfall") == pytest.approx(1.0, abs=0.02)
    assert printed.pop("ranking") == pytest.approx(0.8, abs=0.02)
    assert max(one for name, one in printed.items() if name.startswith(("map", "loop"))) < 0.75
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": DESK, "height": HEIGHT})
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    page.wait_for_timeout(1000)
    assert [one["height"] for one in page.evaluate(_DRAWN)] == pytest.approx(
        [one["height"] for one in before], abs=2
    )


@pytest.mark.parametrize("which", ["two_joints", "seven_joints"])
def test_who_cannot_see_or_point_can_read_it(which, browser, request):
    """With all that is folded open, less joints like others: of a page of its own."""
    one = _visited(browser, request.getfixturevalue(which), DESK)
    one.page.evaluate(_UNFOLD)
    assert serious_faults(one.page) == []
    levels = one.page.evaluate(
        "[...document.querySelectorAll('h1,h2,h3,h4')].map((n) => Number(n.tagName[1]))"
    )
    assert levels[0] == 1 and all(b - a <= 1 for a, b in pairwise(levels))
    one.page.context.close()


def test_the_page_of_a_validation(visit, tmp_path):
    assert_readable(visit(report(validation(), tmp_path / "loop.html"), PHONE))


def test_hostile_names_stay_names(visit, tmp_path):
    names = ("a", "$x$ </script><img src=x onerror=alert(2)>")
    one = visit(report(diagnosis(names, samples=300), tmp_path / "report.html"), DESK)
    assert_readable(one)
    assert one.page.locator("img").count() == 0
