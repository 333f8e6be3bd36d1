"""The floors of the house: a room imports only from rooms below it, and nothing goes in circles."""

from __future__ import annotations

import subprocess
import sys

from package_map import FLOORS, circles, imports, modules, room_of

HEIGHT = {room: height for height, rooms in enumerate(FLOORS) for room in rooms}
PLOTTING = {"matplotlib", "plotly"}


def test_imports_go_down_the_floors_only() -> None:
    wrong = []
    for module in modules().values():
        assert module.room in HEIGHT or not module.room, f"'{module.room}' is on no floor"
        others = imports()[module.name] if module.room else ()
        for name, room in ((name, room_of(name)) for name in others):
            if room != module.room and not (room and HEIGHT[room] < HEIGHT[module.room]):
                wrong.append(f"{module.name} imports {name}, which is above it")
    assert wrong == []


def test_no_imports_go_in_circles() -> None:
    """Those inside functions and for type checkers count: what is shared has a place of its own."""
    found = {" ".join(name.removeprefix("dynident.") for name in c) for c in circles(imports())}
    assert found == set()


def test_nothing_imports_the_facade_that_it_stands_behind() -> None:
    """Else whatever the facade imports could lead back, and the order of imports would matter."""
    found = {
        f"{name} {other}".replace("dynident.", "")
        for name, others in imports().items()
        for other in others
        if name.startswith(f"{other}.") and modules()[other].is_facade
        if not name.endswith(".__main__")
    }
    assert found == set()


def test_only_the_report_and_the_page_import_plotting_libraries() -> None:
    """The page draws what is switched on at the moment, which no report holds."""
    users = {
        module.room
        for module in modules().values()
        if {name.split(".")[0] for name in module.names} & PLOTTING
    }
    assert users == {"reporting", "explorer"}


def test_only_the_page_imports_a_web_framework() -> None:
    web = {"dash", "flask", "werkzeug"}
    users = {m.room for m in modules().values() if {n.split(".")[0] for n in m.names} & web}
    assert users == {"explorer"}


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = (
        *("pydrake", "pinocchio", "plotly", "matplotlib", "casadi", "scipy", "pandas", "numpy"),
        "dash",
    )
    code = f"import sys, dynident, dynident.cli; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
