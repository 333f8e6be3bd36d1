"""What is drawn: the cases of a seed, block by block, so that more cases change no earlier one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np

from blind_study.foreign import FOREIGN
from blind_study.strengths import KNOWN

Kind = Literal["healthy", "known", "two", "foreign", "absorbed", "law"]

BLOCK = 100
SHARES: dict[Kind, int] = {"healthy": 30, "known": 45, "two": 10, "foreign": 10, "absorbed": 5}
"""Cases of each kind in a block; those with laws are drawn in `law_cases`."""
JOINTS = {2: 75, 6: 12, 7: 13}
"""Cases of each number of joints in a block."""
NOT_IDENTIFIABLE = ("rotor_inertia", "joint_zero", "payload")
"""Effects that some geometry hides: at the first joint, at the last (or a vertical first) joint,
and in every recording."""
RATIOS = (0.3, 30.0)
RATIOS_OF_TWO = (1.0, 15.0)


@dataclass(frozen=True)
class Hidden:
    """An effect to be hidden, with its target residual-to-noise ratio.

    Joints count from 0; -1 is for what is common to all of them.
    """

    effect: str
    joint: int
    source: int
    ratio: float


@dataclass(frozen=True)
class Case:
    """One case, as drawn.

    Attributes
    ----------
    seed, number : of the study, and in it.
    kind : what the right answer is made of.
    joints : of the robot.
    hidden : effects of the catalogue, or the one foreign law.
    position_std, position_resolution : rad.
    torque_noise : in units of each joint's Coulomb friction.
    colour : "white", "ar1" (correlated from sample to sample) or "speed" (growing with speed).
    torque : what the recordings hold.
    width : rad/s over which dry friction truly changes its sign.
    stated_width : what the study says of it.
    payload : a known payload in every other recording, or none.
    says_payload : whether the study says which recordings carry one, where it is hidden.
    variant : "healthy" where what was drawn to be hidden was left out; "laws" where laws are asked
        for.
    """

    seed: int
    number: int
    kind: Kind
    joints: int
    hidden: tuple[Hidden, ...]
    position_std: float
    position_resolution: float
    torque_noise: float
    colour: Literal["white", "ar1", "speed"]
    torque: Literal["held_command", "measured"]
    width: float
    stated_width: float
    payload: bool
    says_payload: bool
    variant: Literal["", "healthy", "laws"] = ""

    @property
    def name(self) -> str:
        """The folder of its data."""
        return f"case_{self.seed}_{self.number:04d}" + (f"_{self.variant}" if self.variant else "")

    def healthy(self) -> Case:
        """Return the case with nothing hidden in it, under a name of its own."""
        return replace(self, kind="healthy", hidden=(), variant="healthy")

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def draw(seed: int, count: int, first: int = 0, joints: Mapping[int, int] = JOINTS) -> list[Case]:
    """Draw cases `first` to `first + count - 1` of a seed.

    `joints` says how many cases of a block have robots of how many joints.
    """
    found: list[Case] = []
    for block in range(first // BLOCK, -(-(first + count) // BLOCK)):
        found += _block(seed, block, joints)
    return [case for case in found if first <= case.number < first + count]


def _block(seed: int, block: int, shares: Mapping[int, int]) -> list[Case]:
    rng = np.random.default_rng([seed, block, 1])
    kinds = rng.permutation([kind for kind, share in SHARES.items() for _ in range(share)])
    joints = rng.permutation([n for n, share in shares.items() for _ in range(share)])
    # Every effect comes up equally often, whatever the number of cases.
    known = iter(_cycle(KNOWN, SHARES["known"], seed, block))
    twos = iter(_cycle(KNOWN, 2 * SHARES["two"], seed + 1, block))
    foreign = iter(_cycle(FOREIGN, SHARES["foreign"], seed + 2, block))
    absorbed = iter(_cycle(NOT_IDENTIFIABLE, SHARES["absorbed"], seed + 3, block))
    found = []
    for k in range(BLOCK):
        names: list[str] = []
        if kinds[k] == "known":
            names = [next(known)]
        elif kinds[k] == "two":
            names = [next(twos), next(twos)]
        elif kinds[k] == "foreign":
            names = [next(foreign)]
        elif kinds[k] == "absorbed":
            names = [next(absorbed)]
        found.append(draw_case(seed, block * BLOCK + k, str(kinds[k]), int(joints[k]), names))
    return found


def _cycle(names: tuple[str, ...], count: int, seed: int, block: int) -> list[str]:
    """`count` names of a shuffled cycle that goes on from block to block."""
    order = np.random.default_rng([seed, 2]).permutation(len(names))
    return [names[order[(block * count + i) % len(names)]] for i in range(count)]


def draw_case(seed: int, number: int, kind: str, joints: int, names: list[str]) -> Case:
    """Draw one case that hides effects of these names."""
    rng = np.random.default_rng([seed, number, 3])
    hidden = tuple(_hidden(name, kind, joints, rng) for name in names)
    if kind == "absorbed":
        hidden = tuple(_out_of_sight(one, joints, rng) for one in hidden)
    width = _log(rng, 0.005, 0.03)
    stated = 0.01 if rng.random() < 1 / 3 else width
    with_payload = any(one.effect == "payload" for one in hidden)
    alternates = bool(rng.random() < 1 / 3)
    return Case(
        seed,
        number,
        kind,  # type: ignore[arg-type]
        joints,
        hidden,
        position_std=_log(rng, 1e-5, 1e-4),
        position_resolution=float(rng.choice([0.0, 0.0, 2e-5, 1e-4])),
        torque_noise=_log(rng, 0.03, 0.3),
        colour=str(rng.choice(["white", "ar1", "speed"])),  # type: ignore[arg-type]
        torque=str(rng.choice(["held_command", "measured"])),  # type: ignore[arg-type]
        width=width,
        stated_width=stated,
        payload=alternates and not with_payload,
        says_payload=bool(rng.random() < 0.5) or kind == "absorbed",
    )


def _hidden(name: str, kind: str, joints: int, rng: np.random.Generator) -> Hidden:
    places = list(range(joints))
    if name == "rotor_inertia":
        places = places[1:]  # at the first joint it cannot be told from the links
    if name == "joint_zero":
        # At the last joint, and at a vertical first one, it is a change of the bodies' parameters.
        places = places[:-1] if joints == 2 else places[1:-1]
    joint = int(rng.choice(places))
    if name in ("base_tilt", "payload") or (name == "torque_delay" and rng.random() < 0.5):
        joint = -1
    # A source that lies near is felt more; which does not matter for anything else.
    source = int(rng.choice([i for i in range(joints) if i != joint]))
    return Hidden(name, joint, source, _log(rng, *(RATIOS_OF_TWO if kind == "two" else RATIOS)))


def _out_of_sight(one: Hidden, joints: int, rng: np.random.Generator) -> Hidden:
    """Put an effect where the data cannot show it."""
    places = {"rotor_inertia": [0], "joint_zero": [joints - 1], "payload": [-1]}[one.effect]
    if one.effect == "joint_zero" and joints > 2:
        places = [0, joints - 1]
    return Hidden(one.effect, int(rng.choice(places)), one.source, 0.0)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
