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
#include "lcp/active_set/tridiagonal.h"

#include <float.h>
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

/* Elimination from the top: a Z-matrix is a nonsingular M-matrix if and only if all its pivots are
 * positive (Berman & Plemmons, "Nonnegative Matrices", chapter 6, condition E17). */
static int32_t is_m_matrix(const perp__tridiagonal *T)
{
    double pivot = 1.0;

    for (int32_t i = 0; i < T->n; i++) {
        pivot = T->diagonal[i] - (i > 0 ? T->below[i - 1] * T->above[i - 1] / pivot : 0.0);
        if (!(pivot > 0.0))
            return 0;
    }
    return 1;
}

/* The matrix without positive couplings, as central differences leave a few. */
static void read_z_part(perp__tridiagonal *Z, const perp__tridiagonal *T)
{
    Z->n = T->n;
    for (int32_t i = 0; i < T->n; i++) {
        Z->below[i] = T->below[i] < 0.0 ? T->below[i] : 0.0;
        Z->diagonal[i] = T->diagonal[i];
        Z->above[i] = T->above[i] < 0.0 ? T->above[i] : 0.0;
    }
}

/* 1: lower bounds count; -1: upper ones, where there are more of them. */
static double side_of_bounds(const perp__lcp_problem *p)
{
    int32_t balance = 0, i;

    for (i = 0; i < p->n; i++)
        balance += (p->lower[i] > -INFINITY) - (p->upper[i] < INFINITY);
    return balance < 0 ? -1.0 : 1.0;
}

static int32_t is_fixed(const scan *s, int32_t i)
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

/* q of the shifted problem; 0 if it is not finite. */
static int32_t shift(perp__tridiagonal_lcp *work, const scan *s)
{
    const perp__tridiagonal *T = s->T;
    const perp__lcp_problem *p = s->problem;
    double before = 0.0, here = finite_bound_of(s, 0);
    int32_t i, finite = 1;

    for (i = 0; i < T->n; i++) {
        const double after = i + 1 < T->n ? finite_bound_of(s, i + 1) : 0.0;
        double q = p->q[i] + T->diagonal[i] * here;

        q += i > 0 ? T->below[i - 1] * before : 0.0;
        q += T->above[i] * after;
        work->q[i] = s->sign * q;
        finite &= isfinite(q);
        before = here;
        here = after;
    }
    return finite;
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

/* x_i, for a row at the right end of run `k` or beyond. */
static double end_value(const scan *s, int32_t k, int32_t i)
{
    return k >= 0 && s->runs[k].b == i ? s->runs[k].last[0] : 0.0;
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
        if (i > 0)
            w += s->T->below[i - 1] * end_value(s, s->top - 1, i - 1);
        if (!(w < 0.0))
            return;
        r[1] = *r; /* row i is right of it by one at least: there is room */
        *r = single(s, i);
        join(r, r + 1);
    }
}

static int32_t is_free(const scan *s, int32_t i)
{
    return i < s->T->n && !isfinite(bound_of(s, i));
}

/* The run of free variables from i on. */
static run free_run(const scan *s, int32_t i)
{
    run r = single(s, i);

    while (is_free(s, ++i)) {
        const run next = single(s, i);

        join(&r, &next);
    }
    return r;
}

/* Row i, bounded, comes next. Enters it if its w says so; `ahead` is the run of free variables that
 * follows, or NULL. Returns whether it entered. */
static int32_t look_at(scan *s, int32_t i, const run *ahead)
{
    const int32_t touches = s->top >= 0 && s->runs[s->top].b == i - 1;
    double w = s->q[i];

    if (touches)
        w += s->T->below[i - 1] * s->runs[s->top].last[0];
    if (!((ahead ? w + s->T->above[i] * ahead->first[0] : w) < 0.0))
        return 0;
    if (touches)
        append(s, i, w);
    else
        s->runs[++s->top] = single(s, i);
    if (ahead)
        join(&s->runs[s->top], ahead);
    settle(s);
    return 1;
}

/* Free variables are there before their neighbours are looked at: their x may be negative. */
static void enter_all(scan *s)
{
    int32_t i = 0;

    s->top = -1;
    while (i < s->T->n) {
        const int32_t is_inside = is_free(s, i);
        const int32_t has_ahead = is_inside || is_free(s, i + 1);
        run ahead;

        if (has_ahead)
            ahead = free_run(s, is_inside ? i : i + 1);
        if (!is_inside && !is_fixed(s, i) && look_at(s, i, has_ahead ? &ahead : NULL)) {
            i = s->runs[s->top].b + 1;
            continue;
        }
        if (has_ahead) {
            s->runs[++s->top] = ahead;
            settle(s);
            i = ahead.b;
        }
        i++;
    }
}

/* Writes the places and the list of rows in runs; returns how many these are. */
static int32_t write_places(const scan *s, int8_t *places, int32_t *active)
{
    int32_t count = 0, i, k;

    for (i = 0; i < s->T->n; i++)
        places[i] = is_fixed(s, i) ? PERP__FIXED : s->sign > 0.0 ? PERP__AT_LOWER : PERP__AT_UPPER;
    for (k = 0; k <= s->top; k++)
        for (i = s->runs[k].a; i <= s->runs[k].b; i++) {
            places[i] = PERP__BETWEEN;
            active[count++] = i;
        }
    return count;
}

static double row_times(const perp__tridiagonal *T, int32_t i, const double *z)
{
    double sum = T->diagonal[i] * z[i];

    if (i > 0)
        sum += T->below[i - 1] * z[i - 1];
    return i + 1 < T->n ? sum + T->above[i] * z[i + 1] : sum;
}

/* z_A = -S_AA^-1 (q_A + S_AN z_N) with the others at their bounds. */
static perp_status solve_equations(const scan *s, double *z, const int32_t *active, int32_t count,
                                   double *x)
{
    const perp__lcp_problem *p = s->problem;
    perp_status status = perp__sparse_block_factor(p->block, active, count, 0.0);

    if (status != PERP_OK)
        return status;
    for (int32_t i = 0; i < p->n; i++)
        z[i] = finite_bound_of(s, i);
    for (int32_t k = 0; k < count; k++)
        z[active[k]] = 0.0;
    for (int32_t k = 0; k < count; k++)
        x[active[k]] = -(p->q[active[k]] + row_times(&s->problem->block->T, active[k], z));
    perp__sparse_block_solve(p->block, x, 0);
    for (int32_t k = 0; k < count; k++)
        z[active[k]] = x[active[k]];
    return PERP_OK;
}

/* How many z and w do not have the signs that the places ask for, up to rounding in w. */
static int32_t count_wrong_signs(const scan *s, const int8_t *places, const double *z)
{
    const perp__lcp_problem *p = s->problem;
    double z_largest = 0.0;
    int32_t wrong = 0, i;

    for (i = 0; i < p->n; i++)
        z_largest = fabs(z[i]) > z_largest ? fabs(z[i]) : z_largest;
    for (i = 0; i < p->n; i++) {
        if (places[i] == PERP__BETWEEN) {
            wrong += !(z[i] >= p->lower[i] && z[i] <= p->upper[i]);
        } else if (places[i] != PERP__FIXED) {
            const double w = s->sign * (row_times(&p->block->T, i, z) + p->q[i]);
            const double size = p->row_norms[i] * z_largest + fabs(p->q[i]);

            wrong += !(w >= -16.0 * DBL_EPSILON * size);
        }
    }
    return wrong;
}

/* Finds the index set; 0 if this is not a problem for this method. */
static int32_t find_places(scan *s, perp__tridiagonal_lcp *work, const perp__lcp_problem *problem)
{
    if (!work->examined) {
        work->examined = 1;
        read_z_part(&work->Z, &problem->block->T);
        work->suits = is_m_matrix(&work->Z);
        work->sign = side_of_bounds(problem);
    }
    s->T = &work->Z;
    s->problem = problem;
    s->q = work->q;
    s->runs = work->runs;
    s->sign = work->sign;
    if (!work->suits || !shift(work, s))
        return 0;
    enter_all(s);
    return 1;
}

perp_status perp__tridiagonal_lcp_solve(perp__tridiagonal_lcp *work,
                                        const perp__lcp_problem *problem, int8_t *places, double *z,
                                        int32_t *found)
{
    perp_status status;
    scan s;
    int32_t count;

    *found = PERP__TRIDIAGONAL_NO;
    if (!find_places(&s, work, problem))
        return PERP_OK;
    count = write_places(&s, places, work->active);
    status = solve_equations(&s, z, work->active, count, work->x);
    if (status == PERP_OK) {
        const int32_t wrong = count_wrong_signs(&s, places, z);

        *found = wrong == 0             ? PERP__TRIDIAGONAL_SOLVED
                 : wrong <= s.T->n / 64 ? PERP__TRIDIAGONAL_NEAR
                                        : PERP__TRIDIAGONAL_FAR;
    }
    return status < 0 ? status : PERP_OK;
}
