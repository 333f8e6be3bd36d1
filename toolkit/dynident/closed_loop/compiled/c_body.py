"""C of one body: the acceleration of a mechanism under torques, and the torque of a motion.

`body_source` fills in which equations of motion and which forces of effects it calls; the numbers
of the mechanism come at run time (`BODY_NUMBERS`, `BODY_COUNTS`).
"""

from __future__ import annotations

BODY_NUMBERS = ("theta", "inertia", "gain", "loss", "widths", "values", "slopes", "factors")
"""Arrays of doubles of a body: (10 n,) parameters; (n, n) inertia on top; (n,) gain, loss and width
of dry friction; start and values of the effects that are traced; (U,) slopes of units and (L,)
coefficients of links, see `BODY_COUNTS`."""

BODY_COUNTS = ("flags", "units", "of", "links")
"""Arrays of integers of a body: whether its inertia is coupled, whether torque is lost, and how
many units there are; for each unit its law, its end in `of` and its end in `links`; joints whose
motion a unit sums; joints whose torque a unit changes, each with its factor."""

LAWS = ("constant", "position", "speed", "sign", "magnitude")
"""Laws of units, by their numbers in C."""

HEAD = """\
#include <math.h>
#include <string.h>

#define TRIANGLE (N * (N + 1) / 2)

typedef struct {
    const double *theta, *inertia, *gain, *loss, *widths, *values, *slopes, *factors;
    const long *flags, *units, *of, *links;
    void (*equations)(double *, double *);
    void (*others)(double, const double *, const double *, const double *, double *, double *);
    double *room;
} body;

static double smooth_sign(double x)
{
    return 1.0 - 2.0 / (exp(2.0 * x) + 1.0);
}

/* The forces of all terms, with the sign that they act with. */
static void terms(const body *b, const double *y, double *force)
{
    long of = 0, link = 0;
    for (long k = 0; k < b->flags[2]; k++) {
        long law = b->units[3 * k], of_end = b->units[3 * k + 1], end = b->units[3 * k + 2];
        const double *from = law == 1 ? y : y + N;
        double x = 0.0;
        for (; of < of_end; of++) x += from[b->of[of]];
        if (law == 0) x = 1.0;
        else if (law == 3) x = smooth_sign(x * b->slopes[k]);
        else if (law == 4) x = fabs(x);
        for (; link < end; link++) force[b->links[link]] -= b->factors[link] * x;
    }
}

/* Inertia (lower triangle) and bias at a state, into `out`. */
static void joint_space(const body *b, const double *y, double *out)
{
    double *w = b->room;
    for (int i = 0; i < N; i++) {
        if (TURNS[i]) w[i] = cos(y[i]), w[N + i] = sin(y[i]);
        w[2 * N + i] = y[i], w[3 * N + i] = y[N + i];
    }
    b->equations(w, out);
}

/* Solves A x = x for a full matrix, with pivots. Returns the sign of its determinant. */
static int solve_full(double A[N][N], double *x)
{
    int sign = 1;
    for (int j = 0; j < N; j++) {
        int best = j;
        for (int i = j + 1; i < N; i++) if (fabs(A[i][j]) > fabs(A[best][j])) best = i;
        if (!(fabs(A[best][j]) > 0.0)) return 0;
        if (best != j) {
            sign = -sign;
            for (int k = 0; k < N; k++) {
                double held = A[j][k];
                A[j][k] = A[best][k], A[best][k] = held;
            }
            double held = x[j];
            x[j] = x[best], x[best] = held;
        }
        if (A[j][j] < 0.0) sign = -sign;
        for (int i = j + 1; i < N; i++) {
            double share = A[i][j] / A[j][j];
            for (int k = j + 1; k < N; k++) A[i][k] -= share * A[j][k];
            x[i] -= share * x[j];
        }
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int k = i + 1; k < N; k++) x[i] -= A[i][k] * x[k];
        x[i] /= A[i][i];
    }
    return sign;
}

/* Solves M x = x by M = L D L', in place. Returns whether M is positive definite. */
static int solve_positive(double *M, double *x)
{
    double inverse[N];
    for (int i = 0; i < N; i++) {
        double *row = M + i * (i + 1) / 2, pivot = row[i];
        for (int j = 0; j < i; j++) {
            const double *other = M + j * (j + 1) / 2;
            double sum = row[j];
            for (int k = 0; k < j; k++) sum -= row[k] * other[k];
            row[j] = sum; /* L D, until the row is done */
        }
        for (int j = 0; j < i; j++) {
            double scaled = row[j] * inverse[j];
            pivot -= scaled * row[j];
            row[j] = scaled;
        }
        if (!(pivot > 0.0)) return 0;
        inverse[i] = 1.0 / pivot;
        for (int j = 0; j < i; j++) x[i] -= row[j] * x[j];
    }
    for (int i = 0; i < N; i++) x[i] *= inverse[i];
    for (int i = N - 1; i > 0; i--) {
        const double *row = M + i * (i + 1) / 2;
        for (int j = 0; j < i; j++) x[j] -= row[j] * x[i];
    }
    return 1;
}

/* The whole inertia, from the bodies' lower triangle. */
static void whole_inertia(const body *b, const double *out, double A[N][N])
{
    for (int i = 0, k = 0; i < N; i++)
        for (int j = 0; j <= i; j++, k++) A[i][j] = A[j][i] = out[k];
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) A[i][j] += b->inertia[N * i + j];
}

static void add_motors(const body *b, double *out)
{
    for (int i = 0; i < N; i++) out[i * (i + 3) / 2] += b->inertia[N * i + i];
}

/* Whether the inertia with the motors is positive definite at a pose, and so what is coupled. */
static int sound(const body *b, const double *q)
{
    double y[S], out[TRIANGLE + N], A[N][N], x[N];
    memset(y, 0, sizeof y), memset(x, 0, sizeof x);
    memcpy(y, q, N * sizeof *y);
    joint_space(b, y, out);
    whole_inertia(b, out, A);
    add_motors(b, out);
    return solve_positive(out, x) && (!b->flags[0] || solve_full(A, x) > 0);
}

/* Rates of q, v and memory under recorded torques u. Returns whether the inertia allows it. */
static int rates(const body *b, double t, const double *y, const double *u, double *dy)
{
    double out[TRIANGLE + N], *x = dy + N;
    joint_space(b, y, out);
    for (int i = 0; i < N; i++) {
        double acting = u[i] / b->gain[i];
        if (b->flags[1]) {
            double lost = b->loss[i] * smooth_sign(y[N + i] / b->widths[i]);
            acting /= 1.0 + lost * ((acting > 0.0) - (acting < 0.0));
        }
        dy[i] = y[N + i];
        x[i] = acting - out[TRIANGLE + i];
    }
    terms(b, y, x);
    if (b->others) b->others(t, y, y + 2 * N, b->values, x, dy + 2 * N);
    if (b->flags[0]) {
        double A[N][N];
        whole_inertia(b, out, A);
        return solve_full(A, x) != 0;
    }
    add_motors(b, out);
    return solve_positive(out, x);
}

/* Recorded torques of a motion, at time zero, as if there was no memory. */
static void inverse_dynamics(
    const body *b, const double *q, const double *v, const double *a, double *u)
{
    double out[TRIANGLE + N], y[S], unused[S], force[N];
    memset(y, 0, sizeof y);
    memcpy(y, q, N * sizeof *y), memcpy(y + N, v, N * sizeof *y);
    memset(force, 0, sizeof force);
    joint_space(b, y, out);
    terms(b, y, force);
    if (b->others) b->others(-b->values[0], y, y + 2 * N, b->values, force, unused);
    for (int i = 0; i < N; i++) {
        double load = out[TRIANGLE + i] - force[i];
        for (int j = 0; j < N; j++) {
            int k = i > j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i;
            load += (out[k] + b->inertia[N * i + j]) * a[j];
        }
        u[i] = b->gain[i] * (load + b->loss[i] * fabs(load) * smooth_sign(v[i] / b->widths[i]));
    }
}
"""

OTHERS = """\
static void {name}_others(double t, const double *y, const double *z, const double *values,
    double *force, double *rate)
{{
    double in[{inputs}], out[{outputs}], w[{room}];
    long long iw[{whole}];
    const double *arg[{args}] = {{in}};
    double *res[{results}] = {{out}};
    in[0] = t;
    memcpy(in + 1, y, 2 * N * sizeof *in);
    memcpy(in + 1 + 2 * N, z, {memory} * sizeof *in);
    memcpy(in + 1 + 2 * N + {memory}, values, {parameters} * sizeof *in);
    {name}_traced(arg, res, iw, w, 0);
    for (int i = 0; i < N; i++) force[i] += out[i];
    memcpy(rate, out + N, {memory} * sizeof *rate);
}}
"""
