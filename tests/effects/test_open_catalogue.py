"""A class joins the catalogue when it is defined, in any file; two of one name are refused."""

from __future__ import annotations

import importlib
import importlib.util
import os
import subprocess
import sys
from abc import abstractmethod
from pathlib import Path

import pytest

from dynident.effects import Effect, JointEffect, Parameter, catalogue, effects_of
from dynident.effects.friction.viscous_friction import ViscousFriction
from dynident.errors import EffectError
from dynident.model import Model
from synthetic import arm

SAG = """from dynident.effects import JointEffect, Parameter

class {kind}(JointEffect):
    name = "{name}"
    law = "c q^3"
    sign_of = "a cubic of the position"
    experiment = "move {{joint}} far"

    def parameters(self, robot):
        return (Parameter("c", "N m/rad"),)

    def at_joint(self, block):
        return block.q[:, [block.index(self.joint)]] ** 3
"""


def sag(name: str = "cable_sag", kind: str = "CableSag") -> str:
    return SAG.format(name=name, kind=kind)


def cell(text: str, number: int = 1) -> type[Effect]:
    """Run a notebook's cell; the class that it defines."""
    space: dict = {"__name__": "__main__"}
    exec(compile(text, f"<cell {number}>", "exec"), space)
    return next(v for k, v in reversed(space.items()) if k in ("CableSag", "Other", "_Hidden"))


def module(folder: Path, name: str, text: str):
    (folder / f"{name}.py").write_text(text)
    importlib.invalidate_caches()
    return importlib.import_module(name)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name, one in list(sys.modules.items()):
        if str(getattr(one, "__file__", "")).startswith(str(tmp_path)):
            del sys.modules[name]


def test_a_class_joins_when_it_is_defined_and_can_be_added(folder):
    assert "cable_sag" not in catalogue()
    found = module(folder, "lab_effects", sag())
    assert catalogue()["cable_sag"] is found.CableSag
    assert list(catalogue()) == sorted(catalogue())
    model = Model(arm()) + "cable_sag@elbow"
    assert isinstance(model.effects[0], found.CableSag)
    with pytest.raises(EffectError, match="did you mean 'cable_sag'"):
        effects_of("cable_sg@elbow", arm())


def test_what_was_asked_before_does_not_count():
    """No cache: what is defined between two questions is in the second answer."""
    before = catalogue()
    kind = cell(sag())
    assert "cable_sag" not in before
    assert {*catalogue()} - {*before} == {kind.name}


def test_internal_classes_stay_out():
    before = set(catalogue())

    class Switched(ViscousFriction):
        name = "switched"
        in_catalogue = False

    class Below(Switched):
        name = "below"

    class Nameless(ViscousFriction):
        pass

    class Underscore(ViscousFriction):
        name = "_underscore"

    class _Private(ViscousFriction):
        name = "private"

    class Abstract(JointEffect):
        name = "abstract"

        @abstractmethod
        def depth(self) -> float: ...

    assert set(catalogue()) == before
    assert catalogue()["viscous_friction"] is ViscousFriction

    class Concrete(Abstract):
        name = "concrete"

        def depth(self) -> float:
            return 1.0

        def parameters(self, robot):
            return (Parameter("c", "N m"),)

        def at_joint(self, block):
            return block.q[:, :1]

    assert catalogue()["concrete"] is Concrete


def test_two_classes_of_one_name_are_refused_with_both_places(folder):
    module(folder, "first", sag())
    with pytest.raises(EffectError) as told:
        module(folder, "second", "\n\n" + sag())
    said = str(told.value)
    assert f"CableSag ({folder / 'first.py'}:3)" in said
    assert f"CableSag ({folder / 'second.py'}:5)" in said
    assert "\n" not in said and "rename" in said
    assert catalogue()["cable_sag"].__module__ == "first"


def test_two_classes_of_one_file_are_refused(folder):
    with pytest.raises(EffectError, match=r"CableSag \(.*lab.py:3\) and Other \(.*lab.py:15\)"):
        module(folder, "lab", sag() + sag(kind="Other").partition("\n")[2])


def test_a_name_of_the_package_is_taken():
    with pytest.raises(EffectError, match=r"ViscousFriction \(.*viscous_friction.py:\d+\) and"):
        cell(sag("viscous_friction"))
    assert catalogue()["viscous_friction"] is ViscousFriction


def test_own_names_are_taken_before_anybody_asks_for_the_catalogue():
    code = (
        "from dynident.effects.effect import JointEffect\n"
        "try:\n class Mine(JointEffect):\n  name = 'backlash'\n"
        "  def parameters(self, robot): ...\n  def at_joint(self, block): ...\n"
        "except Exception as error: print(type(error).__name__, error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("EffectError two effects are named 'backlash': Backlash (")


def test_a_cell_run_again_replaces_its_class():
    first = cell(sag())
    again = cell(sag(), 2)
    assert first is not again and catalogue()["cable_sag"] is again
    cell(sag("cable_slack"), 3)  # the effect has another name now: the old one is gone
    assert "cable_sag" not in catalogue() and "cable_slack" in catalogue()
    with pytest.raises(EffectError, match=r"cell 3.*cell 4"):
        cell(sag("cable_slack", "Other"), 4)


def test_a_module_reloaded_replaces_its_classes(folder):
    found = module(folder, "lab", sag())
    old = catalogue()["cable_sag"]
    (folder / "lab.py").write_text("# longer than before\n" + sag())
    importlib.reload(found)
    assert catalogue()["cable_sag"] is not old
    assert catalogue()["cable_sag"] is found.CableSag


def test_one_file_under_two_names_is_one_effect(folder):
    (folder / "lab").mkdir()
    (folder / "lab" / "__init__.py").write_text("")
    (folder / "lab" / "laws.py").write_text(sag())
    importlib.invalidate_caches()
    importlib.import_module("lab.laws")
    spec = importlib.util.spec_from_file_location("laws_alone", folder / "lab" / "laws.py")
    assert spec is not None and spec.loader is not None
    other = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(other)
    assert catalogue()["cable_sag"] is other.CableSag


def test_a_function_makes_several_and_each_again():
    def law(power: int) -> type[Effect]:
        class Power(ViscousFriction):
            name = f"power_{power}"

        return Power

    made = [law(3), law(5), law(3)]
    assert catalogue()["power_3"] is made[2] and catalogue()["power_5"] is made[1]


@pytest.mark.parametrize("name", ["cable sag", "cable@sag", "2nd", "", "law:wave"])
def test_a_name_that_no_study_could_hold_is_refused(name):
    with pytest.raises(EffectError, match="cannot be written in a study"):
        cell(sag(name))


ASK = """
import warnings
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    from dynident.effects import catalogue
    print(*[name for name in catalogue() if name.startswith("cable")], sep=",")
    catalogue()
print(*[f"{w.category.__name__}: {w.message}" for w in told], sep="|")
"""


def installed(folder: Path, name: str, text: str) -> None:
    """A package with an entry point, as an installer leaves it."""
    (folder / f"{name}.py").write_text(text)
    meta = folder / f"{name}-1.0.dist-info"
    meta.mkdir()
    (meta / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (meta / "entry_points.txt").write_text(f"[dynident.effects]\nall = {name}\n")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 / 0\n", "ZeroDivisionError: division by zero"),
        ("import sys; sys.exit('no')\n", "SystemExit: no"),
        ("def\n", "SyntaxError: "),
        (sag("cable_half") + "import no_such_module\n", "No module named 'no_such_module'"),
        (sag("cable_sag", "Rival"), "two effects are named 'cable_sag'"),
    ],
    ids=["error", "exit", "syntax", "import", "clash"],
)
@pytest.mark.slow
def test_packages_bring_effects_and_a_broken_one_is_a_warning(tmp_path, monkeypatch, text, reason):
    installed(tmp_path, "good_cables", sag())
    installed(tmp_path, "the_broken_one", text)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    done = subprocess.run([sys.executable, "-c", ASK], capture_output=True, text=True, check=True)
    names, warned = done.stdout.splitlines()
    assert names == "cable_sag"
    assert warned.count("DynidentWarning: effects of the package") == 1, warned
    assert "the_broken_one" in warned and reason in warned
