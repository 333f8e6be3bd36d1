"""The C of one structure: its equations of motion, its traced effects, and the loop around them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from dynident.batch import JointTree, joint_space_tape, scalar_source, scalar_work_size
from dynident.closed_loop.compiled.c_body import BODY_COUNTS, BODY_NUMBERS, HEAD, OTHERS
from dynident.closed_loop.compiled.c_loop import COUNTED, LOOP, READ, WRITTEN
from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.plant.point_force import parameters_of, traced
from dynident.closed_loop.plant.side_by_side import Bodies

STATUS = ("DONE", "FAR", "SINGULAR", "STIFF")
"""Of the function: it went to the end, ran away, lost its inertia, or needs shorter steps."""


@dataclass(frozen=True)
class BodyStructure:
    """What mechanisms have in common whose numbers one function takes.

    Attributes
    ----------
    tree : of the joints.
    others : the effects that are more than terms, and all that their trace depends on.
    memory : number of internal states.
    """

    tree: JointTree
    others: Hashable
    memory: int

    @classmethod
    def of(cls, mechanism: Mechanism) -> BodyStructure:
        """Return that of a mechanism."""
        others = tuple((one.effect, len(one.values)) for one in mechanism.others)
        widths = tuple(mechanism.friction_widths.tolist())
        # Effects find their joints by name: their columns are written into the trace.
        names = tuple(mechanism.robot.names)
        said = (names, widths, mechanism.carries_payload, mechanism.number) if others else ()
        return cls(mechanism.robot.joint_tree, (others, said), mechanism.memory)


def traced_part(mechanism: Mechanism, start: float = 0.0) -> Bodies:
    """Return the effects of a mechanism that are more than terms, as `traced` takes them."""
    others = replace(mechanism, effects=mechanism.others)
    return Bodies((others,), (start,), np.arange(mechanism.robot.n))


@dataclass(frozen=True, eq=False)
class LoopCode:
    """A loop in C.

    Attributes
    ----------
    text : the source.
    room : numbers of room that a call needs.
    """

    text: str
    room: int


def loop_source(truth: Mechanism, nominal: Mechanism) -> LoopCode:
    """Write the loop of a mechanism with another one inside its controller.

    Parameters
    ----------
    truth, nominal : of n joints each; only their structures are written.
    """
    n, memory = truth.robot.n, truth.memory
    same = BodyStructure.of(truth) == BodyStructure.of(nominal)
    given = {"truth": truth} if same else {"truth": truth, "nominal": nominal}
    tapes = {name: joint_space_tape(one.robot.joint_tree) for name, one in given.items()}
    rooms = {name: scalar_work_size(tape) for name, tape in tapes.items()}
    slides = zip(*(one.robot.joint_tree.prismatic for one in given.values()), strict=True)
    turns = ", ".join(str(int(not all(ones))) for ones in slides)
    lines = [f"#define N {n}", f"#define S {2 * n + memory}"]
    lines += [f"#define TRUTH_ROOM {rooms['truth']}", f"enum {{ {', '.join(STATUS)} }};"]
    lines += [f"static const int TURNS[N] = {{{turns}}};"]
    # One enumeration for each kind of array: they do not share names.
    lines += [f"enum {{ {', '.join(f'at_{one}' for one in names)} }};" for names in _KINDS]
    fields = [f"x[at_##p##{one}]" for one in BODY_NUMBERS]
    fields += [f"c[at_##p##{one}]" for one in BODY_COUNTS]
    lines += [f"#define FIELDS(p) {', '.join(fields)}"]
    parts = [_traced_source(given), "\n".join(lines), HEAD]
    for name, mechanism in given.items():
        parts.append(scalar_source(tapes[name], f"{name}_equations"))
        parts.append(_others(name, mechanism))
    if same:
        parts.append("#define nominal_equations truth_equations")
        parts.append("#define nominal_others truth_others")
    return LoopCode(
        "\n".join([*parts, LOOP]), rooms["truth"] + rooms.get("nominal", rooms["truth"])
    )


_KINDS = (READ, COUNTED, WRITTEN)


def _others(name: str, mechanism: Mechanism) -> str:
    if not mechanism.others:
        return f"#define {name}_others 0"
    function, bodies = traced(traced_part(mechanism), f"{name}_traced"), traced_part(mechanism)
    return OTHERS.format(
        name=name,
        inputs=function.numel_in(0),
        outputs=function.numel_out(0),
        room=function.sz_w() + 1,
        whole=function.sz_iw() + 1,
        args=function.sz_arg() + 1,
        results=function.sz_res() + 1,
        memory=bodies.memory,
        parameters=len(parameters_of(bodies)),
    )


def _traced_source(given: dict[str, Mechanism]) -> str:
    """C of the traced effects, as CasADi writes it."""
    wanted = {name: one for name, one in given.items() if one.others}
    if not wanted:
        return ""
    import casadi

    generator = casadi.CodeGenerator("traced.c")
    for name, mechanism in wanted.items():
        generator.add(traced(traced_part(mechanism), f"{name}_traced"))
    return generator.dump()
