"""The recursion of links in dead zones as C, a vector of links at a time.

The operations, and their order, are those that `dead_zone` does by NumPy, step by step.
"""

from __future__ import annotations

LANES = 4
"""Links that walk together: wider vectors than the processor has are slow."""

ENTRY = "dynident_dead_zones"
"""Name of the function: of the number of steps, of pointers to m, load, c and g of each link, of
stiffness, damping, half gap and step (4, LANES), and of pointers to the deflection and the side of
each link, which are to be zero before."""

SOURCE = f"""\
typedef double lanes __attribute__((vector_size({8 * LANES}), aligned(8)));
typedef long long masks __attribute__((vector_size({8 * LANES}), aligned(8)));
#define OF(x, k) (lanes){{{", ".join(f"x[{4 * v}][k]" for v in range(LANES))}}}
#define PICK(mask, a, b) (lanes)(((mask) & (masks)(a)) | (~(mask) & (masks)(b)))

void {ENTRY}(long steps, const double *const *x, const lanes *value, double *const *y)
{{
    const double *const *m = x, *const *load = x + 1, *const *c = x + 2, *const *g = x + 3;
    const lanes K = value[0], D = value[1], half = value[2], h = value[3];
    const lanes one = (lanes){{0}} + 1.0, low = -half, gear = D / (2.0 * h);
    lanes start[2];
    for (long k = 0; k < 2; k++) {{
        const lanes L = OF(load, k), lean = PICK(L >= 0.0, one, -one);
        start[k] = (L + lean * K * half) / (OF(g, k) + K);
        for (int v = 0; v < {LANES}; v++) y[2 * v][k] = start[k][v];
    }}
    lanes before = start[0], now = start[1];
    for (long k = 1; k < steps - 1; k++) {{
        const lanes mass = OF(m, k) / (h * h), damping = OF(c, k) / (2.0 * h);
        lanes clipped = PICK(now < low, low, now);
        clipped = PICK(clipped > half, half, clipped);
        const lanes beyond = now - clipped;
        const masks touches = beyond != 0.0;
        const lanes free = 1.0 / (mass + damping), held = 1.0 / (mass + (damping + gear));
        const lanes ahead = PICK(touches, held, free);
        const lanes back = PICK(touches, (mass - (damping + gear)) * held, (mass - damping) * free);
        const lanes pushed = (2.0 * mass - OF(g, k)) * now + OF(load, k) - K * beyond;
        const lanes after = pushed * ahead - back * before;
        const lanes side = PICK(beyond > 0.0, one, PICK(beyond < 0.0, -one, one - one));
        for (int v = 0; v < {LANES}; v++) y[2 * v][k + 1] = after[v], y[2 * v + 1][k] = side[v];
        before = now;
        now = after;
    }}
}}
"""
