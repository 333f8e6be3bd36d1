"""Whatever stands in a description, a check ends with findings or with one clear error."""

from __future__ import annotations

import random
import re
import subprocess
import sys

import pytest

import dynident as di
from broken_robots import WRITERS, Fore, urdf

TOKENS = ("nan", "-inf", "inf", "0", "-1", "1e308", "1e-308", "-1e200", "1e20", "5e-324", "", "x")
SHAPES = {
    "urdf": (
        '<visual><origin xyz="0.1 0 0" rpy="0 1 0"/><geometry><cylinder radius="0.1" length="0.3"/>'
        '</geometry></visual><collision><geometry><sphere radius="0.2"/></geometry></collision>'
        '<collision><geometry><capsule radius="0.1" length="0.3"/></geometry></collision>'
        '<visual><geometry><mesh filename="a.stl" scale="1 1 1"/></geometry></visual>'
    ),
    "sdf": (
        '<collision name="a"><pose>0.1 0 0 0 1 0</pose><geometry><ellipsoid><radii>0.3 0.2 0.2'
        '</radii></ellipsoid></geometry></collision><visual name="b"><geometry><cylinder><radius>'
        "0.2</radius><length>0.3</length></cylinder></geometry></visual>"
    ),
    "mjcf": (
        '<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.1"/><geom type="ellipsoid" '
        'size="0.3 0.1 0.1" quat="1 0 0 0.5"/><geom type="cylinder" size="0.1 0.2" '
        'zaxis="0 1 0"/>'
    ),
}
NUMBER = re.compile(r"(?<=[\" >])-?\d+(?:\.\d+)?(?:e-?\d+)?(?=[\" <])")


def mutated(name: str, seed: int) -> str:
    """A description in which some numbers became hostile, or a piece was lost."""
    rng = random.Random(f"{name} {seed}")
    text = WRITERS[name](Fore(shapes=SHAPES[name]))
    spots = list(NUMBER.finditer(text))
    for spot in sorted(rng.sample(spots, rng.randint(1, 4)), key=lambda s: -s.start()):
        text = text[: spot.start()] + rng.choice(TOKENS) + text[spot.end() :]
    if rng.random() < 0.1:
        cut = rng.randrange(len(text))
        text = text[:cut] + text[cut + rng.randint(1, 30) :]
    return text


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.slow
def test_mutations_end_in_findings_or_in_one_error(name, tmp_path, capfd):
    path = tmp_path / f"robot.{name}"
    done = 0
    for seed in range(120):
        path.write_text(mutated(name, seed))
        try:
            found = di.check(path)
        except di.DynidentError as error:
            assert str(path) in str(error)
            continue
        done += 1
        assert found.tables() and found.to_dict()["consistent"] == found.consistent
    assert done > 40
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_no_mutation_ends_the_process(tmp_path):
    """Native code below us ends processes where Python raises: try it in one of its own."""
    for name in WRITERS:
        for seed in range(500, 540):
            (tmp_path / f"{name}{seed}").write_text(mutated(name, seed))
    code = (
        "import sys, pathlib, dynident as di\n"
        "count = 0\n"
        "for path in sorted(pathlib.Path(sys.argv[1]).iterdir()):\n"
        "    try:\n        di.check(path)\n    except di.DynidentError:\n        pass\n"
        "    count += 1\n"
        "print(count)"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, str(tmp_path)], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "120\n", "")


BAD_SHAPES = {
    "negative radius": ('<sphere radius="-1"/>', "sphere radius = -1 is not positive"),
    "no radius": ("<sphere/>", "sphere radius has 0 numbers where 1 number is needed"),
    "not a number": ('<box size="1 1 wide"/>', "box size = 'wide' is not a number"),
    "NaN": ('<box size="1 nan 1"/>', "box size = '1 nan 1' is not finite"),
    "endless": ('<cylinder radius="0.1" length="1e9"/>', r"cylinder length is beyond 1e\+06 m"),
    "unknown": ('<torus radius="1"/>', "shape 'torus'"),
    "missing mesh": ('<mesh filename="package://a/b.stl"/>', "mesh b.stl: no such file"),
    "mesh of the web": ('<mesh filename="http://a/b.stl"/>', "mesh b.stl: is a http address"),
    "no geometry": ("", "a shape without geometry"),
}


@pytest.mark.parametrize(("shape", "words"), BAD_SHAPES.values(), ids=BAD_SHAPES)
def test_a_shape_that_cannot_be_used_is_told(shape, words, tmp_path):
    path = tmp_path / "arm.urdf"
    shapes = f"<visual><geometry>{shape}</geometry></visual>"
    path.write_text(urdf(Fore(shapes=shapes)))
    found = di.check(path)
    assert found.consistent
    link = next(one for one in found.links if one.name == "fore")
    assert len(link.not_checked) == 1 and re.fullmatch(words, link.not_checked[0]), link.not_checked
    assert link.length_from != "geometry"
    assert f"fore: {link.not_checked[0]}" in found.notes[-1]
    # With another shape that holds the centre of mass, that much is known.
    box = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    path.write_text(urdf(Fore(shapes=shapes + box)))
    link = next(one for one in di.check(path).links if one.name == "fore")
    assert "centre_of_mass" in {one.rule for one in link.rules}
    # But where it is outside of what was read, nobody knows.
    path.write_text(urdf(Fore(shapes=shapes + box, com="3 0 0")))
    link = next(one for one in di.check(path).links if one.name == "fore")
    assert not link.broken
    assert link.not_checked[1] == "centre of mass: it is outside of the shapes that were read"
