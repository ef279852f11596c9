/* Chandrasekaran's method for Z-matrices ("A special case of the complementary pivot problem",
 * Opsearch 7 (1970) 263) on a tridiagonal M-matrix. With x = z - l >= 0:
 *
 *   Let x solve the equations of an index set B that lies in the solution's, x = 0 elsewhere. Then
 *   x is below the solution x*, as M_BB^-1 >= 0 and M_BN <= 0. A row i outside of B with w_i < 0
 *   has x*_i > 0, since x*_i = 0 would give w*_i <= w_i < 0. So i may enter B, and nothing ever
 *   leaves. Variables without a bound are in B from the start.
 *
 * The index set consists of runs of neighbours. A row outside needs of the runs beside it only the
 * x at their near ends. Each run [a, b] keeps
 *
 *   x_a = first[0] + first[1] x_(a-1) + first[2] x_(b+1),   x_b = last[0] + ... alike,
 *
 * and where two runs meet, two such pairs give the pair of the whole: one division. The rows are
 * scanned from left to right; a run that grew to the right may draw in rows on its left. Every row
 * enters once, every entry costs one or two merges, so all is O(n). Differences of like signs occur
 * in the constants only; what they round away moves rows with w_i near 0.
 *
 * Positive couplings and bounds on the other side are left out of account at first: where there are
 * few, as in option prices by central differences or with a cap, the index set is near the right
 * one. Whether it is right the signs tell in the end, with all of the problem. */
#include "base/rounding.h"
#include "lcp/active_set/active_set.h"

#include <math.h>

typedef struct perp__run {
    int32_t a, b;
    double first[3], last[3];
} run;

typedef struct scan {
    const perp__tridiagonal *T;
    const perp__lcp_problem *problem;
    const double *q;
    run *runs; /* left of the row that is looked at; x = 0 between them */
    int32_t top;
    double sign; /* -1: reflected, the bounds are upper ones */
} scan;

void perp__tridiagonal_lcp_layout(perp__arena *arena, perp__tridiagonal_lcp *work, size_t n)
{
    work->runs = perp__arena_take(arena, n, sizeof(run));
    perp__tridiagonal_layout(arena, &work->Z, n);
    PERP__DOUBLES(arena, n, &work->q, &work->x);
    work->active = perp__arena_take(arena, n, sizeof(int32_t));
    work->examined = 0; /* another matrix, other bounds */
}

static bool is_fixed(const scan *s, int32_t i)
{
    return s->problem->lower[i] == s->problem->upper[i];
}

/* The bound on the side that counts. */
static double bound_of(const scan *s, int32_t i)
{
    return s->sign > 0.0 ? s->problem->lower[i] : s->problem->upper[i];
}

static double finite_bound_of(const scan *s, int32_t i)
{
    return isfinite(bound_of(s, i)) ? bound_of(s, i) : 0.0;
}

static run single(const scan *s, int32_t i)
{
    const perp__tridiagonal *T = s->T;
    const double pivot = T->diagonal[i];
    run r;

    r.a = r.b = i;
    r.first[0] = r.last[0] = -s->q[i] / pivot;
    r.first[1] = r.last[1] = i > 0 ? -T->below[i - 1] / pivot : 0.0;
    r.first[2] = r.last[2] = -T->above[i] / pivot;
    return r;
}

/* left := left and right together, which are neighbours. */
static void join(run *left, const run *right)
{
    /* x_b = last[0] + last[1] x_(a-1) + last[2] x_(b+1) with x_(b+1) from `right` */
    const double scale = 1.0 / (1.0 - left->last[2] * right->first[1]);
    const double end[3] = {(left->last[0] + left->last[2] * right->first[0]) * scale,
                           left->last[1] * scale, left->last[2] * right->first[2] * scale};
    const double next[3] = {right->first[0] + right->first[1] * end[0], right->first[1] * end[1],
                            right->first[2] + right->first[1] * end[2]};

    left->first[0] += left->first[2] * next[0];
    left->first[1] += left->first[2] * next[1];
    left->first[2] *= next[2];
    left->last[0] = right->last[0] + right->last[1] * end[0];
    left->last[1] = right->last[1] * end[1];
    left->last[2] = right->last[2] + right->last[1] * end[2];
    left->b = right->b;
}

/* Row i, whose w is given, joins the last run on its right: a step of elimination, which is `join`
 * with single(s, i) in fewer operations. */
static void append(scan *s, int32_t i, double w)
{
    run *r = &s->runs[s->top];
    const double below = s->T->below[i - 1];
    const double reciprocal = 1.0 / (s->T->diagonal[i] + below * r->last[2]);

    r->last[0] = -w * reciprocal;
    r->last[1] *= -below * reciprocal;
    r->last[2] = -s->T->above[i] * reciprocal;
    r->first[0] += r->first[2] * r->last[0];
    r->first[1] += r->first[2] * r->last[1];
    r->first[2] *= r->last[2];
    r->b = i;
}

/* The last run has changed: joins it with what it touches, and lets in the rows on its left whose w
 * has become negative. */
static void settle(scan *s)
{
    for (;;) {
        run *r = &s->runs[s->top];
        const int32_t i = r->a - 1;
        double w;

        if (i >= 0 && s->top > 0 && r[-1].b == i) {
            join(r - 1, r);
            s->top--;
            continue;
        }
        if (i < 0 || is_fixed(s, i))
            return;
        w = s->q[i] + s->T->above[i] * r->first[0];
        if (i > 0) /* x at the end of the run before, where that touches row i */
            w += s->T->below[i - 1] * (s->top > 0 && r[-1].b == i - 1 ? r[-1].last[0] : 0.0);
        if (!(w < 0.0))
            return;
        r[1] = *r; /* row i is right of it by one at least: there is room */
        *r = single(s, i);
        join(r, r + 1);
    }
}

static bool is_free(const scan *s, int32_t i)
{
    return i < s->T->n && !isfinite(bound_of(s, i));
}

/* Looks at one row after the other. Free variables are there before their neighbours are looked at:
 * their x may be negative. */
static void enter_all(scan *s)
{
    const perp__tridiagonal *T = s->T;
    int32_t i = 0;

    s->top = -1;
    while (i < T->n) {
        const int32_t is_inside = is_free(s, i), first = is_inside ? i : i + 1;
        const bool has_ahead = is_free(s, first);
        run ahead = {0};

        if (has_ahead)
            ahead = single(s, first);
        for (int32_t k = first + 1; has_ahead && is_free(s, k); k++) {
            const run next = single(s, k);

            join(&ahead, &next);
        }
        if (!is_inside && !is_fixed(s, i)) {
            const bool touches = s->top >= 0 && s->runs[s->top].b == i - 1;
            double w = s->q[i];

            if (touches)
                w += T->below[i - 1] * s->runs[s->top].last[0];
            if ((has_ahead ? w + T->above[i] * ahead.first[0] : w) < 0.0) {
                if (touches)
                    append(s, i, w);
                else
                    s->runs[++s->top] = single(s, i);
                if (has_ahead)
                    join(&s->runs[s->top], &ahead);
                settle(s);
                i = s->runs[s->top].b + 1;
                continue;
            }
        }
        if (has_ahead) {
            s->runs[++s->top] = ahead;
            settle(s);
            i = ahead.b;
        }
        i++;
    }
}

static double row_times(const perp__tridiagonal *T, int32_t i, const double *z)
{
    double sum = T->diagonal[i] * z[i];

    if (i > 0)
        sum += T->below[i - 1] * z[i - 1];
    return i + 1 < T->n ? sum + T->above[i] * z[i + 1] : sum;
}

/* The places of the rows in runs, which are listed, and of the others; and
 * z_A = -S_AA^-1 (q_A + S_AN z_N) with the others at their bounds. */
static perp_status solve_equations(const scan *s, int8_t *places, double *z, int32_t *active,
                                   double *x)
{
    const perp__lcp_problem *p = s->problem;
    int32_t count = 0;
    perp_status status;

    for (int32_t i = 0; i < p->n; i++) {
        places[i] = is_fixed(s, i) ? PERP__FIXED : s->sign > 0.0 ? PERP__AT_LOWER : PERP__AT_UPPER;
        z[i] = finite_bound_of(s, i);
    }
    for (int32_t k = 0; k <= s->top; k++)
        for (int32_t i = s->runs[k].a; i <= s->runs[k].b; i++) {
            places[i] = PERP__BETWEEN;
            z[i] = 0.0;
            active[count++] = i;
        }
    status = perp__sparse_block_factor(p->block, active, count, 0.0);
    if (status != PERP_OK)
        return status;
    for (int32_t k = 0; k < count; k++)
        x[active[k]] = -(p->q[active[k]] + row_times(&p->block->T, active[k], z));
    perp__sparse_block_solve(p->block, x, 0);
    for (int32_t k = 0; k < count; k++)
        z[active[k]] = x[active[k]];
    return PERP_OK;
}

/* The problem without positive couplings, as central differences leave a few, its bounds on one
 * side shifted to 0. Returns 0 if it is not one for this method. */
static bool begin(scan *s, perp__tridiagonal_lcp *work, const perp__lcp_problem *problem)
{
    const perp__tridiagonal *T = &problem->block->T;
    perp__tridiagonal *Z = &work->Z;
    int32_t balance = 0, finite = 1, i;
    double before = 0.0, here, pivot = 1.0;

    if (!work->examined) {
        work->examined = work->suits = 1;
        Z->n = T->n;
        /* Elimination from the top: a Z-matrix is a nonsingular M-matrix if and only if all its
         * pivots are positive (Berman & Plemmons, "Nonnegative Matrices", chapter 6, E17). */
        for (i = 0; i < T->n; i++) {
            Z->below[i] = T->below[i] < 0.0 ? T->below[i] : 0.0;
            Z->diagonal[i] = T->diagonal[i];
            Z->above[i] = T->above[i] < 0.0 ? T->above[i] : 0.0;
            pivot = Z->diagonal[i] - (i > 0 ? Z->below[i - 1] * Z->above[i - 1] / pivot : 0.0);
            work->suits &= pivot > 0.0;
            balance += (problem->lower[i] > -INFINITY) - (problem->upper[i] < INFINITY);
        }
        work->sign = balance < 0 ? -1.0 : 1.0; /* the bounds of which there are more */
    }
    s->T = Z;
    s->problem = problem;
    s->q = work->q;
    s->runs = work->runs;
    s->sign = work->sign;
    here = finite_bound_of(s, 0);
    for (i = 0; i < Z->n && work->suits; i++) {
        const double after = i + 1 < Z->n ? finite_bound_of(s, i + 1) : 0.0;
        double q = problem->q[i] + Z->diagonal[i] * here;

        q += i > 0 ? Z->below[i - 1] * before : 0.0;
        q += Z->above[i] * after;
        work->q[i] = s->sign * q;
        finite &= isfinite(q) != 0;
        before = here;
        here = after;
    }
    return work->suits && finite;
}

perp_status perp__tridiagonal_lcp_solve(perp__tridiagonal_lcp *work,
                                        const perp__lcp_problem *problem, int8_t *places, double *z,
                                        int32_t *found)
{
    double z_largest = 0.0;
    int32_t wrong = 0, i;
    perp_status status;
    scan s;

    *found = PERP__TRIDIAGONAL_NO;
    if (!begin(&s, work, problem))
        return PERP_OK;
    enter_all(&s);
    status = solve_equations(&s, places, z, work->active, work->x);
    if (status != PERP_OK)
        return status < 0 ? status : PERP_OK;
    /* How many z and w do not have the signs that the places ask for, up to rounding in w. */
    for (i = 0; i < problem->n; i++)
        z_largest = fabs(z[i]) > z_largest ? fabs(z[i]) : z_largest;
    for (i = 0; i < problem->n; i++) {
        if (places[i] == PERP__BETWEEN) {
            wrong += !(z[i] >= problem->lower[i] && z[i] <= problem->upper[i]);
        } else if (places[i] != PERP__FIXED) {
            const double w = s.sign * (row_times(&problem->block->T, i, z) + problem->q[i]);
            const double size = problem->row_norms[i] * z_largest + fabs(problem->q[i]);

            wrong += !(w >= -PERP__ROUNDING_LIMIT * size);
        }
    }
    *found = wrong == 0                 ? PERP__TRIDIAGONAL_SOLVED
             : wrong <= problem->n / 64 ? PERP__TRIDIAGONAL_NEAR
                                        : PERP__TRIDIAGONAL_FAR;
    return PERP_OK;
}
