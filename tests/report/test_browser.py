"""The report in a real browser, as a reader sees it on a desk and on a phone."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from dynident.report import report
from report.fabricated import diagnosis
from report.fabricated_loop import validation

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no chromium, chromium-browser or google-chrome on the path"
)

PHONE, DESK = 390, 1280
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
_RANGE = 'document.getElementById("torque")._fullLayout.xaxis.range'


@pytest.fixture(scope="module")
def browser(tmp_path_factory) -> Iterator:
    home = tmp_path_factory.mktemp("home")
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(
            executable_path=BROWSER,
            args=["--no-sandbox", "--disable-gpu"],
            env={**os.environ, "HOME": str(home)},
        )
        yield found
        found.close()


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


@contextmanager
def opened(browser, path: Path, width: int) -> Iterator:
    """A page that has loaded; nothing may have complained or left the machine by the end."""
    phone = width == PHONE
    context = browser.new_context(
        viewport={"width": width, "height": 844}, has_touch=phone, is_mobile=phone
    )
    complaints, requests = [], []
    page = context.new_page()
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(path.as_uri())
    page.wait_for_function('document.querySelectorAll(".js-plotly-plot").length > 2')
    yield page
    context.close()
    assert complaints == []
    assert [url for url in requests if url != path.as_uri()] == []


def assert_readable(page, width: int) -> None:
    """Every picture in sight is drawn, no text is tiny, nothing sticks out to the side."""
    pictures = page.evaluate(_DRAWN)
    assert pictures and all(one["height"] > 60 for one in pictures)
    assert [one["name"] for one in pictures if not one["shapes"]] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(_SMALL_TEXT, SMALLEST_TEXT) == []


@pytest.mark.parametrize("width", [PHONE, DESK])
@pytest.mark.parametrize("which", ["two_joints", "seven_joints"])
def test_it_is_readable(which, width, browser, request):
    with opened(browser, request.getfixturevalue(which), width) as page:
        assert_readable(page, width)
        sentence = page.locator(".sentence").bounding_box()
        assert sentence["y"] + sentence["height"] < 844  # the verdict is seen without scrolling
        first = page.locator("main h2").first
        assert first.inner_text() == "What to do next"


def test_zoom(browser, two_joints):
    with opened(browser, two_joints, DESK) as page:
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


def test_a_finger_scrolls_until_the_glass_is_chosen(browser, two_joints):
    mode = 'document.getElementById("torque")._fullLayout.dragmode'
    with opened(browser, two_joints, PHONE) as page:
        assert page.evaluate(mode) is False
        page.locator('#torque [data-val="zoom"]').tap()
        assert page.evaluate(mode) == "zoom"


def test_only_the_joints_that_fail_are_unfolded(browser, seven_joints):
    shown = (
        "() => [...document.querySelectorAll('details.joint[open] summary')].map(n => n.innerText)"
    )
    with opened(browser, seven_joints, DESK) as page:
        assert [line.split(":")[0] for line in page.evaluate(shown)] == ["joint7"]
        folded = page.locator("details.joint").nth(1)
        assert folded.locator(".js-plotly-plot").count() == 0
        folded.locator("summary").click()
        folded.locator(".js-plotly-plot").nth(5).wait_for()
        page.locator("#final-only").check()
        assert_readable(page, DESK)


def test_what_is_chosen_is_drawn(browser, two_joints):
    title = 'document.getElementById("torque")._fullData[0].y[7]'
    loop = 'document.querySelector("[data-quantity=torque]")._fullData[0].y[7]'
    with opened(browser, two_joints, DESK) as page:
        before = page.evaluate(f"[{title}, {loop}]")
        page.locator("[data-chooses=torque]").select_option(index=1)
        page.locator("[data-chooses=loop]").select_option(index=1)
        after = page.evaluate(f"[{title}, {loop}]")
        assert all(a != b for a, b in zip(before, after, strict=True))


def test_the_page_of_a_validation(browser, tmp_path):
    path = report(validation(), tmp_path / "loop.html")
    for width in (PHONE, DESK):
        with opened(browser, path, width) as page:
            assert_readable(page, width)


def test_hostile_names_stay_names(browser, tmp_path):
    names = ("a", "$x$ </script><img src=x onerror=alert(2)>")
    path = report(diagnosis(names, samples=300), tmp_path / "report.html")
    with opened(browser, path, DESK) as page:
        assert_readable(page, DESK)
        assert page.locator("img").count() == 0
