#include "problem.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Makes M look like what users have: symmetric, skew, a heavy diagonal, few entries, two problems
 * of very different units side by side, noise in the place of zeros (with negative diagonals). */
static void shape(fuzz_bytes *bytes, int32_t n, double *M)
{
    int32_t kind = fuzz_pick(bytes, 8), half = fuzz_pick(bytes, n + 1), i, j;
    double unit = kind == 5 ? pow(10, fuzz_pick(bytes, 61) - 30) : 1.0;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            double *x = &M[i * n + j];

            if (kind == 1 && j < i)
                *x = M[j * n + i];
            else if (kind == 2 && j < i)
                *x = -M[j * n + i];
            else if (kind == 3 && i == j)
                *x = fabs(*x) + n;
            else if (kind == 4 && abs(i - j) > 1)
                *x = 0.0;
            else if (kind == 5 && (i < half) != (j < half))
                *x = 0.0;
            else if (kind == 5 && i >= half)
                *x *= unit;
            else if (kind == 7 && i == j)
                *x = -fabs(*x) - 1.0;
            else if (kind >= 6 && fabs(*x) <= 1.0)
                *x *= (1 + half) * 1e-13;
            if (kind >= 6 && *x == 0)
                *x = (i - j) * (1 + half) * 1e-13;
        }
}

static double bound(fuzz_bytes *bytes, fuzz_mood mood, double infinity)
{
    return fuzz_one_in(bytes, 3) ? infinity : fuzz_number(bytes, mood);
}

static void make_bounds(fuzz_bytes *bytes, lcp_problem *p)
{
    int32_t kind = fuzz_pick(bytes, 4), i;

    p->lower = fuzz_doubles(p->n);
    p->upper = fuzz_doubles(p->n);
    for (i = 0; i < p->n; i++) {
        p->lower[i] = kind & 1 ? bound(bytes, p->mood, -INFINITY) : 0.0;
        p->upper[i] = kind & 2 ? bound(bytes, p->mood, INFINITY) : INFINITY;
        if (p->lower[i] > p->upper[i]) {
            double kept = p->lower[i];

            p->lower[i] = kind & 1 ? p->upper[i] : 0.0;
            p->upper[i] = kind & 1 ? kept : 0.0;
        }
    }
    p->lower_given = kind & 1 ? p->lower : NULL;
    p->upper_given = kind & 2 ? p->upper : NULL;
    p->plain = kind == 0;
}

/* The shapes leave integers, but not always small ones. */
static void note_integers(lcp_problem *p)
{
    int32_t i;

    p->integer = p->plain && p->n <= ORACLE_LARGEST && p->mood == FUZZ_INTEGERS;
    for (i = 0; p->integer && i < p->n * p->n; i++)
        p->integer = fabs(p->M.dense[i]) <= 3 && p->M.dense[i] == rint(p->M.dense[i]);
    for (i = 0; p->integer && i < p->n * p->n; i++)
        p->iM[i] = (int)p->M.dense[i];
    for (i = 0; p->integer && i < p->n; i++)
        p->iq[i] = (int)p->q[i];
}

void lcp_problem_make(fuzz_bytes *bytes, lcp_problem *p, int32_t least, int32_t most)
{
    double *M;

    memset(p, 0, sizeof *p);
    p->mood = fuzz_mood_of(bytes);
    if (p->mood == FUZZ_INTEGERS && least < 5 && most > 5)
        most = 5; /* every index set is looked at */
    p->n = least + fuzz_pick(bytes, most - least + 1);
    make_bounds(bytes, p);
    M = fuzz_doubles(p->n * p->n);
    fuzz_numbers(bytes, p->mood, M, p->n * p->n);
    shape(bytes, p->n, M);
    fuzz_wrap(bytes, &p->M, p->n, p->n, M);
    p->q = fuzz_doubles(p->n);
    fuzz_numbers(bytes, p->mood, p->q, p->n);
    note_integers(p);
    fuzz_show("M", M, p->n * p->n);
    fuzz_show("q", p->q, p->n);
    fuzz_show("lower", p->lower, p->n);
    fuzz_show("upper", p->upper, p->n);
}

int lcp_settings_make(fuzz_bytes *bytes, perp_lcp_settings *settings)
{
    static const double limits[] = {1e-9, 1e-5, 1e-3, 1.0};
    uint8_t flags = fuzz_byte(bytes);

    if (perp_lcp_settings_init(settings, sizeof *settings) != PERP_OK)
        fuzz_fail("perp_lcp_settings_init takes its own size");
    settings->method = (fuzz_pick(bytes, 7) + 1) % 7 - 1; /* 0 first; -1 and polish are refused */
    settings->tol = fuzz_tol(bytes, settings->tol);
    settings->scaling = !(flags & 1);
    settings->polish = !(flags & 2);
    settings->crash = !(flags & 4);
    settings->pivot_rule = (flags & 8) != 0;
    settings->sweep = (flags & 16) != 0;
    settings->acceleration = (flags & 32) != 0;
    settings->relaxation = flags & 64 ? 0.25 + fuzz_pick(bytes, 8) * 0.25 : 1.0;
    settings->penalty = flags & 64 ? fuzz_pick(bytes, 10) * 0.1 : 0.0;
    if (flags & 128) {
        settings->max_iterations = fuzz_pick(bytes, 8);
        settings->time_limit = fuzz_one_in(bytes, 4) ? limits[fuzz_pick(bytes, 4)] : 0.0;
    }
    return settings->max_iterations > 0 || settings->time_limit > 0;
}

void lcp_problem_rows(const lcp_problem *p, const double *z, wide *w, wide *t)
{
    oracle_multiply(p->n, p->n, oracle_wide(p->n * p->n, p->M.dense), oracle_wide(p->n, z),
                    oracle_wide(p->n, p->q), w, t);
}

/* w as reported: recomputed in doubled precision, rounded once; 4 units in the last place, and what
 * n products lose there and at the end of the doubles. */
static void check_w(const char *where, const lcp_problem *p, const double *w, const wide *exact,
                    const wide *t)
{
    int32_t i;

    for (i = 0; i < p->n; i++) {
        wide error = oracle_abs(w[i] - exact[i]), size = oracle_abs(exact[i]);

        if (!isfinite(w[i]) && size + t[i] * 0x1p-98 < (wide)DBL_MAX / 2)
            fuzz_fail("%s: w[%d] = %g is %Lg", where, i, w[i], (long double)exact[i]);
        if (isfinite(w[i]) && error > size * 4 * DBL_EPSILON + t[i] * 0x1p-98 + (wide)0x1p-1060)
            fuzz_fail("%s: w = M z + q: w[%d] = %.17g is %.17Lg", where, i, w[i],
                      (long double)exact[i]);
    }
}

/* With |entries| <= 3 and n <= 6, a solution or none is decided by violations above 1e-5 (Farkas'
 * multipliers are quotients of minors), and the inverse of a regular block is below 1e6. */
static void check_integer(const char *where, const lcp_problem *p, const double *z, int32_t outcome,
                          double tol)
{
    oracle_vertex *vertices = fuzz_take(ORACLE_VERTICES, sizeof *vertices);
    int32_t count, i, k, near = 0;

    if (!fuzz_good(outcome) || tol > 1e-10)
        return;
    count = oracle_vertices(p->n, p->iM, p->iq, vertices);
    if (count == 0)
        fuzz_fail("%s: '%s', but the problem has no solution", where, perp_outcome_text(outcome));
    if (!oracle_nondegenerate(p->n, p->iM))
        return; /* families: the point may be anywhere on one; its rows have been checked */
    for (k = 0; k < count && !near; k++)
        for (near = 1, i = 0; i < p->n; i++)
            near = near && fabs(z[i] - vertices[k].z[i]) <= 1e-3 * (1 + fabs(z[i]));
    if (!near)
        fuzz_fail("%s: '%s', but z is near none of the %d solutions", where,
                  perp_outcome_text(outcome), count);
}

/* Products of numbers like these stay doubles, whatever the order. */
static int is_tame(const double *x, int32_t count)
{
    int32_t i;

    for (i = 0; i < count; i++)
        if (isfinite(x[i]) && x[i] != 0 && (fabs(x[i]) > 1e60 || fabs(x[i]) < 1e-60))
            return 0;
    return 1;
}

/* Whether doubled precision, of about 104 bits, tells rows whose terms are these to tol of q, or of
 * 1 where q is 0: the library calls nothing good that it can't tell. */
static int is_told_by_doubled(const wide *terms, const double *q, int32_t n, double tol)
{
    double largest = 0;
    int32_t i;

    for (i = 0; i < n; i++)
        largest = fmax(largest, fabs(q[i]));
    for (i = 0; i < n; i++)
        if (!((double)terms[i] * 0x1p-104 <= tol * (largest > 0 ? largest : 1)))
            return 0;
    return 1;
}

void lcp_problem_check(const char *where, const lcp_problem *p, const double *z, const double *w,
                       int32_t outcome, double tol, int ended_early)
{
    int mark = fuzz_mark();
    wide *exact = fuzz_take(p->n, sizeof *exact), *t = fuzz_take(p->n, sizeof *t);
    oracle_point point = {where,    p->n, outcome, tol, p->M.dense, p->lower,
                          p->upper, z,    exact,   t,   NULL,       0};
    int32_t i;

    for (point.homogeneous = 1, i = 0; i < p->n; i++)
        point.homogeneous = point.homogeneous && p->q[i] == 0;
    for (i = 0; i < p->n; i++)
        if (!isfinite(z[i])) {
            if (fuzz_good(outcome))
                fuzz_finite("z", z, p->n);
            return;
        }
    lcp_problem_rows(p, z, exact, t);
    oracle_check_point(&point);
    if (w && fuzz_good(outcome))
        fuzz_finite("w", w, p->n);
    if (w)
        check_w(where, p, w, exact, t);
    if (p->integer)
        check_integer(where, p, z, outcome, tol);
    if (!fuzz_good(outcome) && !ended_early && is_tame(p->M.dense, p->n * p->n) &&
        is_tame(p->q, p->n) && is_tame(p->lower, p->n) && is_tame(p->upper, p->n) &&
        is_told_by_doubled(t, p->q, p->n, tol) && oracle_is_exact(&point))
        fuzz_fail("%s: z solves the problem without any error and is called '%s'", where,
                  perp_outcome_text(outcome));
    fuzz_drop_to(mark);
}
