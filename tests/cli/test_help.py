"""What the help promises is true."""

from __future__ import annotations

import re
import shlex

import pytest

COMMANDS = ("explain", "diagnose", "fit", "compare", "add", "simulate", "report", "check", "refit")


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_are_accepted(run, name):
    """Every option of an example exists: what is missing is the file, not the option."""
    text = " ".join(run(name, "--help").out.split())
    found = re.search(rf"Example: (dynident {name}.*?) Options:", text)
    assert found
    done = run(*shlex.split(found[1])[1:])
    assert done.status == 2
    assert re.fullmatch(r"error: \w+.(toml|urdf): no such file. check the path\n", done.err)


def test_version(run):
    done = run("--version")
    assert done.status == 0 and re.fullmatch(r"dynident, version [0-9.]+\S*\n", done.out)


def test_json_is_offered_by_every_command(run):
    for name in (*COMMANDS, "demo"):
        assert "--json" in run(name, "--help").out
