"""The report in a real browser."""

import os
import re
import shutil
import subprocess

import pytest

from dynident.report import report
from report.fabricated import diagnosis

BROWSER = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome on the path")


def dumped(path, folder):
    """The page after its scripts have run, and what they wrote to the console."""
    command = [
        str(BROWSER),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}",
        "--window-size=1280,2000",
        "--virtual-time-budget=10000",
        "--dump-dom",
        path.as_uri(),
    ]
    environment = os.environ | {"HOME": str(folder)}
    done = subprocess.run(command, capture_output=True, timeout=120, env=environment)
    log = done.stderr.decode(errors="replace")
    console = [line for line in log.splitlines() if "CONSOLE" in line]
    return done.stdout.decode(errors="replace"), console


@pytest.mark.parametrize(
    "joints",
    [("shoulder", "elbow"), ("a", "$x$ </script><img src=x onerror=alert(2)>")],
    ids=["plain names", "hostile names"],
)
def test_everything_visible_is_drawn_without_complaint(joints, tmp_path):
    found = diagnosis(joints, samples=300)
    page, console = dumped(report(found, tmp_path / "report.html"), tmp_path)
    assert console == []
    drawn = re.findall(r'class="plot js-plotly-plot"', page)
    visible = 6 + 3  # maps of one joint; waterfall, torques, ranking
    assert len(drawn) == visible
    assert page.count('<svg class="main-svg"') >= visible
    assert 'data-title="Share' not in page  # nothing leaves the machine
