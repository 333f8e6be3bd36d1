"""A tape as C: the same operations in the same order on eight samples at a time, or on one.

No product is fused with a sum, so that the results are those of the replay, to the bit. The steps
stand in functions of some hundred each, and every function goes through a chunk of samples: it
writes to few places at a time, and a compiler's time grows faster than a function's length.
"""

from __future__ import annotations

import numpy as np

from dynident.batch.tape import OPERATIONS, Tape

LANES = 8
"""Samples at a time, and the fewest that a function takes."""

CHUNK = 256
"""Samples for which a function is called."""

ENTRY = "dynident_batch"
"""Name of the function."""

_PART = 500  # steps of one function
_ROW = CHUNK + LANES  # numbers from one row of work to the next; odd in lines of the cache

_HEAD = f"""\
typedef double lanes __attribute__((vector_size({8 * LANES}), may_alias));
typedef lanes loose __attribute__((aligned(8)));
#define W(i) (*(lanes *)(w + {_ROW}l * i + k))
#define Y(i) (*(loose *)(y[i] + s + k))
#define PART(name) static void name(double *restrict w, double *const *y, long s, long m)
#define EACH for (long k = 0; k < m; k += {LANES})
"""

_DRIVER = """\
void {entry}(long samples, const double *const *x, const long *step, double *w, double *const *y)
{{
    for (int i = 0; i < {inputs}; i++)
        for (long k = 0; k < {chunk}; k++) w[{row}l * i + k] = *x[i];
    for (long s = 0, m; s < samples; s += m) {{
        m = samples - s < {chunk} ? (samples - s) / {lanes} * {lanes} : {chunk};
        /* The last samples again, from the inputs on, rather than fewer than lanes. */
        if (!m) m = {lanes}, s = samples - m;
        for (int i = 0; i < {inputs}; i++)
            if (step[i]) __builtin_memcpy(w + {row}l * i, x[i] + s, m * sizeof *w);
{calls}
    }}
}}
"""


_SCALAR_HEAD = """\
#define lanes double
#define W(i) w[i]
#define Y(i) y[i]
#define PART(name) static void name(double *restrict w, double *restrict y)
"""
_SCALAR_TAIL = """\
#undef lanes
#undef W
#undef Y
#undef PART
"""


def c_source(tape: Tape) -> str:
    """Return a C function of what a tape computes.

    Its arguments are the number of samples, at least `LANES`; where each input begins; for each
    input 1, or 0 if one number is for all samples; room for `work_size` numbers, from the beginning
    of a line of the cache on; and the place to write each result to.

    Parameters
    ----------
    tape : to be written.
    """
    parts = _Writer(tape).parts()
    functions = [
        "\n".join([f"PART(part{k})", "{ EACH {", *lines, "} }\n"]) for k, lines in enumerate(parts)
    ]
    driver = _DRIVER.format(
        entry=ENTRY,
        chunk=CHUNK,
        lanes=LANES,
        row=_ROW,
        inputs=tape.inputs,
        calls="\n".join(f"        part{k}(w, y, s, m);" for k in range(len(parts))),
    )
    return "\n".join([_HEAD, *functions, driver])


def scalar_source(tape: Tape, name: str) -> str:
    """Return C of a static function of what a tape computes at one sample.

    Its arguments are room for `scalar_work_size` numbers, which begins with the inputs and keeps
    them, and the place to write all results to, one after the other.

    Parameters
    ----------
    tape : to be written.
    name : of the function.
    """
    parts = _Writer(tape).parts()
    functions = [
        "\n".join([f"PART({name}_part{k})", "{", *lines, "}\n"]) for k, lines in enumerate(parts)
    ]
    calls = " ".join(f"{name}_part{k}(w, y);" for k in range(len(parts)))
    driver = f"static void {name}(double *w, double *y) {{ {calls} }}\n"
    return "\n".join([_SCALAR_HEAD, *functions, driver, _SCALAR_TAIL])


def scalar_work_size(tape: Tape) -> int:
    """How many numbers of room a tape's C function of one sample needs."""
    return tape.inputs + tape.slots + 1


def work_size(tape: Tape) -> int:
    """How many numbers of room a tape's C function needs."""
    return _ROW * (tape.inputs + tape.slots + 1)


class _Writer:
    """Writes the steps of a tape; what only one part of it needs stays in its registers."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.steps = tape.steps.tolist()
        self.first_slot = tape.inputs + len(tape.constants)
        self.first_result = self.first_slot + tape.slots

    def parts(self) -> list[list[str]]:
        """Return the lines of each part."""
        leaves = self._leaves()
        found = []
        for start in range(0, len(self.steps), _PART):
            lines, known = [], {}
            for number in range(start, min(start + _PART, len(self.steps))):
                code, left, right, to = self.steps[number]
                names = [known.get(one, self._outside(one)) for one in (left, right)]
                lines.append(f"lanes t{number} = {names[0]} {OPERATIONS[code]} {names[1]};")
                known[to] = f"t{number}"
                if to >= self.first_result or leaves[number]:
                    lines.append(f"{self._outside(to)} = t{number};")
            found.append(lines)
        return found

    def _outside(self, place: int) -> str:
        """Name of what another part made, or nobody."""
        if place < self.tape.inputs:
            return f"W({place})"
        if place < self.first_slot:
            number = float(self.tape.constants[place - self.tape.inputs])
            return f"((lanes){{0}} + ({number.hex()}))"
        if place < self.first_result:
            return f"W({place - len(self.tape.constants)})"
        return f"Y({place - self.first_result})"

    def _leaves(self) -> np.ndarray:
        """Which steps' values another part reads."""
        leaves = np.zeros(len(self.steps), dtype=bool)
        made: dict[int, int] = {}
        for number, (_, left, right, to) in enumerate(self.steps):
            for place in (left, right):
                if place in made and made[place] // _PART != number // _PART:
                    leaves[made[place]] = True
            made[to] = number
        return leaves
