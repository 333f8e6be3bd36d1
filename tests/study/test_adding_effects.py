"""What `add_effects` returns: the digest of what it wrote, whoever writes next."""

from __future__ import annotations

import pytest

import dynident as di
from dynident import files
from dynident.study import add_effects, study_digest
from study_files import STUDY, write_study


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_digest_is_that_of_what_was_written(tmp_path, monkeypatch, newline):
    path = write_study(tmp_path)
    path.write_bytes(STUDY.replace("\n", newline).encode())
    study, wrote = di.load(path), []
    assert study.digest == study_digest(path)
    effects = di.effects_of("coulomb_friction@elbow", study.robot)
    write_text = files.write_text

    def overtaken(to, text):
        """Somebody else writes as soon as this is done."""
        done = write_text(to, text)
        wrote.append(study_digest(path))
        path.write_text(STUDY + "# mine\n")
        return done

    monkeypatch.setattr(files, "write_text", overtaken)
    assert [add_effects(path, effects)] == wrote
    assert study_digest(path) not in wrote
