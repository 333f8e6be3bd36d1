"""`fit --consistency`: an estimate whose robot can exist, from the command line."""

from __future__ import annotations

import pytest

from dynident.fitting import load_estimate
from dynident.inertia import margins
from study_files import STUDY


@pytest.mark.parametrize("notion", ["full", "semi"])
def test_the_fit_is_consistent_and_says_what_is_proved(run, study, notion) -> None:
    done = run("fit", study(STUDY), "--consistency", notion, "--out", "estimate.json", "--json")
    assert done.status == 0, done.err
    certificate = done.json["certificate"]
    assert certificate["optimal"]
    assert ("fully" if notion == "full" else "semi") in certificate["notion"]
    assert any("without constraints" in note for note in done.json["notes"])
    robot = load_estimate("estimate.json").robot
    for link in robot.links:
        found = margins(link.phi)
        assert found.semi_consistent
        assert notion == "semi" or found.consistent


def test_without_it_nothing_is_certified(run, study) -> None:
    done = run("fit", study(STUDY), "--json")
    assert done.json["certificate"] is None and done.json["links"] is None


def test_an_unknown_notion_is_refused_with_the_choices(run, study) -> None:
    done = run("fit", study(STUDY), "--consistency", "fully")
    assert done.status == 2 and "full" in done.err and done.out == ""
