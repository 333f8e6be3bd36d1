"""The page in a real browser: the demo is solved by clicking, and what goes wrong is told."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

import dynident as di
from browsers import DESK, PATIENCE, PHONE, Tab, needs_browser, opened, serious_faults
from dynident.diagnosis import Diagnosis
from dynident.explorer import explore
from dynident.explorer.local_server import LocalServer
from dynident.explorer.switched_fit import Refitter
from explorer.test_next_recording import write_design
from study_files import STUDY, csv_text, edited, write_study
from synthetic import ARM

pytestmark = [pytest.mark.slow, needs_browser]

DEMO = Path(__file__).parents[2] / "problems" / "hidden_effect"
HIDDEN = "coulomb_friction@elbow"
NASTY = "<script>alert(1)</script>"
_BARS_AGREE = """() => {
  const said = document.querySelector("#said").innerText;
  const now = said.match(/All joints: ([0-9.]+ %) before, ([0-9.]+ %) now/);
  const bars = [...document.querySelectorAll("#errors .bartext")].map((n) => n.textContent);
  return now && bars[bars.length / 2 - 1] === now[1] && bars.at(-1) === now[2];
}"""
_NOW = re.compile(r"All joints: ([0-9.]+) % before, ([0-9.]+) % now")


class Explorer(Tab):
    """The page of the explorer."""

    def begin_anew(self, url: str) -> None:
        """Open a page as a tab does that has seen none before."""
        self.page.context.clear_cookies()
        for seen in (self.complaints, self.requests, self.pending):
            seen.clear()
        self.go(url)

    def switch(self, place: int = 0) -> None:
        """Flip a switch by the keyboard, and wait until the error has been seen to change."""
        before = self.said
        box = self.page.locator(".switch input").nth(place)
        box.focus()
        self.page.keyboard.press("Space")
        self.page.wait_for_function(
            "(old) => document.querySelector('#said').innerText !== old", arg=before
        )

    def write(self) -> str:
        """Write what is switched on; what the page says to it."""
        self.page.locator("#write:not([disabled])").click()
        self.page.wait_for_function("document.querySelector('#written').innerText.length > 0")
        return self.page.locator("#written").inner_text()

    @property
    def said(self) -> str:
        return self.page.locator("#said").inner_text()

    def wait_for_bars(self) -> None:
        """Wait until the bars of all joints say what the sentence says by then."""
        self.page.wait_for_function(_BARS_AGREE)


Opened = Callable[..., Explorer]


@pytest.fixture(scope="module")
def first_tabs(browser) -> dict[int, Explorer]:
    """A tab of each width, which stays: it runs faster what it has run at the same address."""
    return {width: opened(browser, "about:blank", width, Explorer) for width in (PHONE, DESK)}


@pytest.fixture
def tab(browser, first_tabs) -> Iterator[Opened]:
    tabs: list[Explorer] = []

    def at(url: str, width: int = DESK) -> Explorer:
        is_first = all(one.width != width for one in tabs)
        found = first_tabs[width] if is_first else opened(browser, "about:blank", width, Explorer)
        tabs.append(found)
        found.begin_anew(url)
        found.page.locator(".effect").first.wait_for(state="attached")
        found.page.wait_for_function("document.querySelector('#said').innerText.length > 0")
        return found

    yield at
    for one in tabs:
        if one in first_tabs.values():
            one.page.goto("about:blank")
        else:
            one.page.context.close()


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory) -> Diagnosis:
    study = di.load(write_study(tmp_path_factory.mktemp("diagnosed")))
    return di.diagnose(study.model, study.train, study.test)


@pytest.fixture(scope="module")
def served(tmp_path_factory, diagnosis) -> Iterator[tuple[Path, LocalServer]]:
    """The arm of the tests, diagnosed already."""
    yield from _served(tmp_path_factory.mktemp("served"), diagnosis)


def _served(folder: Path, diagnosis: Diagnosis) -> Iterator[tuple[Path, LocalServer]]:
    path = write_study(folder)
    server = explore(di.load(path), diagnosis)
    yield path, server
    server.stop()


@pytest.fixture
def small(served) -> tuple[Path, LocalServer]:
    """The arm as it was served first, whatever a test before has written into its study."""
    served[0].write_text(STUDY)
    return served


@pytest.fixture
def own(tmp_path, diagnosis) -> Iterator[tuple[Path, LocalServer]]:
    """The arm again, for who leaves more behind than another text of the study."""
    yield from _served(tmp_path, diagnosis)


@contextmanager
def by_command(folder: Path) -> Iterator[tuple[str, subprocess.Popen]]:
    """A study served by the command in a process of its own."""
    command = [sys.executable, "-m", "dynident.cli", "open", "study.toml", "--no-browser"]
    # A shell's background job ignores SIGINT, and its children would too.
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        server = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    finally:
        signal.signal(signal.SIGINT, inherited)
    assert server.stdout is not None
    line = server.stdout.readline()
    found = re.fullmatch(
        r"study\.toml is open at (http://127\.0\.0\.1:\d+/\S{32}/) \(Ctrl-C ends it\)\n", line
    )
    assert found, line
    try:
        yield found[1], server
    finally:
        if server.poll() is None:
            server.kill()
        server.communicate()


@pytest.fixture
def demo(tmp_path) -> Iterator[tuple[Path, str, subprocess.Popen]]:
    folder = tmp_path / "demo"
    shutil.copytree(DEMO, folder)
    with by_command(folder) as (url, server):
        yield folder / "study.toml", url, server


def test_the_demo_is_solved_by_clicking(demo, tab):
    path, url, server = demo
    one = tab(url)
    verdict = one.page.locator("#search").inner_text()
    assert "Explained: stribeck friction at elbow" in verdict
    first = one.page.locator(".effect").first.inner_text()
    assert first.startswith("Stribeck friction at elbow")
    one.page.locator("#seen", has_text="spikes beside zero velocity").wait_for()
    assert "Nothing is switched on yet" in one.said
    assert one.page.locator("#write").is_disabled()
    one.switch()
    before, now = map(float, _NOW.findall(one.said)[0])
    assert now < 0.6 * before
    one.wait_for_bars()
    row = one.page.locator("#values tbody tr").first
    row.wait_for()
    assert row.inner_text().split()[0] == "Fs@elbow" and "N m" in row.inner_text()
    low, high = map(float, row.locator("td").nth(1).inner_text().split(" to "))
    assert low < 0.5 < high  # the value that was hidden in the data
    assert "Written into study.toml: stribeck_friction@elbow" in one.write()
    assert "stribeck_friction@elbow" in [e.label for e in di.load(path).model.effects]
    one.assert_quiet()
    # The study as it is now: what was missing is in it.
    one.page.locator("#written a").click()
    one.page.locator("#search", has_text="Nothing is missing").wait_for()
    one.page.locator("#said", has_text="All joints").wait_for()
    assert float(re.findall(r"[0-9.]+", one.said)[0]) == pytest.approx(now, rel=0.1)
    server.send_signal(signal.SIGINT)
    rest, _ = server.communicate(timeout=60)
    assert (server.returncode, rest) == (0, "closed; what was not written is gone\n")


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_it_is_readable_and_reached_by_keys(small, tab, width):
    one = tab(small[1].url, width)
    one.switch()
    one.page.locator("#values table").wait_for()
    one.assert_fits()
    # Every control has a name, and the keyboard reaches all that is open.
    unnamed = """() => [...document.querySelectorAll("main input, main button, main summary")]
      .filter((n) => !n.ariaHidden && n.getBoundingClientRect().height && !(n.labels?.length
        ? n.labels[0].textContent.trim() : (n.innerText || n.ariaLabel || "").trim()))
      .map((n) => n.outerHTML)"""
    assert one.page.evaluate(unnamed) == []
    one.page.evaluate("document.activeElement.blur()")
    reached = set()
    for _ in range(30):
        one.page.keyboard.press("Tab")
        reached |= set(one.page.evaluate("(({ id, type }) => [id, type])(document.activeElement)"))
    assert {"write", "checkbox", "radio", "recording"} <= reached
    one.assert_quiet()


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_axe_finds_no_serious_faults(small, tab, width):
    """As it is opened, with all that is folded open, and with an effect switched on."""
    page = tab(small[1].url, width).page
    # No style of the page lets its colours follow the width.
    faults = [serious_faults(page, width == DESK)]
    page.evaluate("document.querySelectorAll('details').forEach((part) => part.open = true)")
    page.locator(".switch input").first.check()
    page.locator("#values table").wait_for()
    faults.append(serious_faults(page, width == DESK))
    assert faults == [[], []]


def test_a_recording_is_zoomed_and_what_is_held_out_is_said(small, tab):
    one = tab(small[1].url)
    page, span = one.page, "document.querySelector('#torque .js-plotly-plot')?._fullLayout"
    page.wait_for_function(f"{span}?.yaxis.range[1] < 20")  # of the elbow, not of the shoulder
    # An empty figure has such a range, too: what is said comes with what is drawn.
    said = "document.querySelector('#held').innerText"
    page.wait_for_function(f"{said} === 'elbow, test.csv (held out)'")
    plot = page.locator("#torque .nsewdrag").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    height = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.4 * box["width"], height)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], height + 2, steps=6)
    page.mouse.up()
    page.wait_for_function(f"{span}.xaxis.range[1] - {span}.xaxis.range[0] < 6")
    near = page.evaluate(f"{span}.xaxis.range")
    drawn = "document.querySelector('#torque .js-plotly-plot').data.at(-1).y[99]"
    old = page.evaluate(drawn)
    one.switch()
    page.wait_for_function(f"(old) => {drawn} !== old", arg=old)
    assert page.evaluate(f"{span}.xaxis.range") == near  # what is looked at stays in sight
    buttons = page.locator("#torque .modebar-btn").evaluate_all("all => all.map(n => n.ariaLabel)")
    assert "Zoom" in buttons and not [one for one in buttons if "hare" in one]  # nothing uploads
    page.locator("#joint input").first.check()
    page.wait_for_function("document.querySelector('#held').innerText.startsWith('shoulder')")
    page.locator("#recording").select_option(label="train.csv (fitted)")
    page.wait_for_function("document.querySelector('#held').innerText.includes('(fitted)')")
    one.assert_quiet()


def test_bars_follow_when_switches_are_flipped_quickly(small, tab):
    one = tab(small[1].url)
    one.switch()
    alone = one.said
    one.switch()
    one.page.locator("summary", has_text="Significant and relevant alone").click()
    for place in (1, 2, 0, 1, 2):
        one.page.locator(".switch input").nth(place).click()
    # On a slow machine what is seen now is of switches that have been flipped again since.
    one.wait_for_answers()
    one.page.locator("#write", has_text="Write 1 effect into").wait_for()
    one.page.locator("#said", has_text=alone).wait_for()
    one.wait_for_bars()
    assert one.page.locator(".switch input").first.is_checked()


def test_values_that_are_worked_out_are_said_to_be(small, tab, monkeypatch):
    """Also while the values of a choice that was replaced meanwhile arrive."""
    done = {1: threading.Event(), 2: threading.Event()}
    original = Refitter.with_intervals

    def waiting(self, effects=()):
        assert done[len(effects)].wait(PATIENCE / 1000)
        return original(self, effects)

    one = tab(small[1].url)
    monkeypatch.setattr(Refitter, "with_intervals", waiting)
    page, working = one.page, one.page.locator("#working")
    page.locator("summary", has_text="Significant and relevant alone").click()
    labels = page.locator(".switch").all_inner_texts()
    (other,) = (k for k, text in enumerate(labels) if "load friction" in text.lower())
    one.switch(other)
    working.get_by_text("Working out").wait_for()
    one.switch()  # dry friction, with which the error falls once more
    done[1].set()
    while len(one.pending) > 1:
        page.wait_for_timeout(100)
    page.wait_for_timeout(500)  # for what the page makes of the answer
    assert working.inner_text().startswith("Working out")
    done[2].set()
    page.wait_for_function("document.querySelectorAll('#values tbody tr').length > 1")
    assert working.inner_text() == ""


def test_impossible_values_are_told(tmp_path, tab, diagnosis):
    """Another effect in the place of dry friction needs a value that no robot has."""
    drag = [one for one in diagnosis.candidates if one.effect.label == "quadratic_drag@elbow"]
    server = explore(
        di.load(write_study(tmp_path)), replace(diagnosis, steps=(), candidates=tuple(drag))
    )
    one = tab(server.url)
    assert "adds nothing" in one.page.locator("#choices").inner_text()
    one.page.locator("summary", has_text="Other effects").click()
    one.switch()
    values = one.page.locator("#values")
    values.locator("table").wait_for()
    assert "Impossible: no robot can have Fq = -" in values.inner_text()
    server.stop()


def test_two_tabs_choose_for_themselves_and_the_second_to_write_is_told(small, tab):
    path, server = small
    one, two = tab(server.url), tab(server.url)
    one.switch()
    assert "Nothing is switched on yet" in two.said
    two.switch()
    assert one.write().startswith(f"Written into study.toml: {HIDDEN}")
    after = path.read_text()
    said = two.write()
    assert "Not written" in said and "has changed since it was read" in said
    assert path.read_text() == after == edited(('friction"]', f'friction", "{HIDDEN}"]'))


def test_a_double_click_writes_once_and_says_so(small, tab):
    path, server = small
    one = tab(server.url)
    one.switch()
    one.page.locator("#write:not([disabled])").dblclick()
    one.page.locator("#written", has_text="Written into").wait_for()
    one.page.locator("#write", has_text="Nothing to write").wait_for()
    one.page.wait_for_timeout(1000)  # for the answer to the second click
    assert one.page.locator("#written").inner_text().startswith("Written into")
    assert one.page.locator("#write").is_disabled()
    assert path.read_text() == edited(('friction"]', f'friction", "{HIDDEN}"]'))


def test_a_study_that_changes_underneath_is_left_alone(small, tab):
    path, server = small
    one = tab(server.url)
    one.switch()
    path.write_text(STUDY + "# somebody else was here\n")
    assert "has changed since it was read" in one.write()
    assert path.read_text() == STUDY + "# somebody else was here\n"
    # A study that cannot be read any more is told, too.
    path.write_text("robot = ")
    one.page.reload()
    one.page.get_by_text("The study cannot be read").wait_for()


def test_a_tab_whose_version_is_gone_is_told(own, tab):
    path, server = own
    one = tab(server.url)
    for round_ in range(5):
        path.write_text(f"{STUDY}# {round_}\n")
        server.versions.latest()
    one.page.locator(".switch input").first.click()
    one.page.locator("#fault", has_text="reload the page").wait_for()


def test_a_killed_server_is_told(tmp_path, tab):
    write_study(tmp_path)
    with by_command(tmp_path) as (url, server):
        one = tab(url)
        assert one.page.locator("#lost").is_hidden()
        server.kill()
        one.page.locator("#lost").wait_for(state="visible")
        assert "The connection is lost" in one.page.locator("#lost").inner_text()
        assert one.page.locator(".dash-error-card, .dash-fe-error__title").count() == 0


def test_what_nobody_has_foreseen_is_told(small, tab, monkeypatch, capfd):
    def broken(self, effects=()):
        raise ValueError("<b>no</b>")

    one = tab(small[1].url)
    monkeypatch.setattr("dynident.explorer.switched_fit.Refitter.with_intervals", broken)
    one.switch()
    fault = one.page.locator("#fault", has_text="Unexpected ValueError: <b>no</b>")
    fault.wait_for()
    assert "Traceback" not in capfd.readouterr().err


def test_a_notebook_shows_it(small, tab):
    """In a frame of a page that comes from elsewhere, which gets no cookie."""
    one = tab(small[1].url).page
    one.set_content(small[1]._repr_html_())
    frame = one.frame_locator("iframe")
    frame.locator(".switch input").first.check()
    frame.locator("#said", has_text="before").wait_for()
    frame.locator("#values table").wait_for()


def test_a_designed_motion_is_opened_and_can_ask_for_nothing(own, tab):
    """Whoever wrote the page that lies beside the study."""
    path, server = own
    folder = path.parent / NASTY.replace("/", "|")
    folder.mkdir()
    # It cannot know the token of the page; here it is told, and still may not ask.
    ask = f"fetch('/{server.token}/_dash-update-component', {{method: 'POST', body: '{{}}'}})"
    script = f"<script>{ask}.then(() => document.title = 'in', () => document.title = 'out')"
    write_design(folder, "", f"{script}</script>")
    one = tab(server.url)
    assert f"{folder.name}/reference.csv is the motion" in one.page.locator("#next").inner_text()
    one.page.locator("#next .js-plotly-plot .scatterlayer .trace").nth(1).wait_for(state="attached")
    with one.page.context.expect_page() as other:
        one.page.locator("#next a").click()
    other.value.wait_for_function("document.title.length > 0")
    assert other.value.title() == "out" and other.value.evaluate("origin") == "null"
    assert server.motions in other.value.url and server.token not in other.value.url
    one.assert_quiet()


def test_names_stay_names(tmp_path, tab):
    """Of the study, its files and its joints, wherever they are drawn or written."""
    joint, name = NASTY, f"{NASTY.replace('/', '|')}.csv"
    path = write_study(tmp_path)
    (tmp_path / "arm.urdf").write_text(ARM.replace('"elbow"', quoteattr(joint)))
    for seed, file in enumerate(("train.csv", name)):
        (tmp_path / file).write_text(csv_text(seed).replace("elbow", joint))
    text = edited(('"elbow"', f'"{joint}"'), ('"test.csv"', f'"{name}"'))
    path = path.rename(tmp_path / f"{NASTY.replace('/', '|')}.toml")
    path.write_text(text)
    study = di.load(path)
    server = explore(study, di.diagnose(study.model, study.train, study.test))
    one = tab(server.url)
    one.switch()
    one.page.locator("#values table").wait_for()
    shown = one.page.locator("main").inner_text()
    assert f"Coulomb friction at {joint}" in shown and name in shown and path.name in shown
    assert f"coulomb_friction@{joint}" in one.write()
    assert one.page.locator("main script").count() == 0
    one.assert_quiet()
    server.stop()
    assert f"coulomb_friction@{joint}" in [e.label for e in di.load(path).model.effects]
