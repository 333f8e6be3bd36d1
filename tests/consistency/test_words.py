"""Every way of breaking a link is told in words that a user understands, in every format."""

from __future__ import annotations

import re

import numpy as np
import pytest

import dynident as di
from broken_robots import BOX, MASS, MOMENTS, WRITERS, Fore, urdf
from dynident.robot import Robot


def scaled(factor: float) -> tuple[float, ...]:
    return tuple(factor * value for value in MOMENTS)


def turned(*order: int) -> tuple[float, ...]:
    return tuple(MOMENTS[axis] for axis in order)


BROKEN = {
    "zero mass": (Fore(mass=0), "mass", r"an inertia, but no mass"),
    "negative mass": (Fore(mass=-2), "mass", r"mass is negative: -2 kg.*\+2 kg all else holds"),
    "negative moment": (
        Fore(moments=(0.0011, 0.0155, -0.0163)),
        "inertia",
        r"principal moment is negative: -0.0163 kg m\^2 \(izz = -0.0163\)",
    ),
    "large product": (Fore(products=(0.02, 0, 0)), "inertia", "principal moment is negative"),
    "triangle": (
        Fore(moments=(0.0011, 0.0155, 0.03)),
        "triangle",
        r"exceeds the sum of the others: 0.03 > 0.0011 \+ 0.0155",
    ),
    "mass is NaN": (Fore(mass="nan"), "finite", "not a usable number: .*mass = nan"),
    "moment is NaN": (
        Fore(moments=(0.0011, "nan", 0.0163)),
        "finite",
        "not a usable number: .*(iyy|fullinertia) = nan",
    ),
    "infinite": (Fore(products=(0, "-inf", 0)), "finite", "(ixz|fullinertia) = -inf"),
    "absurd": (Fore(mass=1e200), "finite", "not a usable number: m = 1e.200"),
    "g mm^2": (
        Fore(moments=scaled(1e9)),
        "spread",
        r"inertia about 1e9 times too large for the mass and the extent: units\? \(g mm\^2",
    ),
    "kg mm^2": (
        Fore(moments=scaled(1e6)),
        "spread",
        r"about 1e6 times too large for the mass and the extent: units\? \(kg mm\^2 read as",
    ),
    "kg cm^2": (Fore(moments=scaled(1e4)), "spread", r"about 1e4 times too large.*kg cm\^2"),
    "lb in^2": (Fore(moments=scaled(3417.2)), "spread", r"about 3e3 times too large.*lb in\^2"),
    "placeholder": (Fore(moments=(1, 1, 1)), "spread", r"same moment \(1 kg.*a placeholder\?"),
    "com outside": (Fore(com="0.5 0 0"), "centre_of_mass", "0.2 m outside of the link's geom"),
    "com in mm": (
        Fore(com="150 0 0"),
        "centre_of_mass",
        r"150 m away from a link of 0.31 m: units\? \(mm read as m\)",
    ),
}


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize(("fore", "rule", "words"), BROKEN.values(), ids=BROKEN)
def test_broken(writer, fore, rule, words, capfd):
    found = di.check(Robot.from_text(writer(fore)))
    assert not found.consistent
    assert [link.name for link in found.broken] == ["fore"]
    assert rule in {one.rule for one in found.broken[0].broken}
    told = next(part for part in found.tables() if str(part).startswith("link 'fore'"))
    assert re.search(words, " ".join(str(told).split())), told
    with pytest.raises(di.DynidentError, match=r"link 'fore': .* is broken"):
        found.require()
    assert "NOT consistent: link 'fore'" in found.sentence
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("excess", [1e-4, 1e-5, 3e-6])
def test_what_is_hardly_broken_says_by_how_much_and_what_fixes_it(excess):
    """Moments that were rounded: every change is beyond the fourth digit, and can be seen."""
    first, second = 0.01, 0.02
    third = (first + second) * (1.0 + excess)
    found = di.check(Robot.from_text(urdf(Fore(moments=(first, second, third), shapes=""))))
    (told,) = (str(part) for part in found.tables() if str(part).startswith("link 'fore'"))
    assert "triangle inequality" in told and "no small change" not in told
    (largest,) = re.findall(r"others: ([\d.e-]+) > 0.01 \+ 0.02", told)
    assert float(largest) > first + second
    changes = re.findall(r"i(?:xx|yy|zz) ([\d.e-]+) -> ([\d.e-]+) kg m\^2", told)
    assert changes and all(0.0 < abs(float(b) - float(a)) <= excess * third for a, b in changes)


BEYOND = "mass is spread more along {} than the geometry allows, by .* or the shapes are simplified"
DOUBTFUL = {
    "swapped x and z": (
        Fore(moments=turned(2, 1, 0)),
        "z",
        r"axes swapped\? It fits with x and z exchanged",
    ),
    "swapped x and y": (
        Fore(moments=turned(1, 0, 2)),
        "y",
        r"axes swapped\? It fits with x and y exchanged",
    ),
    "about the origin": (
        Fore(moments=(0.0011, 0.0155 + MASS * 0.15**2, 0.0163 + MASS * 0.15**2)),
        "x",
        "it fits if it was stated about the link's origin, not the centre of mass",
    ),
    "a rod for a body": (Fore(moments=scaled(5.0)), "x", None),
}


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize(("fore", "axis", "cause"), DOUBTFUL.values(), ids=DOUBTFUL)
def test_mass_a_little_beyond_the_shapes_is_a_hint(writer, fore, axis, cause):
    found = di.check(Robot.from_text(writer(fore)))
    assert found.consistent and found.require() is found
    link = found.links[0]
    assert link.name == "fore" and not link.broken and not link.remedy
    assert link.worst.rule == "spread" and link.worst.relative < 0 and link.worst.doubtful
    first, *causes = link.hints
    assert re.fullmatch(BEYOND.format(axis), first)
    assert causes == [] if cause is None else re.fullmatch(cause, causes[0])
    assert found.link_table().rows[0][-1] == "look at it"
    assert "no rule is broken, but look at 'fore'" in found.sentence


@pytest.mark.parametrize(("factor", "broken"), [(9.5, False), (10.5, True)])
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_ten_times_what_the_shapes_allow_is_broken(factor, broken, length):
    """Two halves of the mass at the ends of the box are the most that it allows."""
    edges = length * np.array(BOX)
    along = MASS * (edges[0] / 2) ** 2
    shape = f'<visual><geometry><box size="{" ".join(map(str, edges))}"/></geometry></visual>'
    moments = tuple(factor * along * np.array([0.0, 1.0, 1.0]))
    fore = Fore(com="0 0 0", moments=moments, shapes=shape)
    links = di.check(Robot.from_text(urdf(fore))).links
    spread = next(rule for one in links if one.name == "fore" for rule in one.rules[:1])
    assert spread.rule == "spread" and spread.broken == broken
    assert spread.value == pytest.approx((1.0 - factor) * along)


def test_a_thin_wall_with_a_thickness_of_mass_is_no_broken_link():
    """Across a thin shape nothing is allowed: that is no matter of units."""
    shape = '<visual><geometry><box size="1 1 1e-4"/></geometry></visual>'
    fore = Fore(com="0 0 0", moments=(0.2, 0.2, 0.3), shapes=shape)
    (hints,) = (one.hints for one in di.check(Robot.from_text(urdf(fore))).links if one.hints)
    assert re.fullmatch(BEYOND.format("z"), hints[0])


def test_every_rule_of_every_link_in_one_table():
    found = di.check(Robot.from_text(urdf(Fore(moments=turned(2, 1, 0)))))
    table = found.margin_table()
    assert len(table.rows) == sum(len(one.rules) for one in (*found.links, *found.bodies))
    assert [row[-1] for row in table.rows if row[1].startswith("spread of")] == ["look at it"]
    (mass,) = (row for row in table.rows if row[:2] == ("fore", "mass"))
    assert mass[2:4] == ("2", "kg") and mass[4].endswith(" %") and mass[-1] == "holds"
    assert any("margin_table()" in note for note in found.link_table().notes)
    broken = di.check(Robot.from_text(urdf(Fore(mass="nan")))).margin_table()
    assert broken.rows[0][1:] == ("finite numbers", "-", "", "-", "BROKEN")


NO_SHAPES = {
    "g mm^2": (Fore(moments=scaled(1e9)), r"about 1e9 times too large.*\(g mm\^2 read as kg m\^2"),
    "kg mm^2": (Fore(moments=scaled(1e6)), r"about 1e6 times too large.*\(kg mm\^2 read as"),
    "too small": (Fore(moments=scaled(1e-6)), "about 1e6 times too small for the mass and the ex"),
    "grams": (Fore(mass=2000), r"mass about 500 times that of other links.*\(g read as kg\)"),
    "placeholder": (Fore(moments=(1, 1, 1)), r"same moment \(1 kg m\^2\).*a placeholder"),
    "com in mm": (Fore(com="150 0 0"), r"150 m away.*units\? \(mm read as m\)"),
}


@pytest.mark.parametrize(("fore", "words"), NO_SHAPES.values(), ids=NO_SHAPES)
def test_without_geometry_oddities_are_hints(fore, words):
    """No rule forbids them, but nobody means them."""
    found = di.check(Robot.from_text(urdf(Fore(**{**vars(fore), "shapes": ""}))))
    link = next(one for one in found.links if one.name == "fore")
    assert found.consistent and len(link.hints) == 1
    assert re.search(words, link.hints[0])
    assert "no rule is broken, but look at 'fore'" in found.sentence


def test_swapped_axes_without_geometry():
    """The upper link reaches along x; its mass cannot well lie across."""
    text = urdf(Fore(shapes="")).replace(
        'ixx="0.0066" ixy="0" ixz="0" iyy="0.0566"', 'ixx="0.0566" ixy="0" ixz="0" iyy="0.0066"'
    )
    found = di.check(Robot.from_text(text))
    upper = next(one for one in found.links if one.name == "upper")
    assert upper.hints == (
        "axes swapped? The link reaches 0.4 m along x, but its mass is spread along y",
    )


def test_grams_in_known_shapes():
    (hint,) = di.check(Robot.from_text(urdf(Fore(mass=2000)))).links[0].hints
    assert re.search(r"mass about 1e3 times too large for the volume.*\(g read as kg\)", hint)


def test_mildly_swapped_axes_are_seen_by_likeness_to_a_uniform_body():
    """No rule forbids these moments inside that box."""
    shape = '<visual><geometry><box size="0.2 0.16 0.12"/></geometry></visual>'
    x, y, z = (edge**2 * MASS / 12 for edge in (0.2, 0.16, 0.12))
    right, swapped = (y + z, x + z, x + y), (x + y, x + z, y + z)
    for moments, hints in ((right, 0), (swapped, 1)):
        fore = Fore(com="0 0 0", moments=moments, shapes=shape)
        link = next(
            one for one in di.check(Robot.from_text(urdf(fore))).links if one.name == "fore"
        )
        assert not link.broken and len(link.hints) == hints
        assert all("x and z exchanged" in hint for hint in link.hints)


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
def test_healthy(writer):
    found = di.check(Robot.from_text(writer()))
    assert found.consistent and found.require() is found
    assert all(not one.hints and not one.remedy and not one.not_checked for one in found.links)
    fore = next(one for one in found.links if one.name == "fore")
    assert fore.length_from == "geometry" and fore.body == "fore"
    assert {one.rule for one in fore.rules} == {
        *("finite", "mass", "inertia", "triangle", "pseudo_inertia", "centre_of_mass", "spread"),
    }
    assert all(one.value >= 0 and one.relative >= 0 and not one.words for one in fore.rules)
    depth = next(one for one in fore.rules if one.rule == "centre_of_mass")
    assert depth.value == pytest.approx(0.02) and depth.unit == "m"
