"""Parameters as CSV: every layout says the same, and what is wrong with one is said in a line."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.errors import DynidentWarning, FileError
from dynident.fitting import read_parameters
from dynident.inertia import PAPER_ORDER, PARAMETERS, to_paper
from dynident.model import Model
from dynident.robot import Robot
from synthetic import ARM, arm

GIVEN = {
    "upper": np.array([3.0, 0.6, 0.1, 0.2, 0.5, 0.01, 0.6, 0.02, 0.03, 0.7]),
    "fore": np.array([2.0, 0.3, 0.0, 0.1, 0.4, 0.0, 0.3, 0.01, 0.0, 0.2]),
}
WELDED = ARM.replace(
    "</robot>",
    """<link name="tool"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
    <joint name="weld" type="fixed"><parent link="fore"/><child link="tool"/>
    <origin xyz="0.3 0 0"/></joint></robot>""",
)
"""The arm with a tool fixed to its fore."""


def line(values):
    return ",".join(repr(float(x)) for x in np.ravel(values))


def by_name(sep=","):
    pairs = [
        f"{p}.{link}{sep}{x!r}"
        for link, phi in GIVEN.items()
        for p, x in zip(PARAMETERS, phi.tolist(), strict=True)
    ]
    return "\n".join([f"name{sep}value", *pairs]) + "\n"


def by_link(order=PARAMETERS, names=None):
    places = [PARAMETERS.index(name) for name in order]
    rows = [f"{link},{line(phi[places])}" for link, phi in reversed(GIVEN.items())]
    return "\n".join([",".join(["link", *(names or order)]), *rows]) + "\n"


PAPER_NAMES = ("m", "mcx", "mcy", "mcz", "I11", "I12", "I13", "I22", "I23", "I33")
LAYOUTS = {
    "by name": (by_name(), None),
    "by name, semicolons": (by_name(";"), None),
    "by name, tabs and blanks": (by_name(" \t "), None),
    "by name, more columns": (
        "\n".join(f"{x},kg,{i}" for i, x in enumerate(by_name().splitlines())).replace(
            "value,kg,0", "value,unit,row"
        ),
        None,
    ),
    "by name, any order": (
        "\n".join(["name,value", *sorted(by_name().splitlines()[1:])]),
        None,
    ),
    "by link": (by_link(), None),
    "by link, papers' order": (by_link(PAPER_ORDER), None),
    "by link, papers' names": (by_link(PAPER_ORDER, PAPER_NAMES), None),
    "by link, comments and CRLF": ("# mine\r\n\r\n" + by_link().replace("\n", "\r\n"), None),
    "by joint": (
        "\n".join([",".join(PARAMETERS), *(line(phi) for phi in GIVEN.values())]),
        None,
    ),
    "column": ("x\n" + line(list(GIVEN.values())).replace(",", "\n"), "dynident"),
    "column without header": (line(list(GIVEN.values())).replace(",", "\n"), "dynident"),
    "row": (line(list(GIVEN.values())), "dynident"),
    "table": ("\n".join(line(phi) for phi in GIVEN.values()), "dynident"),
    "papers' row": (line([to_paper(phi) for phi in GIVEN.values()]), "paper"),
}


def written(tmp_path, text):
    path = tmp_path / "given.csv"
    path.write_text(text, newline="")
    return path


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(tmp_path, layout):
    text, order = LAYOUTS[layout]
    given = read_parameters(written(tmp_path, text), arm(), order)
    found = {link.name: link.phi for link in given.robot.links}
    for name, phi in GIVEN.items():
        np.testing.assert_allclose(found[name], phi, rtol=1e-14, atol=1e-16)
    np.testing.assert_array_equal(found["base"], np.zeros(10))
    assert given.effects == {} and given.described.theta[0] == 4.0


FRICTION = {"Fv@shoulder": 2.0, "Fv@elbow": 1.0}
ELEVEN = [np.append(to_paper(phi), x) for phi, x in zip(GIVEN.values(), (2, 1), strict=True)]
WITH_FRICTION = {
    "by name": (by_name() + "Fv@shoulder,2\nFv@elbow,1\n", None),
    "by link": (
        "\n".join(
            f"{x},{y}" for x, y in zip(by_link().splitlines(), ("viscous", "1", "2"), strict=True)
        ),
        None,
    ),
    "eleven of each": (line(ELEVEN), "paper"),
}


@pytest.mark.parametrize("layout", WITH_FRICTION)
def test_friction(tmp_path, layout):
    text, order = WITH_FRICTION[layout]
    model = Model(arm()) + "viscous_friction"
    given = read_parameters(written(tmp_path, text), model, order)
    assert given.effects == FRICTION
    if layout == "by name":
        with pytest.raises(FileError, match=r"name Fv@shoulder: no such parameter.*none"):
            read_parameters(written(tmp_path, text), arm(), order)
    else:
        with pytest.warns(DynidentWarning, match="viscous friction is not in the model"):
            given = read_parameters(written(tmp_path, text), arm(), order)
        assert given.effects == {}


def test_bodies_of_several_links(tmp_path):
    """Names mean links; numbers without names mean what moves with a joint."""
    robot = Robot.from_text(WELDED)
    with pytest.raises(FileError, match=r"no value of m.tool, mx.tool, .* and 5 more"):
        read_parameters(written(tmp_path, by_name()), robot)
    tool = "".join(f"{p}.tool,0\n" for p in PARAMETERS)
    given = read_parameters(written(tmp_path, by_name() + tool), robot)
    np.testing.assert_allclose(given.robot.theta, np.concatenate(list(GIVEN.values())), atol=1e-15)
    text = line(list(GIVEN.values()))
    given = read_parameters(written(tmp_path, text), robot, "dynident")
    np.testing.assert_allclose(given.robot.theta, np.concatenate(list(GIVEN.values())), atol=1e-14)
    np.testing.assert_array_equal(given.robot.links[-1].phi, robot.links[-1].phi)


NAMED, LINKED = by_name(), by_link()
BAD = {
    "empty": ("", None, r"given.csv: is empty. write columns name, value; or link"),
    "blank": ("\n\n", None, r"is empty"),
    "binary": ("\0\0\0", None, r"is not text"),
    "no layout": ("a,b\n1,2\n", None, r"header: no layout is known. write columns name, value"),
    "no order": (line(np.ones(20)), None, r"numbers, and no order.*\(dynident, paper\)"),
    "unknown order": (line(np.ones(20)), "mine", r"no order 'mine'.* orders: dynident, paper"),
    "order twice": (NAMED, "paper", r"the header names the parameters.* leave out the order"),
    "order twice, by link": (LINKED, "paper", r"leave out the order 'paper'"),
    "unknown link": (
        NAMED.replace("m.upper", "m.uper"),
        None,
        r"name m.uper: no such parameter. did you mean 'upper'\? Valid names: base, upper, fore",
    ),
    "unknown parameter": (NAMED.replace("mx.", "x."), None, r"x.upper: no such .*: m.<link>, mx"),
    "unknown row": (
        LINKED.replace("upper", "uper"),
        None,
        r"link uper: the robot has no such link. did you mean 'upper'",
    ),
    "missing parameter": (NAMED.replace("Izz.fore,0.2\n", ""), None, r"no value of Izz.fore\."),
    "missing link": (
        "\n".join(LINKED.splitlines()[:2]),
        None,
        r"no value of m.upper, mx.upper, .* and 5 more",
    ),
    "missing column": (LINKED.replace("Izz", "Izzz"), None, r"no column Izz\. a column is needed"),
    "twice": (NAMED + "m.upper,1\n", None, r"name m.upper: the parameter is there twice"),
    "twice by another name": (NAMED + "I11.fore,1\n", None, r"name I11.fore: .*there twice"),
    "row twice": (LINKED + LINKED.splitlines()[1], None, r"link fore: the link is there twice"),
    "column twice": (LINKED.replace("mz", "my"), None, r"no column mz"),
    "column of both names": (
        "\n".join(f"{x},{y}" for x, y in zip(LINKED.split(), ("I33", "1", "1"), strict=True)),
        None,
        r"has two columns for Izz. keep one",
    ),
    "NaN": (NAMED.replace("3.0", "nan"), None, r"name m.upper: 'nan' is not a finite number"),
    "infinite": (LINKED.replace("3.0", "inf"), None, r"link upper, m: 'inf' is not a finite"),
    "text": (LINKED.replace("3.0", "three"), None, r"link upper, m: 'three' is not a number"),
    "no cell": (NAMED.replace(",3.0", ","), None, r"name m.upper: the cell is empty"),
    "line too long": (NAMED + "m.upper,1,2\n", None, r"not a table \(Expected 2 fields in line"),
    "line too short": (LINKED.replace(",0.7", ""), None, r"link upper, Izz: the cell is empty"),
    "count": (
        line(np.ones(19)),
        "paper",
        r"19 numbers for 2 moving bodies \(upper, fore\). 20 are needed, or 22 with the viscous",
    ),
    "rows": (
        "\n".join([",".join(PARAMETERS), line(np.ones(10))]),
        None,
        r"10 numbers for 2 moving bodies",
    ),
    "text among numbers": ("x\n1\ntwo\n", "paper", r"given.csv, number 2: 'two' is not a number"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_files(tmp_path, kind):
    text, order, message = BAD[kind]
    with pytest.raises(FileError, match=message) as caught:
        read_parameters(written(tmp_path, text), arm(), order)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400
