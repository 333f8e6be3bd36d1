"""The README keeps up with the code."""

from __future__ import annotations

import re
from pathlib import Path

from dynident.effects import catalogue

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_every_effect_is_in_the_table_and_no_other() -> None:
    assert re.findall(r"^\| `(\w+)` \|", README, re.MULTILINE) != []
    assert sorted(re.findall(r"^\| `(\w+)` \|", README, re.MULTILINE)) == sorted(catalogue())


def test_what_the_readme_links_to_is_there() -> None:
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / target).exists(), target
