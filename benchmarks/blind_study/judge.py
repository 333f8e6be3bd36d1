"""What an answer is worth, against the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from blind_study.foreign import KIN

Place = tuple[str, str | None, str | None]
"""Effect, joint and source."""

EQUIVALENT: tuple[tuple[str, str, str], ...] = (
    (
        "base_tilt",
        "joint_zero",
        "an arm in one vertical plane feels a turn of its base as an offset of its first joint",
    ),
    (
        "torque_offset",
        "asymmetric_friction",
        "the constant of a friction that differs by direction is an offset",
    ),
)
"""Effects whose torque on the same robot is the same, with the reason; at one joint unless the
reason says otherwise."""


@dataclass(frozen=True)
class Judged:
    """One case.

    Attributes
    ----------
    name, kind, joints : of the case.
    truth : what was hidden.
    ratio : true residual-to-noise ratio; of two effects the smaller one's own.
    misstated : whether the study states another width of dry friction than the true one.
    broken : the message, where there was no answer.
    first : what is suggested first; None for nothing.
    exact : whether that is the truth.
    right : whether the truth, or its declared equivalent, is first or in its set.
    in_three : whether it is among the first three.
    in_set : whether the truth itself is in the set of the first suggestion.
    size : of that set.
    added : number of effects added.
    verdict : of the answer.
    before_over_floor, over_floor : held-out error before and after, over the noise floor; None
        without one.
    both : of two, whether each is in the set of some step.
    absorbed : whether the truth is listed as absorbed.
    cpu_s : of `explain`.
    before, after : N m, held-out error without and with what was added.
    filter : name of the setting of [filter] that the study has.
    friction : "constraint" where dry friction is MuJoCo's own, else "tanh".
    plant : "mujoco" or "own".
    withdrawn : number of effects that the training recordings call for, and no others.
    """

    name: str
    kind: str
    joints: int
    truth: tuple[Place, ...]
    ratio: float
    misstated: bool
    broken: str
    first: Place | None
    exact: bool
    right: bool
    in_three: bool
    in_set: bool
    size: int
    added: tuple[Place, ...]
    verdict: str
    before_over_floor: float | None
    over_floor: float | None
    both: bool
    absorbed: bool
    cpu_s: float
    before: float | None = None
    after: float | None = None
    filter: str = "none"
    friction: str = "tanh"
    plant: str = "own"
    withdrawn: int = 0

    @property
    def alarm(self) -> bool:
        """Whether something is said to be missing."""
        return bool(self.added) or self.verdict != "nothing_missing"

    @property
    def worse(self) -> bool:
        """Whether the held-out error is larger with what was added than without."""
        return self.before is not None and self.after is not None and self.after > self.before

    @property
    def rejected(self) -> bool:
        """Whether the answer is "none of these explains it", or the same physics by its name."""
        if self.verdict == "unexplained":
            return True
        kin = KIN.get(self.truth[0][0], ())
        return any(name in kin and joint == self.truth[0][1] for name, joint, _ in self.added)


def judge(truth: dict[str, Any], said: dict[str, Any]) -> Judged:
    """Compare an answer with the truth."""
    case, planar = truth["case"], bool(truth["planar"])
    hidden = tuple(_place(one) for one in truth["hidden"])
    also = tuple(_place(one) for one in truth.get("also", ()))
    true = (*hidden, *also)
    circumstances = case.get("circumstances")
    answer = said.get("answer") or {
        "steps": [],
        "candidates": [],
        "verdict": "no answer",
        "test_error": {"before": None, "after": None, "noise_floor": None},
    }
    steps = answer["steps"]
    sets = [[_place(s), *(_place(o) for o in s["indistinguishable"])] for s in steps]
    listed = [_place(c) for c in answer["candidates"] if c["status"] != "absorbed"]
    absorbed = [_place(c) for c in answer["candidates"] if c["status"] == "absorbed"]
    first = sets[0] if sets else []
    leading = list(dict.fromkeys([*first[:1], *listed]))[:3]

    def found(place: Place, among: list[Place]) -> bool:
        return any(same(place, one, truth["joints"], planar=planar) for one in among)

    floor = answer["test_error"]["noise_floor"]
    before, after = answer["test_error"]["before"], answer["test_error"]["after"]
    ratios = [one["ratio"] for one in truth["hidden"]]
    return Judged(
        said["name"],
        case["kind"],
        case["joints"],
        hidden,
        min(ratios) if ratios else truth["ratio"],
        case["width"] != case["stated_width"],
        said.get("error", ""),
        first[0] if first else None,
        exact=bool(first) and first[0] in true,
        right=any(found(one, first) for one in true),
        in_three=any(found(one, leading) for one in true),
        in_set=any(one in first for one in true),
        size=len(first),
        added=tuple(one[0] for one in sets),
        verdict=answer["verdict"],
        before_over_floor=before / floor if floor and before is not None else None,
        over_floor=after / floor if floor and after is not None else None,
        both=bool(hidden)
        and all(
            any(found(one, each) for each in sets for one in (asked, *_other_way(asked, also)))
            for asked in hidden
        ),
        absorbed=any(one in absorbed for one in hidden),
        cpu_s=said["cpu_s"],
        before=before,
        after=after,
        filter=said.get("filter", "none"),
        friction=circumstances["friction"] if circumstances else "tanh",
        plant="mujoco" if circumstances else "own",
        withdrawn=len(answer.get("withdrawn", ())),
    )


def _other_way(one: Place, also: tuple[Place, ...]) -> list[Place]:
    """Return the same coupling from its other end, where that is true too."""
    return [other for other in also if other == (one[0], one[2], one[1])]


def same(truth: Place, other: Place, joints: list[str], *, planar: bool) -> bool:
    """Whether two effects at their places are one up to declared equivalence."""
    if truth == other:
        return True
    for one, two, _ in EQUIVALENT:
        if {truth[0], other[0]} != {one, two}:
            continue
        if one == "base_tilt":
            return planar and joints[0] in (truth[1], other[1])
        return truth[1] == other[1]
    return False


def _place(said: dict[str, Any]) -> Place:
    return said["effect"], said["joint"], said["source"]
