"""Effects from files that a study names: run only when trusted, once, and never half."""

from __future__ import annotations

import hashlib
import importlib
import re
import stat
import sys
from pathlib import Path

import pytest

import dynident as di
from dynident.effect_modules import remember
from dynident.effect_modules.user_module import UserModule
from dynident.effects import catalogue
from dynident.errors import DynidentError, FileError, StudyError, UntrustedError
from study_files import STUDY, write_study
from user_effects import HOSTILE, PLACES, SAG, UNSOUND, own_settings, put, put_place

WITH_MODULE = STUDY.replace(
    'effects = ["viscous_friction"]',
    'effects = ["viscous_friction"]\neffect_modules = ["mine.py"]',
)
ADDED = WITH_MODULE.replace('["viscous_friction"]', '["viscous_friction", "cable_sag@elbow"]')
COUNTED = "import os\nos.write(os.open('{0}', os.O_APPEND | os.O_CREAT | os.O_WRONLY), b'x')\n"

__all__ = ["own_settings"]
pytestmark = pytest.mark.usefixtures("own_settings")


def sha256(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()


@pytest.fixture
def folder(tmp_path):
    yield tmp_path
    for name, one in list(sys.modules.items()):
        if str(getattr(one, "__file__", "")).startswith(str(tmp_path)):
            del sys.modules[name]


def study(folder: Path, content: str = SAG, text: str = ADDED) -> Path:
    folder.mkdir(exist_ok=True)
    put(folder / "mine.py", content)
    return write_study(folder, text)


def runs(folder: Path) -> int:
    """How often a module with `COUNTED` has run."""
    path = folder / "ran"
    return path.stat().st_size if path.exists() else 0


def test_a_study_brings_its_effects(folder):
    found = di.load(study(folder), modules="run")
    assert "cable_sag@elbow" in found.model
    assert found.model.effects[-1] == catalogue()["cable_sag"]("elbow")
    assert "c@elbow" in found.model.names


def test_code_that_nobody_trusts_is_not_run(folder):
    path = study(folder, COUNTED.format(folder / "ran") + SAG)
    with pytest.raises(UntrustedError) as told:
        di.load(path)
    said = str(told.value)
    assert str(folder / "mine.py") in said and "--trust" in said and "\n" not in said
    assert told.value.modules[0][1] == hashlib.sha256((folder / "mine.py").read_bytes()).hexdigest()
    assert runs(folder) == 0 and "cable_sag" not in catalogue()


def test_a_yes_is_remembered_by_content_and_for_this_user_alone(folder, own_settings):
    path = study(folder)
    remember([sha256(SAG)])
    assert "cable_sag@elbow" in di.load(path).model
    (kept,) = (own_settings / "dynident").iterdir()
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600
    assert stat.S_IMODE(kept.parent.stat().st_mode) == 0o700
    changed = SAG.replace("sin(3", "sin(4")
    with pytest.raises(UntrustedError):
        di.load(study(folder, changed))
    remember([sha256(changed)])
    di.load(path)
    put(folder / "mine.py", SAG)  # the first yes still holds
    di.load(path)
    assert len(kept.read_text().split()) == 2


@pytest.mark.parametrize("fault", ["file", "folder", "junk"])
def test_what_others_could_have_written_is_no_yes(folder, own_settings, fault):
    path = study(folder)
    remember([sha256(SAG)])
    kept = own_settings / "dynident" / "trusted_effect_modules"
    if fault == "junk":
        kept.write_text(f"trust {sha256(SAG)} and all else\n")
    else:
        (kept if fault == "file" else kept.parent).chmod(0o777)
    with pytest.raises(UntrustedError):
        di.load(path)
    if fault != "junk":
        with pytest.raises(FileError, match="may be written by other users"):
            remember(["0" * 64])


def test_a_run_without_a_yes_is_not_remembered(folder, own_settings):
    di.load(study(folder), modules="run")
    assert list(own_settings.iterdir()) == []


def test_what_this_process_has_imported_is_trusted(folder, monkeypatch):
    path = study(folder, COUNTED.format(folder / "ran") + SAG)
    di.load(path, modules="run")
    di.load(path)
    assert runs(folder) == 1
    other = study(folder / "other", COUNTED.format(folder / "ran") + SAG.replace("_sag", "_lag"))
    monkeypatch.syspath_prepend(str(folder / "other"))
    importlib.import_module("mine")
    text = ADDED.replace("cable_sag", "cable_lag")
    assert "cable_lag@elbow" in di.load(write_study(folder / "other", text)).model
    assert runs(folder) == 2 and other.exists()


def test_a_link_is_the_file_that_it_leads_to(folder):
    path = study(folder, COUNTED.format(folder / "ran") + SAG)
    (folder / "mine.py").rename(folder / "real.py")
    (folder / "mine.py").symlink_to("real.py")
    di.load(path, modules="run")
    di.load(write_study(folder, ADDED.replace("mine.py", "real.py")))
    assert runs(folder) == 1


def test_another_content_is_run_and_replaces_the_first(folder):
    path = study(folder)
    di.load(path, modules="run")
    old = catalogue()["cable_sag"]
    changed = SAG.replace("class CableSag", "class CableDrag").replace("sin(3", "sin(4")
    study(folder, changed)
    di.load(path, modules="run")
    assert catalogue()["cable_sag"] is not old
    assert catalogue()["cable_sag"].__name__ == "CableDrag"


def test_a_class_that_is_gone_from_the_file_is_gone(folder):
    path = study(folder)
    di.load(path, modules="run")
    study(folder, SAG.replace("cable_sag", "cable_lag"))
    with pytest.raises(StudyError, match=r"no effect is named 'cable_sag'.*did you mean"):
        di.load(path, modules="run")


def test_a_content_that_fails_leaves_the_last_that_did_not(folder):
    path = study(folder)
    di.load(path, modules="run")
    old = catalogue()["cable_sag"]
    study(folder, SAG + "1 / 0\n")
    with pytest.raises(StudyError, match="ZeroDivisionError"):
        di.load(path, modules="run")
    assert catalogue()["cable_sag"] is old
    assert sys.modules[old.__module__].CableSag is old


def test_a_folder_that_was_copied_brings_no_clash(folder):
    for name in ("one", "two"):
        assert "cable_sag@elbow" in di.load(study(folder / name), modules="run").model
    with pytest.raises(StudyError, match=r"two effects are named 'cable_sag'.*one.mine.py.*three"):
        di.load(study(folder / "three", SAG + "# ours\n"), modules="run")


def test_the_content_that_was_judged_is_what_runs(folder, monkeypatch):
    """Even if the file is another one a moment later."""
    path = study(folder)
    remember([sha256(SAG)])
    read = UserModule.read

    def read_then_swap(where: Path) -> UserModule:
        found = read(where)
        where.write_text("raise SystemExit('another file')")
        return found

    monkeypatch.setattr(UserModule, "read", read_then_swap)
    assert "cable_sag@elbow" in di.load(path).model


def test_what_a_module_prints_does_not_stand_in_the_answer(folder, capsys):
    di.load(study(folder, "print('hello')\n" + SAG), modules="run")
    said = capsys.readouterr()
    assert said.out == "" and said.err == "hello\n"


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_modules_are_one_line_and_leave_nothing(folder, kind):
    content, words = HOSTILE[kind]
    path = write_study(folder, WITH_MODULE)
    put(folder / "mine.py", content)
    before = dict(catalogue()), set(sys.modules)
    refused(path, words)
    assert (dict(catalogue()), set(sys.modules)) == before


@pytest.mark.parametrize("kind", UNSOUND)
def test_effects_that_are_none_are_one_line(folder, kind):
    content, words = UNSOUND[kind]
    path = write_study(folder, WITH_MODULE)
    put(folder / "mine.py", content)
    refused(path, words)


@pytest.mark.parametrize("place", PLACES)
def test_what_is_no_module_is_one_line(folder, place):
    name = put_place(folder, place)
    refused(write_study(folder, WITH_MODULE.replace("mine.py", name)), PLACES[place])


def refused(path: Path, words: str) -> None:
    with pytest.raises(DynidentError) as told:
        di.load(path, modules="run")
    said = str(told.value)
    assert re.search(words, said), said
    assert len(said.splitlines()) == 1 and len(said) < 600 + 3 * len(str(path.parent))


@pytest.mark.parametrize("said", ['"mine.py"', "[1]", "{ a = 1 }", "[[]]"])
def test_a_list_of_files_is_needed(folder, said):
    path = write_study(folder, WITH_MODULE.replace('["mine.py"]', said))
    with pytest.raises(StudyError, match="effect_modules"):
        di.load(path, modules="run")


def test_a_permission_that_is_none_is_refused(folder):
    with pytest.raises(StudyError, match="say 'trusted' or 'run'"):
        di.load(study(folder), modules="yes")  # type: ignore[arg-type]


def test_a_yes_that_cannot_be_kept_is_said(own_settings):
    own_settings.rmdir()
    own_settings.write_text("a file where the folder should be")  # which stops root, too
    with pytest.raises(FileError, match="cannot be made"):
        remember(["0" * 64])
    assert own_settings.is_file()
