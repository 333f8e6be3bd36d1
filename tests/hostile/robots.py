"""Hostile robot descriptions."""

from __future__ import annotations

import codecs
import os

from hostile.case import ANSWER, Content, HostileCase, folder, hole, link_to
from study_files import edited
from synthetic import ARM

CHECK = ("check",)
BOMB = """<!DOCTYPE r [<!ENTITY a "ha">""" + "".join(
    f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)

IN_A_STUDY = {
    "empty": ("", r"arm.urdf: .*XML|empty"),
    "not XML": ("robot: arm", r"arm.urdf: .*XML"),
    "billion laughs": (BOMB + "]><robot>&i;</robot>", r"arm.urdf: .*(entit|DOCTYPE|DTD)"),
    "no joints": ('<robot name="arm"><link name="a"/></robot>', r"arm.urdf: .*joint"),
    "floating base": (edited(('type="revolute"', 'type="floating"'), text=ARM), r"floating"),
    "mimic": (
        edited(("<axis", '<mimic joint="shoulder"/><axis'), text=ARM),
        r"joint '\w+': mimics",
    ),
    "closed chain": (
        edited(
            (
                "</robot>",
                '<joint name="loop" type="revolute"><parent link="base"/><child link="fore"/>'
                '<axis xyz="0 0 1"/></joint></robot>',
            ),
            text=ARM,
        ),
        r"fore.*(loop|elbow)",
    ),
    "NaN inertia": (
        edited(('izz="0.06"', 'izz="nan"'), text=ARM),
        r"arm.urdf: link 'upper': its inertia is not finite. fix",
    ),
    "text for a number": (edited(('value="4"', 'value="heavy"'), text=ARM), r"'heavy'"),
    "unknown parent": (edited(('parent link="base"', 'parent link="bas"'), text=ARM), r"'bas'"),
}
"""Read because a study names them."""


def arm(old: str, new: str) -> str:
    return edited((old, new), text=ARM)


def chain(n: int) -> str:
    """A chain of n links, each with a mass."""
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        "</inertial>"
    )
    links = "".join(f'<link name="l{k}">{inertial}</link>' for k in range(n))
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<axis xyz="0 0 1"/></joint>'
        for k in range(n - 1)
    )
    return f'<robot name="long">{links}{joints}</robot>'


XACRO = '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
BODY = (
    '<body name="a"><joint name="j" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
)
MJCF = "<mujoco>{}<worldbody>" + BODY + "</worldbody></mujoco>"
SDF = (
    '<sdf version="1.9"><model name="m"><link name="a"/><link name="b"><inertial><mass>1</mass>'
    "<inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>"
    '<joint name="w" type="fixed"><parent>world</parent><child>a</child></joint>'
    '<joint name="j" type="revolute"><parent>a</parent><child>b</child>'
    "<axis><xyz>0 0 1</xyz></axis></joint>{}</model></sdf>"
)


def mesh(name: str) -> str:
    """The arm with a mesh at its second link."""
    shape = f'<visual><geometry><mesh filename="{name}"/></geometry></visual>'
    return arm('<link name="fore">', '<link name="fore">' + shape)


CHECKED: dict[str, tuple[str, Content, str]] = {
    # What is under the name
    "a folder": ("a.urdf", folder, r"a\.urdf: is a folder, not a file"),
    "a pipe": (
        "a.urdf",
        os.mkfifo,
        r"a\.urdf: is not a regular file, but a device, a pipe or a socket",
    ),
    "/dev/zero": (
        "a.urdf",
        link_to("/dev/zero"),
        r"a\.urdf: is not a regular file, but a device, a pipe or a socket",
    ),
    "/dev/stdin": (
        "a.urdf",
        link_to("/dev/full"),
        r"a\.urdf: is not a regular file, but a device, a pipe or a socket",
    ),
    "a link to itself": ("a.urdf", link_to("a.urdf"), r"a\.urdf: cannot be read"),
    "a link to nothing": ("a.urdf", link_to("nothing"), r"a\.urdf: no such file"),
    "memory of the process": ("a.urdf", link_to("/proc/self/mem"), r"a\.urdf: cannot be read"),
    "a file of the system": (
        "a.urdf",
        link_to("/proc/self/status"),
        r"a\.urdf: is neither a robot description nor a saved estimate",
    ),
    "a hole of 1 TB": ("a.urdf", hole(1 << 40), r"a\.urdf: holds 1024 GB, and 64 MB is the limit"),
    "zeros": (
        "a.urdf",
        b"\0" * 100_000,
        r"a\.urdf: is neither a robot description nor a saved estimate",
    ),
    "no suffix": ("robot", ARM, ANSWER),
    "another suffix": ("a.csv", ARM, ANSWER),
    "suffix of another format": ("a.sdf", ARM, ANSWER),
    "a name with a line break": (
        "a\nb.urdf",
        "junk",
        r"a b\.urdf: is neither a robot description nor a saved estimate",
    ),
    "a name that paints the terminal": (
        "\x1b[31m\u202ea.urdf",
        "junk",
        r"\\u001b\[31m\\u202ea\.urdf: is neither a robot description nor a saved estim",
    ),
    # Bytes
    "UTF-16": ("a.urdf", ARM.encode("utf-16"), r"a\.urdf: is not UTF-8 text"),
    "UTF-32": ("a.urdf", ARM.encode("utf-32"), r"a\.urdf: is not UTF-8 text"),
    "Latin 1": (
        "a.urdf",
        ARM.replace("arm", "\xe4rm").encode("latin-1"),
        r"a\.urdf: is not UTF-8 text",
    ),
    "a byte order mark": ("a.urdf", codecs.BOM_UTF8 + ARM.encode(), ANSWER),
    "lines of Windows": ("a.urdf", ARM.replace("\n", "\r\n"), ANSWER),
    "lines of old Macs": ("a.urdf", ARM.replace("\n", "\r"), ANSWER),
    "a declaration of another encoding": (
        "a.urdf",
        '<?xml version="1.0" encoding="utf-16"?>' + ARM,
        ANSWER,
    ),
    "an encoding that nobody knows": ("a.urdf", '<?xml version="1.0" encoding="x"?>' + ARM, ANSWER),
    "gzip": ("a.urdf", b"\x1f\x8b\x08" + bytes(200), r"a\.urdf: is not UTF-8 text"),
    "an archive": (
        "a.urdf",
        b"PK\x03\x04" + bytes(200),
        r"a\.urdf: is neither a robot description nor a saved estimate",
    ),
    "JSON": ("a.urdf", '{"robot": 1}', r"a\.urdf: is not a dynident estimate"),
    "JSON under its name": ("a.json", '{"robot": 1}', r"a\.json: is not a dynident estimate"),
    "a page of the web": (
        "a.urdf",
        "<!DOCTYPE html><html><body>404</body></html>",
        r"a\.urdf: declares a DOCTYPE, which a robot description does not need and",
    ),
    "two robots": (
        "a.urdf",
        ARM + ARM,
        r"a\.urdf: is not well-formed XML: junk after document element",
    ),
    "an external entity": (
        "a.urdf",
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>',
        r"a\.urdf: declares a DOCTYPE, which a robot description does not need and",
    ),
    "an external document type": (
        "a.urdf",
        '<!DOCTYPE robot SYSTEM "http://x/y.dtd">' + ARM,
        r"a\.urdf: declares a DOCTYPE, which a robot description does not need and",
    ),
    "a processing instruction": ("a.urdf", '<?php system("ls") ?>' + ARM, ANSWER),
    "an inclusion of XML": (
        "a.urdf",
        '<robot name="a" xmlns:xi="http://www.w3.org/2001/XInclude">'
        '<xi:include href="/etc/passwd" parse="text"/></robot>',
        r"a\.urdf: has no links",
    ),
    "very deep": (
        "a.urdf",
        "<robot>" * 200_000,
        r"a\.urdf: nests more than 200 elements in each other",
    ),
    "very wide": (
        "a.urdf",
        '<robot name="a">' + "<link/>" * 300_000 + "</robot>",
        r"a\.urdf: has 300000 links, and 4096 is the limit",
    ),
    "an attribute of 10 MB": (
        "a.urdf",
        f'<robot name="{"x" * 10_000_000}"/>',
        r"a\.urdf: has no links",
    ),
    "a million attributes": (
        "a.urdf",
        "<robot " + " ".join(f'a{k}=""' for k in range(200_000)) + "/>",
        r"a\.urdf: has no links",
    ),
    "an attribute twice": (
        "a.urdf",
        '<robot name="a" name="b"/>',
        r"a\.urdf: is not well-formed XML: duplicate attribute",
    ),
    # Xacro and inclusion
    "xacro that includes itself": (
        "a.xacro",
        XACRO.format('<xacro:include filename="a.xacro"/>'),
        r"a\.xacro: is a xacro file",
    ),
    "xacro that calls itself": (
        "a.urdf",
        XACRO.format('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>'),
        r"a\.urdf: is a xacro file",
    ),
    "xacro that evaluates": (
        "a.urdf",
        XACRO.format("<link name=\"${__import__('os').system('touch PWNED')}\"/>"),
        ANSWER,
    ),
    "MJCF that includes itself": (
        "a.xml",
        MJCF.format('<include file="a.xml"/>'),
        r"a\.xml: has a <include> element, which is not supported",
    ),
    "SDF that includes itself": (
        "a.sdf",
        SDF.format("<include><uri>a.sdf</uri></include>"),
        r"a\.sdf: includes another model",
    ),
    # Numbers
    "mass of -1": ("a.urdf", arm('value="4"', 'value="-1"'), ANSWER),
    "mass of -0": ("a.urdf", arm('value="4"', 'value="-0.0"'), ANSWER),
    "mass of 1e308": ("a.urdf", arm('value="4"', 'value="1e308"'), ANSWER),
    "mass of 1e999": ("a.urdf", arm('value="4"', 'value="1e999"'), ANSWER),
    "mass of 5e-324": ("a.urdf", arm('value="4"', 'value="5e-324"'), ANSWER),
    "mass of many digits": ("a.urdf", arm('value="4"', f'value="{"4" * 5000}"'), ANSWER),
    "mass in hexadecimal": (
        "a.urdf",
        arm('value="4"', 'value="0x4"'),
        r"a\.urdf: link 'upper': mass value = '0x4' is not a number",
    ),
    "mass with an underscore": (
        "a.urdf",
        arm('value="4"', 'value="4_0"'),
        r"a\.urdf: link 'upper': mass value = '4_0' is not a number",
    ),
    "mass with a comma": (
        "a.urdf",
        arm('value="4"', 'value="4,5"'),
        r"a\.urdf: link 'upper': mass value = '4,5' is not a number",
    ),
    "mass in Arabic digits": (
        "a.urdf",
        arm('value="4"', 'value="٤"'),
        r"a\.urdf: link 'upper': mass value = '٤' is not a number",
    ),
    "mass with a unit": (
        "a.urdf",
        arm('value="4"', 'value="4 kg"'),
        r"a\.urdf: link 'upper': mass value = 'kg' is not a number",
    ),
    "mass of nothing": (
        "a.urdf",
        arm('value="4"', 'value=""'),
        r"a\.urdf: link 'upper': mass value has 0 numbers where 1 number is needed",
    ),
    "negative inertia": ("a.urdf", arm('ixx="0.01"', 'ixx="-1"'), ANSWER),
    "infinite inertia": ("a.urdf", arm('ixx="0.01"', 'ixx="inf"'), ANSWER),
    "inertia of 1e308": ("a.urdf", arm('ixx="0.01"', 'ixx="1e308"'), ANSWER),
    "inertia that breaks the triangle": ("a.urdf", arm('ixx="0.01"', 'ixx="9"'), ANSWER),
    "centre of mass on the moon": ("a.urdf", arm("0.2 0.01 0", "4e8 0 0"), ANSWER),
    "centre of mass of two numbers": (
        "a.urdf",
        arm("0.2 0.01 0", "0.2 0.01"),
        r"a\.urdf: link 'upper': inertial origin xyz has 2 numbers where 3 numbers",
    ),
    "an axis of NaN": (
        "a.urdf",
        arm('<axis xyz="0 0 1"', '<axis xyz="0 0 nan"'),
        r"a\.urdf: joint 'shoulder': axis xyz = '0 0 nan' is not finite",
    ),
    "an axis of zero": (
        "a.urdf",
        arm('<axis xyz="0 0 1"', '<axis xyz="0 0 0"'),
        r"a\.urdf: joint 'shoulder': has a zero axis",
    ),
    "an axis of 1e-320": (
        "a.urdf",
        arm('<axis xyz="0 0 1"', '<axis xyz="0 0 1e-320"'),
        r"a\.urdf: joint 'shoulder': has a zero axis",
    ),
    "an axis of 1e200": (
        "a.urdf",
        arm('<axis xyz="0 0 1"', '<axis xyz="0 0 1e200"'),
        r"a\.urdf: cannot be understood: Revolute joint axis vector must have nonze",
    ),
    "a turn of 1e300": ("a.urdf", arm("1.5707963267948966", "1e300"), ANSWER),
    "limits of infinity": ("a.urdf", arm('lower="-2.5"', 'lower="-inf"'), ANSWER),
    "limits that are crossed": (
        "a.urdf",
        arm('lower="-2.5"', 'lower="99"'),
        r"a\.urdf: joint 'shoulder': has a lower limit above its upper limit",
    ),
    "a negative effort": ("a.urdf", arm('effort="100"', 'effort="-100"'), ANSWER),
    # Names
    "a joint without a name": (
        "a.urdf",
        arm('name="elbow"', 'name=""'),
        r"a\.urdf: has a joint without a name",
    ),
    "a joint of a blank": ("a.urdf", arm('name="elbow"', 'name=" "'), ANSWER),
    "a joint of another script": ("a.urdf", arm('name="elbow"', 'name="肘関節"'), ANSWER),
    "a joint that turns the line round": (
        "a.urdf",
        arm('name="elbow"', 'name="\u202ewobel"'),
        ANSWER,
    ),
    "a joint with a line break": ("a.urdf", arm('name="elbow"', 'name="el&#10;bow"'), ANSWER),
    "a joint with a NUL": (
        "a.urdf",
        arm('name="elbow"', 'name="el&#0;bow"'),
        r"a\.urdf: is not well-formed XML: reference to invalid character number",
    ),
    "a joint with markup": ("a.urdf", arm('name="elbow"', 'name="[red]el[/bow]"'), ANSWER),
    "a joint of 100 kB": ("a.urdf", arm('name="elbow"', f'name="{"e" * 100_000}"'), ANSWER),
    "two joints of a name": (
        "a.urdf",
        arm('name="elbow"', 'name="shoulder"'),
        r"a\.urdf: has two joints named 'shoulder'",
    ),
    "a joint named as a link": ("a.urdf", arm('name="elbow"', 'name="fore"'), ANSWER),
    # Trees
    "a link that is its own parent": (
        "a.urdf",
        arm('<parent link="upper"/>', '<parent link="fore"/>'),
        ANSWER,
    ),
    "two links in a circle": (
        "a.urdf",
        arm('<parent link="base"/><child', '<parent link="fore"/><child'),
        ANSWER,
    ),
    "a joint that mimics itself": ("a.urdf", arm("<axis", '<mimic joint="elbow"/><axis'), ANSWER),
    "a chain of 400 links": ("a.urdf", chain(400), ANSWER),
    "a chain of 60 000 links": (
        "a.urdf",
        chain(60_000),
        r"a\.urdf: has 60000 links, and 4096 is the limit",
    ),
    "a star of 2000 links": (
        "a.urdf",
        chain(2000).replace('<parent link="l', '<parent link="l0" was="l'),
        ANSWER,
    ),
    # Meshes
    "a mesh that never ends": ("a.urdf", mesh("/dev/zero"), ANSWER),
    "a mesh that is a folder": ("a.urdf", mesh("."), ANSWER),
    "a mesh above everything": ("a.urdf", mesh("../" * 400 + "etc/passwd"), ANSWER),
    "a mesh of the web": ("a.urdf", mesh("http://localhost:1/a.stl"), ANSWER),
    "a mesh with a NUL": ("a.urdf", mesh("a%00b.stl"), ANSWER),
    "a mesh that is the robot": ("a.urdf", mesh("a.urdf"), ANSWER),
    # SDF and MJCF
    "SDF of a future": (
        "a.sdf",
        SDF.format("").replace("1.9", "1e308"),
        r"a\.sdf: has version '1e308'",
    ),
    "SDF in a circle of frames": (
        "a.sdf",
        SDF.format("")
        .replace('name="a"/>', 'name="a"><pose relative_to="b"/></link>')
        .replace('name="b">', 'name="b"><pose relative_to="a"/>'),
        ANSWER,
    ),
    "SDF that runs a plugin": (
        "a.sdf",
        SDF.format('<plugin name="p" filename="/nowhere/evil.so"/>'),
        ANSWER,
    ),
    "MJCF of a giant replicate": (
        "a.xml",
        MJCF.format("")
        .replace("<body", '<replicate count="1000000000"><body', 1)
        .replace("</worldbody>", "</replicate></worldbody>"),
        r"a\.xml: has a <replicate> element, which is not supported",
    ),
    "MJCF of a giant composite": (
        "a.xml",
        MJCF.format("").replace(
            "<inertial", '<composite type="particle" count="9999 9999 9999"/><inertial'
        ),
        r"a\.xml: has a <composite> element, which is not supported",
    ),
    "MJCF that runs a plugin": (
        "a.xml",
        MJCF.format('<extension><plugin plugin="evil"/></extension>'),
        ANSWER,
    ),
    "MJCF of a class that inherits itself": (
        "a.xml",
        MJCF.format('<default class="a"><default class="a"/></default>'),
        ANSWER,
    ),
    "MJCF with a keyframe of another size": (
        "a.xml",
        MJCF.format("").replace("</mujoco>", '<keyframe><key qpos="1 2 3"/></keyframe></mujoco>'),
        ANSWER,
    ),
    "MJCF whose mesh never ends": (
        "a.xml",
        MJCF.format('<asset><mesh name="m" file="/dev/zero"/></asset>').replace(
            "<inertial", '<geom type="mesh" mesh="m"/><inertial'
        ),
        ANSWER,
    ),
    "MJCF with a height field of a terabyte": (
        "a.xml",
        MJCF.format('<asset><hfield name="h" nrow="999999" ncol="999999" size="1 1 1 1"/></asset>'),
        ANSWER,
    ),
}
"""File, its content, and the one line: all by `dynident check`."""

CASES = {
    **{
        f"in a study: {name}": HostileCase(
            commands=(("compare", "study.toml"),), files={"arm.urdf": text}, message=message
        )
        for name, (text, message) in IN_A_STUDY.items()
    },
    **{
        name: HostileCase(commands=(("check", file),), files={file: content}, message=message)
        for name, (file, content, message) in CHECKED.items()
    },
}
CASES["a name with a NUL"] = HostileCase(
    commands=(("check", "a\0b.urdf"),), files={}, message="An argument holds a NUL character"
)
