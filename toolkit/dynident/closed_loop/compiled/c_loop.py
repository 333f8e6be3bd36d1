"""C of the loop: a controller, a hold with a delay, an encoder, and steps between its samples.

Between two changes of the command the state goes by as many equal steps of the classical
Runge-Kutta rule of fourth order as its distance from the midpoint rule asks for, which stands among
its stages. That distance is what Drake's Runge-Kutta 3(2) holds below its accuracy as well.
"""

from __future__ import annotations

from dynident.closed_loop.compiled.c_body import BODY_COUNTS, BODY_NUMBERS

READ = (
    *(f"truth_{name}" for name in BODY_NUMBERS),
    *(f"nominal_{name}" for name in BODY_NUMBERS),
    *("start", "q_ref", "ahead", "noise", "resolution", "before", "speed", "integral"),
    *("kp", "kd", "ki", "limit", "settings"),
)
"""Arrays of doubles that the function reads; (T, n) at samples, (n,) else. `settings`: time of the
first sample in s, samples per second, share of a sample by which the delay is more than whole
samples, blend of the velocity filter, squared norm of a state that has run away, and the
accuracy."""

COUNTED = (
    *(f"truth_{name}" for name in BODY_COUNTS),
    *(f"nominal_{name}" for name in BODY_COUNTS),
    "whole",
)
"""Arrays of integers that it reads. `whole`: samples, samples of delay, whether the law goes
through the nominal model, whether there is an integral, a limit, noise, a resolution, the
logarithms (base 2) of the fewest and the most steps of a stretch, and the samples from one pose of
the reference to the next at which the inertia is looked at."""

WRITTEN = ("states", "measured", "commands", "saturated", "room", "found")
"""Arrays of doubles that it writes, and its room. `found`: the sample where it ended, the steps
that it took, and the most steps of a stretch."""

DONE, FAR, SINGULAR, STIFF = range(4)
"""What it returns: it went to the end, ran away, lost its inertia, or needs shorter steps."""

LOOP = """\
/* One step of h from y, in place; the largest distance from the midpoint rule into *off. */
static int step(const body *b, double t, double h, const double *u, double *y, double *off)
{
    double k[4][S], at[S];
    if (!rates(b, t, y, u, k[0])) return 0;
    for (int i = 0; i < S; i++) at[i] = y[i] + h / 2.0 * k[0][i];
    if (!rates(b, t + h / 2.0, at, u, k[1])) return 0;
    for (int i = 0; i < S; i++) at[i] = y[i] + h / 2.0 * k[1][i];
    if (!rates(b, t + h / 2.0, at, u, k[2])) return 0;
    for (int i = 0; i < S; i++) at[i] = y[i] + h * k[2][i];
    if (!rates(b, t + h, at, u, k[3])) return 0;
    double most = 0.0;
    for (int i = 0; i < S; i++) {
        double ends = k[0][i] + k[3][i], middle = k[2][i];
        double away = fabs(h / 6.0 * (ends - 4.0 * k[1][i] + 2.0 * middle));
        y[i] += h / 6.0 * (ends + 2.0 * (k[1][i] + middle));
        if (!(away <= most)) most = away; /* true of NaN too */
    }
    *off = most;
    return 1;
}

/* A stretch of constant torque; `level`, the logarithm of its steps, is kept for the next. */
static int stretch(const body *b, double t, double length, const double *u, double *y,
    double accuracy, const long *whole, long *level, double *found)
{
    for (;; ++*level) {
        long steps = 1l << *level;
        double at[S], h = length / steps, worst = 0.0;
        memcpy(at, y, sizeof at);
        int sound = 1;
        for (long k = 0; k < steps && sound && worst <= accuracy; k++) {
            double off;
            sound = step(b, t + k * h, h, u, at, &off);
            if (!(off <= worst)) worst = off;
            found[1] += 1.0;
        }
        if (sound && worst <= accuracy) {
            memcpy(y, at, sizeof at);
            if (steps > found[2]) found[2] = steps;
            if (*level > whole[7] && worst < accuracy / 16.0) --*level;
            return DONE;
        }
        if (*level >= whole[8]) return sound ? STIFF : SINGULAR;
    }
}

int dynident_loop(const double *const *x, const long *const *c, double *const *y)
{
    const long *whole = c[at_whole];
    const double *settings = x[at_settings];
    const long samples = whole[0], late = whole[1];
    const double rate = settings[1], rest = settings[2], blend = settings[3];
    double *found = y[at_found], *commands = y[at_commands];
    double *truth_room = y[at_room], *nominal_room = y[at_room] + TRUTH_ROOM;
    const body truth = {FIELDS(truth_), truth_equations, truth_others, truth_room};
    const body nominal = {FIELDS(nominal_), nominal_equations, nominal_others, nominal_room};
    memcpy(truth_room + 5 * N, truth.theta, 10 * N * sizeof *truth_room);
    memcpy(nominal_room + 5 * N, nominal.theta, 10 * N * sizeof *nominal_room);

    double state[S], before[N], speed[N], integral[N];
    memset(state, 0, sizeof state);
    for (long k = 0; k < samples; k += whole[9])
        if (!sound(&truth, x[at_q_ref] + k * N)) return SINGULAR;
    memcpy(state, x[at_start], 2 * N * sizeof *state);
    memcpy(before, x[at_before], sizeof before);
    memcpy(speed, x[at_speed], sizeof speed);
    memcpy(integral, x[at_integral], sizeof integral);
    long level = whole[7];
    for (long k = 0; k < samples; k++) {
        double time = settings[0] + k / rate, far = 0.0;
        double *q = y[at_measured] + k * N, *u = commands + k * N, *full = y[at_saturated] + k * N;
        found[0] = k;
        for (int i = 0; i < S; i++) far += state[i] * state[i];
        if (!(far < settings[4])) return FAR;
        memcpy(y[at_states] + k * S, state, sizeof state);
        memcpy(q, state, N * sizeof *q);
        if (whole[5]) for (int i = 0; i < N; i++) q[i] += x[at_noise][k * N + i];
        if (whole[6]) for (int i = 0; i < N; i++) {
            double unit = x[at_resolution][i];
            if (unit > 0.0) q[i] = rint(q[i] / unit) * unit;
        }
        double wound[N];
        for (int i = 0; i < N; i++) {
            speed[i] += blend * ((q[i] - before[i]) * rate - speed[i]);
            if (blend == 1.0) speed[i] = (q[i] - before[i]) * rate;
            before[i] = q[i];
            wound[i] = integral[i];
            u[i] = x[at_ahead][k * N + i] - x[at_kp][i] * q[i] - x[at_kd][i] * speed[i];
            if (whole[3]) {
                wound[i] += x[at_ki][i] * (x[at_q_ref][k * N + i] - q[i]);
                u[i] += wound[i];
            }
        }
        if (whole[2]) {
            double a[N];
            memcpy(a, u, sizeof a);
            inverse_dynamics(&nominal, q, speed, a, u);
        }
        for (int i = 0; i < N; i++) {
            double most = x[at_limit][i];
            full[i] = whole[4] && fabs(u[i]) >= most;
            if (full[i] > 0.0) u[i] = u[i] > 0.0 ? most : -most;
            else integral[i] = wound[i];
        }
        /* Before the first command acts, it is as if it did. */
        const double *now = commands + (k > late ? k - late : 0) * N;
        double first = k && rest > 0.0 ? rest / rate : 0.0;
        int said = DONE;
        if (first > 0.0) {
            const double *old = commands + (k > late + 1 ? k - late - 1 : 0) * N;
            said = stretch(&truth, time, first, old, state, settings[5], whole, &level, found);
        }
        if (said == DONE)
            said = stretch(&truth, time + first, 1.0 / rate - first, now, state, settings[5],
                           whole, &level, found);
        if (said != DONE) return said;
    }
    found[0] = samples;
    return DONE;
}
"""
ENTRY = "dynident_loop"
"""Name of the function."""
