"""The recursion of links in dead zones as C, a vector of links at a time.

The operations, and their order, are those that `dead_zone` does by NumPy, step by step.
"""

from __future__ import annotations

LANES = 4
"""Links that walk together: wider vectors than the processor has are slow."""

ENTRY = "dynident_dead_zones"
"""Name of the function: of the steps of each link, pointers to whole, needed, a, c and g of each,
stiffness, damping, half gap, rotor, least inertia and step (6, LANES), and pointers to the
deflection of each. A link that is at its end before others keeps its last values."""

SOURCE = f"""\
typedef double lanes __attribute__((vector_size({8 * LANES}), aligned(8)));
typedef long long masks __attribute__((vector_size({8 * LANES}), aligned(8)));
#define OF(x) (lanes){{{", ".join(f"x[{5 * v}][at[{v}]]" for v in range(LANES))}}}
#define PICK(mask, a, b) (lanes)(((mask) & (masks)(a)) | (~(mask) & (masks)(b)))

void {ENTRY}(const long *steps, const double *const *x, const lanes *value, double *const *y)
{{
    const double *const *whole = x, *const *needed = x + 1, *const *a = x + 2;
    const double *const *c = x + 3, *const *g = x + 4;
    const lanes K = value[0], D = value[1], half = value[2];
    const lanes rotor = value[3], least = value[4], h = value[5];
    const lanes one = (lanes){{0}} + 1.0, low = -half, gear = D / (2.0 * h);
    long at[{LANES}], most = 0;
    for (int v = 0; v < {LANES}; v++) most = steps[v] > most ? steps[v] : most;
    lanes start[2];
    for (long k = 0; k < 2; k++) {{
        for (int v = 0; v < {LANES}; v++) at[v] = k;
        const lanes L = OF(needed) - rotor * OF(a), lean = PICK(L >= 0.0, one, -one);
        start[k] = (L + lean * K * half) / (OF(g) + K);
        for (int v = 0; v < {LANES}; v++) y[v][k] = start[k][v];
    }}
    lanes before = start[0], now = start[1];
    for (long k = 1; k < most - 1; k++) {{
        for (int v = 0; v < {LANES}; v++) at[v] = k < steps[v] ? k : steps[v] - 1;
        const lanes load = OF(needed) - rotor * OF(a), left = OF(whole) - rotor;
        const lanes mass = PICK(left < least, least, left) / (h * h), damping = OF(c) / (2.0 * h);
        lanes clipped = PICK(now < low, low, now);
        clipped = PICK(clipped > half, half, clipped);
        const lanes beyond = now - clipped;
        const masks touches = beyond != 0.0;
        const lanes free = 1.0 / (mass + damping), held = 1.0 / (mass + (damping + gear));
        const lanes ahead = PICK(touches, held, free);
        const lanes back = PICK(touches, (mass - (damping + gear)) * held, (mass - damping) * free);
        const lanes pushed = (2.0 * mass - OF(g)) * now + load - K * beyond;
        const lanes after = pushed * ahead - back * before;
        for (int v = 0; v < {LANES}; v++)
            if (k + 1 < steps[v]) y[v][k + 1] = after[v];
        before = now;
        now = after;
    }}
}}
"""
