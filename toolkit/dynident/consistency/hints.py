"""What may have gone wrong, in words: units, exchanged axes, placeholders, slips of the sign.

Hints are guesses; the rules are not. Each compares a body with what a body of its mass and extent
would have.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from dynident.consistency.rules import Array, Body, RuleMargin, Verdicts, judge
from dynident.consistency.spread import second_moment
from dynident.inertia import from_com, margins, point_inertia, to_com
from dynident.robot.hull import Hull

_UNITS = {
    "kg cm^2": 1e4,
    "kg mm^2": 1e6,
    "g cm^2": 1e7,
    "g mm^2": 1e9,
    "g m^2": 1e3,
    "lb in^2": 3417.2,
}
"""How much larger a number is in that unit than in kg m^2."""

# Inertia over that of a uniform box of the same mass and extent, from which on units are
# suspected. Inside known shapes no body exceeds 3; without them the extent is uncertain.
_TOO_LARGE = {"geometry": 30.0, "joints": 300.0, "robot": 1000.0}
_TOO_SMALL = {"geometry": 2e-4, "joints": 1e-5, "robot": 1e-6}
# kg/m^3: the densest metal has 22600; air 1.2.
_DENSE, _THIN = 30e3, 0.1


def hints(body: Body, verdicts: Verdicts) -> tuple[str, ...]:
    """Return what may have gone wrong with a body; nothing for a body that seems right."""
    if not body.readable:
        return ()
    broken = {one.rule for one in verdicts.rules if one.broken}
    doubtful = tuple(one for one in verdicts.rules if one.doubtful)
    return tuple(_hints(body, broken, doubtful))


def _hints(body: Body, broken: set[str], doubtful: tuple[RuleMargin, ...]) -> Iterator[str]:
    properties = to_com(body.phi)
    mass = properties.mass
    if "mass" in broken and mass < 0.0:
        turned = from_com(-mass, properties.com, properties.inertia_com)
        if margins(turned).consistent:
            yield f"with a mass of +{-mass:.4g} kg all else holds: a slip of the sign?"
    if not mass > 0.0:
        return
    yield from (f"{one.words}, or the shapes are simplified" for one in doubtful)
    wrong_size = list(_sizes(body, properties.inertia_com))
    yield from wrong_size
    if wrong_size or broken & {"mass", "inertia", "triangle"}:
        return
    if "spread" in broken or doubtful:
        yield from _causes_of_spread(body)
    elif body.hull is not None and "centre_of_mass" not in broken:
        yield from _like_uniform(body, body.hull)
    elif body.hull is None:
        yield from _across(body)


def _sizes(body: Body, inertia: Array) -> Iterator[str]:
    hull, mass = body.hull, float(body.phi[0])
    from_middle = to_com(body.phi).com - (hull.points.mean(axis=0) if hull is not None else 0.0)
    far = float(np.linalg.norm(from_middle)) / body.length
    if body.length_from != "inertia" and far > 50.0:
        yield (
            f"centre of mass {np.linalg.norm(from_middle):.3g} m away from a link of "
            f"{body.length:.2g} m: units? (mm read as m)"
        )
    density = mass / hull.volume if hull is not None else 1e3
    ratio = relative_inertia(body)
    if density < _THIN and ratio < 1e-2:
        yield (
            f"geometry far too large for the mass ({density:.1g} kg/m^3): units? "
            "(mm read as m; a mesh without its scale?)"
        )
        return
    if density > _DENSE:
        guess = "units? (g read as kg)" if density > 2e5 else "denser than any metal"
        yield (
            f"mass about {_power(density / 2e3)} times too large for the volume of the geometry "
            f"({density:.1g} kg/m^3): {guess}"
        )
    if body.length_from == "inertia" or ratio != ratio or ratio <= 0.0:
        return
    too_large = ratio > _TOO_LARGE[body.length_from]
    too_small = ratio < _TOO_SMALL[body.length_from]
    same = _same_moments(inertia)
    if same and (too_large or too_small or (same == 1.0 and not 0.1 < ratio < 10.0)):
        factor = ratio if ratio > 1.0 else 1.0 / ratio
        yield (
            f"the same moment ({same:g} kg m^2) about all axes, about {_power(factor)} times too "
            f"{'large' if ratio > 1.0 else 'small'} for the mass and the extent: a placeholder?"
        )
    elif too_large:
        yield f"inertia {_units(ratio, 'large')}"
    elif hull is None and mass > 100.0 * body.typical_mass and ratio < 1e-2:
        yield (
            f"mass about {_power(mass / body.typical_mass)} times that of other links, with an "
            "inertia like theirs: units? (g read as kg)"
        )
    elif too_small and density <= _DENSE:
        yield f"inertia {_units(ratio, 'small')}"


def relative_inertia(body: Body) -> float:
    """Return the inertia over that of a uniform box of the same mass and extent."""
    spread = float(np.trace(second_moment(body.phi)))
    return 12.0 * spread / body.moment


def _same_moments(inertia: Array) -> float:
    """The moment, if it is exactly the same about all axes; else 0."""
    value = float(inertia[0, 0])
    size = np.abs(inertia).max()
    same = np.allclose(inertia, value * np.eye(3), rtol=0.0, atol=1e-12 * size)
    return value if same and value > 0.0 else 0.0


def _units(ratio: float, which: str) -> str:
    factor = ratio if which == "large" else 1.0 / ratio
    near = {name: abs(np.log10(factor / value)) for name, value in _UNITS.items()}
    likely = sorted((name for name, far in near.items() if far < 0.75), key=near.__getitem__)[:2]
    # The extent is no exact measure: if a unit explains it, its factor is the better figure.
    times = _UNITS[likely[0]] if likely else factor
    text = f"about {_power(times)} times too {which} for the mass and the extent: units?"
    if not likely:
        return text
    if which == "large":
        return f"{text} ({' or '.join(likely)} read as kg m^2)"
    return f"{text} (kg m^2 converted as if it were {' or '.join(likely)})"


def _power(factor: float) -> str:
    if factor < 1e3:
        return f"{float(f'{factor:.1g}'):g}"
    return f"{factor:.0e}".replace("e+0", "e").replace("e+", "e").replace("e-0", "e-")


# --- inside known shapes ------------------------------------------------------------------------


def _causes_of_spread(body: Body) -> Iterator[str]:
    properties = to_com(body.phi)
    for order in permutations(range(3)):
        if order != (0, 1, 2) and _holds(body, _permuted(properties.inertia_com, order)):
            yield f"axes swapped? It fits with {exchange(order)}"
            break
    com = properties.com
    if np.linalg.norm(com) > 1e-3 * body.length:
        shift = properties.mass * point_inertia(com)
        if _holds(body, properties.inertia_com - shift):
            yield "it fits if it was stated about the link's origin, not the centre of mass"


def _holds(body: Body, inertia: Array) -> bool:
    properties = to_com(body.phi)
    phi = from_com(properties.mass, properties.com, inertia)
    changed = Body(
        name=body.name,
        phi=phi,
        length=body.length,
        length_from=body.length_from,
        typical_mass=body.typical_mass,
        hull=body.hull,
        whole=body.whole,
    )
    return not any(one.broken or one.doubtful for one in judge(changed).rules)


def _permuted(inertia: Array, order: tuple[int, ...]) -> Array:
    return inertia[np.ix_(order, order)]


def exchange(order: tuple[int, ...]) -> str:
    """Return a permutation of the axes in words: "x and z exchanged"."""
    moved = [axis for axis in range(3) if order[axis] != axis]
    names = ["xyz"[axis] for axis in moved]
    if len(moved) == 2:
        return f"{names[0]} and {names[1]} exchanged"
    return f"x, y, z in the place of {', '.join('xyz'[axis] for axis in order)}"


def _like_uniform(body: Body, hull: Hull) -> Iterator[str]:
    """Axes that fit a uniform filling of the shapes only when exchanged."""
    own = second_moment(body.phi) / body.phi[0]
    uniform = hull.second_moment
    if np.trace(uniform) <= 0.0 or not body.whole:
        return
    far = np.linalg.norm(own - uniform) / np.linalg.norm(uniform)
    if far < 0.2:
        return
    for order in permutations(range(3)):
        other = np.linalg.norm(_permuted(own, order) - uniform) / np.linalg.norm(uniform)
        if other < 0.05 and other < 0.2 * far:
            yield f"axes swapped? A uniform body of this shape has it with {exchange(order)}"
            return


# --- without shapes -----------------------------------------------------------------------------


def _across(body: Body) -> Iterator[str]:
    """A link that reaches along one axis while its mass lies along another one."""
    if body.onward is None:
        return
    far = float(np.linalg.norm(body.onward))
    along = int(np.argmax(np.abs(body.onward)))
    if not far > 0.0 or abs(body.onward[along]) < 0.95 * far:
        return
    wide = np.sqrt(np.maximum(np.diag(second_moment(body.phi)) / body.phi[0], 0.0)) / far
    com = to_com(body.phi).com * np.sign(body.onward[along]) / far
    other = int(np.argmax(wide))
    # Its middle between the joints, its mass within a tenth of their distance, but not sideways.
    if 0.2 < com[along] < 0.8 and wide[along] < 0.1 and wide[other] > 0.2 > 2.0 * abs(com[other]):
        yield (
            f"axes swapped? The link reaches {far:.3g} m along {'xyz'[along]}, but its mass is "
            f"spread along {'xyz'[other]}"
        )
