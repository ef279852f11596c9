/* Rows with bounds of their own beside contacts: every method against all the answers that an
 * enumeration of modes finds, closed forms, laws recomputed, zeros, and what is refused. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "contact/law.h"
#include "two_sided.h"

/* More velocities than rows, so that W is regular. blocks: M falls into blocks of three. */
static void draw_problem(both_problem *p, int32_t contacts, int32_t dim, int32_t bounded,
                         int32_t bilateral, int blocks)
{
    memset(p, 0, sizeof *p);
    for (int k = 0; k < contacts; k++)
        both_add(p, 0, dim, 0.3 + 0.2 * both_draw());
    p->bounded = bounded;
    p->bilateral = bilateral;
    p->size = p->rows + bounded + bilateral;
    p->n = 12;
    for (int i = 0; i < bounded; i++) {
        const int kind = (int)floor(2.5 * (both_draw() + 1.0));
        const double low = both_draw(), most = both_draw() + 1.0;
        const double width = most < 0.3 ? 0.0 : most; /* then r is given, whatever u is */
        p->lower[i] = kind == 0 ? 0.0 : kind == 2 || kind == 4 ? -INFINITY : low;
        p->upper[i] = kind == 0 || kind == 1 || kind == 4 ? INFINITY : low + width;
    }
    both_fill_data(p, 0.5, blocks);
}

/* ---- enumeration --------------------------------------------------------------------------- */

/* Contacts: separate, stick, slip either way; rows: lower, between, upper. */
static int choices(const both_problem *p, int unit)
{
    return unit < p->contacts ? 4 : 3;
}

static void set_row(double *A, double *x, const both_problem *p, int row, int holds, double value)
{
    for (int j = 0; j < p->size; j++)
        A[row * MOST + j] = holds ? p->W[row * MOST + j] : row == j;
    x[row] = holds ? -p->q[row] : value;
}

/* The r of these modes; 0 where their signs are wrong. */
static int solve_modes(const both_problem *p, const int *mode, double *r)
{
    double A[MOST * MOST];
    const int first = 2 * p->contacts;
    for (int k = 0; k < p->contacts; k++) {
        set_row(A, r, p, 2 * k, mode[k] > 0, 0.0);
        set_row(A, r, p, 2 * k + 1, mode[k] == 1, 0.0);
        if (mode[k] > 1)
            A[(2 * k + 1) * MOST + 2 * k] = mode[k] == 2 ? -p->mu[k] : p->mu[k];
    }
    for (int i = 0; i < p->bounded; i++) {
        const int at = mode[p->contacts + i];
        const double value = at == 0 ? p->lower[i] : p->upper[i];
        if (at != 1 && isinf(value))
            return 0;
        set_row(A, r, p, first + i, at == 1, value);
    }
    for (int i = first + p->bounded; i < p->size; i++)
        set_row(A, r, p, i, 1, 0.0);
    if (!both_eliminate(p->size, A, r))
        return 0;
    for (int i = 0, unit; i < first + p->bounded; i++) {
        double u = p->q[i];
        for (int j = 0; j < p->size; j++)
            u += p->W[i * MOST + j] * r[j];
        unit = i < first ? i / 2 : p->contacts + i - first;
        if (i >= first) {
            const double *l = &p->lower[i - first], *h = &p->upper[i - first];
            if ((mode[unit] == 0 && u < 0.0) || (mode[unit] == 2 && u > 0.0) ||
                (mode[unit] == 1 && (r[i] < *l || r[i] > *h)))
                return 0;
        } else if (i % 2 == 0) {
            if (mode[unit] == 0 ? u < 0.0 : r[i] < 0.0)
                return 0;
        } else if ((mode[unit] == 1 && fabs(r[i]) > p->mu[unit] * r[i - 1]) ||
                   (mode[unit] == 2 && u > 0.0) || (mode[unit] == 3 && u < 0.0)) {
            return 0;
        }
    }
    return 1;
}

/* How many answers there are; the last one found. */
static int enumerate(const both_problem *p, double *found)
{
    int mode[MOST] = {0}, count = 0;
    const int units = p->contacts + p->bounded;
    for (;;) {
        double r[MOST];
        int k = 0;
        if (solve_modes(p, mode, r)) {
            memcpy(found, r, sizeof r);
            count++;
        }
        while (k < units && ++mode[k] == choices(p, k))
            mode[k++] = 0;
        if (k == units)
            return count;
    }
}

/* ---- solving ------------------------------------------------------------------------------- */

/* W of these draws has condition numbers of some hundreds: with tol 1e-10 impulses of size 1 are
 * right to 1e-7. What stands at a bound stands there exactly, what holds does not move at all. */
static void compare(const both_problem *p, const both_answer *a, const double *r, uint64_t which)
{
    const int32_t first = p->rows;
    for (int i = 0; i < p->size; i++)
        if (!(fabs(a->r[i] - r[i]) <= 1e-7 * (1.0 + fabs(r[i]))))
            fail_msg("draw %llu: r[%d] is %.17g, expected %.17g", (unsigned long long)which, i,
                     a->r[i], r[i]);
    for (int i = 0; i < p->bounded; i++) {
        const int32_t mode = a->modes[p->contacts + i];
        const double x = a->r[first + i], u = a->u[first + i];
        if (p->lower[i] == p->upper[i])
            assert_true(x == p->lower[i]);
        else if (mode == PERP_CONTACT_LOWER)
            assert_true(x == p->lower[i] && u >= -1e-9);
        else if (mode == PERP_CONTACT_UPPER)
            assert_true(x == p->upper[i] && u <= 1e-9);
        else
            assert_true(mode == PERP_CONTACT_STICK && u == 0.0 && x >= p->lower[i] &&
                        x <= p->upper[i]);
    }
    for (int i = first + p->bounded; i < p->size; i++)
        assert_true(a->u[i] == 0.0);
}

static const int32_t methods[] = {PERP_CONTACT_METHOD_AUTO,   PERP_CONTACT_METHOD_SWEEP,
                                  PERP_CONTACT_METHOD_NEWTON, PERP_CONTACT_METHOD_LEMKE,
                                  PERP_CONTACT_METHOD_ADMM,   PERP_CONTACT_METHOD_PROXIMAL};

/* Two planar contacts, three rows of any kind, an equation: every method finds the one answer, from
 * W, from M, from blocks of M, and from a callback. */
static void test_enumerated(void **state)
{
    int single = 0;
    (void)state;
    for (uint64_t k = 1; k <= 60; k++) {
        both_problem p;
        double r[MOST];
        both_seed = 1000 * k;
        draw_problem(&p, 2, 2, 3, 1, k % 2 == 0);
        if (enumerate(&p, r) != 1)
            continue;
        single++;
        for (int m = 0; m < 6; m++) {
            both_answer a;
            both_by_dynamics(&p, methods[m], 0, NULL, &a);
            both_require_solved(&a, k);
            compare(&p, &a, r, k);
            both_by_delassus(&p, methods[m], NULL, &a);
            both_require_solved(&a, k);
            compare(&p, &a, r, k);
            both_by_dynamics(&p, methods[m], 1, NULL, &a);
            both_require_solved(&a, k);
            compare(&p, &a, r, k);
        }
    }
    assert_true(single >= 50); /* small coefficients: nearly all have one answer */
}

/* Cones in space beside them: the laws, recomputed. */
static void test_laws(void **state)
{
    (void)state;
    for (uint64_t k = 1; k <= 60; k++) {
        both_problem p;
        both_answer a;
        both_seed = 77 * k;
        draw_problem(&p, 2, 3, 4, k % 3 == 0, 0);
        both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
        both_require_solved(&a, k);
        for (int c = 0; c < 2; c++) {
            const double *r = a.r + 3 * c, *u = a.u + 3 * c;
            const double power = r[1] * u[1] + r[2] * u[2], slip = hypot(u[1], u[2]);
            assert_true(r[0] >= 0.0 && u[0] >= -1e-9 && fabs(r[0] * u[0]) <= 1e-8);
            assert_true(hypot(r[1], r[2]) <= p.mu[c] * r[0] * (1.0 + 1e-15));
            assert_true(fabs(power + p.mu[c] * r[0] * slip) <= 1e-8);
        }
        for (int i = 0; i < p.bounded; i++) {
            const double x = a.r[6 + i], u = a.u[6 + i];
            assert_true(x >= p.lower[i] && x <= p.upper[i]);
            assert_true(u <= 1e-9 || x == p.lower[i]);
            assert_true(u >= -1e-9 || x == p.upper[i]);
        }
    }
}

/* A wheel of inertia 2 with a motor that asks for speed 3, of at most 1.5: u = omega - 3. */
static void motor(double f, double most, both_answer *a)
{
    both_problem p;
    memset(&p, 0, sizeof p);
    p.bounded = p.size = p.n = 1;
    p.M[0] = 2.0;
    p.H[0] = 1.0;
    p.f[0] = f;
    p.w[0] = -3.0;
    p.lower[0] = -most;
    p.upper[0] = most;
    both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, a);
    both_require_solved(a, 0);
}

static void test_motor(void **state)
{
    both_answer a;
    (void)state;
    motor(5.0, 1.5, &a); /* 2 omega = 5 + 1; r comes of a few sums */
    assert_true(fabs(a.r[0] - 1.0) <= 1e-15 && a.u[0] == 0.0 && fabs(a.v[0] - 3.0) <= 1e-15);
    assert_int_equal(a.modes[0], PERP_CONTACT_STICK);
    motor(2.0, 1.5, &a); /* 2 omega = 2 + 1.5 */
    assert_true(a.r[0] == 1.5 && a.v[0] == 1.75 && a.u[0] == -1.25);
    assert_int_equal(a.modes[0], PERP_CONTACT_UPPER);
    motor(8.0, 1.5, &a);
    assert_true(a.r[0] == -1.5 && a.v[0] == 3.25);
    assert_int_equal(a.modes[0], PERP_CONTACT_LOWER);
    motor(2.0, 0.0, &a); /* switched off */
    assert_true(a.r[0] == 0.0 && a.v[0] == 1.0);
    motor(5.0, 1e12, &a); /* its strength is no measure of what it does */
    assert_true(fabs(a.r[0] - 1.0) <= 1e-10 && a.u[0] == 0.0);
}

/* Bounds that are far off are no measure of what impulses do, nor of what they lack: with
 * W = [1 .1 0 0; .1 2 .5 .1; 0 .5 1 .2; 0 .1 .2 1.5] and q = (-1, -1, -2, .3), r = (1, 0, 2, 0) by
 * hand, whichever sides of 0 the bounds lie on; and one that does hold, holds. */
static void test_far_bounds(void **state)
{
    static const double W[] = {1, 0.1, 0, 0, 0.1, 2, 0.5, 0.1, 0, 0.5, 1, 0.2, 0, 0.1, 0.2, 1.5};
    static const double q[] = {-1.0, -1.0, -2.0, 0.3}, mirrored[] = {-1.0, 1.0, 2.0, -0.3};
    static const double far[] = {1e3, 1e6, 1e9, 1e12};

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (int k = 0; k < 12; k++) {
            const double most = far[k % 4];
            const int below = k / 4 == 1, holds = k / 4 == 2;
            both_problem p;
            both_answer a;

            memset(&p, 0, sizeof p);
            both_add(&p, 0, 1, 0.0);
            p.bounded = 3;
            p.size = p.n = 4;
            for (int i = 0; i < 16; i++) /* the first row's couplings turn with the others */
                p.W[i / 4 * MOST + i % 4] =
                    W[i] * (below && (i / 4 == 0) != (i % 4 == 0) ? -1.0 : 1.0);
            memcpy(p.q, below ? mirrored : q, sizeof q);
            for (int i = 0; i < 3; i++) {
                p.lower[i] = below ? -most : 0.0;
                p.upper[i] = below ? 0.0 : i == 1 && k % 2 ? INFINITY : most;
            }
            if (holds) /* r_2 = most pushes all others open but the first */
                p.q[2] = -2.0 * most;
            both_by_delassus(&p, methods[m], NULL, &a);
            both_require_solved(&a, 0);
            if (holds) /* beside so much the others are known to little */
                assert_true(fabs(a.r[2] / (k % 2 ? 2.0 * most : most) - 1.0) <= 1e-8);
            else /* 1e-6: tol times what REACH and the part's largest velocity may add to each */
                assert_true(fabs(a.r[0] - 1.0) <= 1e-6 && fabs(a.r[1]) <= 1e-6 &&
                            fabs(fabs(a.r[2]) - 2.0) <= 1e-6 && fabs(a.r[3]) <= 1e-6);
        }
}

/* What nothing drives stays: impulses are the bounds' nearest to 0, to the last bit, and rows that
 * are between theirs stick. */
static void test_rest(void **state)
{
    static const double bounds[][2] = {{-1, 1},        {-0.5e9, 1e9},  {-1e9, INFINITY},
                                       {-INFINITY, 1}, {-1e-9, 2e-9},  {0.0, 1e12},
                                       {-1e12, 0.0},   {-0.5e-3, 1e3}, {-INFINITY, INFINITY}};
    both_problem p;
    both_answer a;

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (int k = 0; k < 9; k++) {
            memset(&p, 0, sizeof p);
            both_add(&p, 0, 3, 0.5);
            p.bounded = 2;
            p.size = p.n = 5;
            for (int i = 0; i < 5; i++)
                for (int j = 0; j < 5; j++)
                    p.W[i * MOST + j] = i == j ? 2.0 : 0.5;
            p.lower[0] = bounds[k][0];
            p.upper[0] = bounds[k][1];
            p.lower[1] = -3.0;
            p.upper[1] = INFINITY;
            both_by_delassus(&p, methods[m], NULL, &a);
            both_require_solved(&a, 0);
            for (int i = 0; i < 5; i++)
                assert_true(a.r[i] == 0.0 && a.u[i] == 0.0);
            if (bounds[k][0] < 0.0 && bounds[k][1] > 0.0)
                assert_int_equal(a.modes[1], PERP_CONTACT_STICK);
        }
}

/* One bound alone, so far off that it never holds: the row is an equation, and all of W r = -q. */
static void test_far_bounds_of_one_side(void **state)
{
    static const double W[] = {1, 0.1, 0, 0, 0.1, 2, 0.5, 0.1, 0, 0.5, 1, 0.2, 0, 0.1, 0.2, 1.5};
    static const double q[] = {-1.0, -1.0, -2.0, 0.3};
    static const double far[] = {1e3, 1e6, 1e9, 1e12};

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (int k = 0; k < 32; k++) {
            both_problem p;
            both_answer a;

            memset(&p, 0, sizeof p);
            both_add(&p, 0, 1, 0.0);
            p.bounded = 3;
            p.size = p.n = 4;
            memcpy(p.q, q, sizeof q);
            for (int i = 0; i < 16; i++)
                p.W[i / 4 * MOST + i % 4] = W[i];
            for (int i = 0; i < 3; i++) { /* each of the eight choices of sides */
                p.lower[i] = k >> i & 1 ? -far[k / 8] : -INFINITY;
                p.upper[i] = k >> i & 1 ? INFINITY : far[k / 8];
            }
            both_by_delassus(&p, methods[m], NULL, &a);
            both_require_solved(&a, 0);
            for (int i = 0; i < 4; i++) { /* tol 1e-9 of W and of what r may reach: 1e-7 of 1 */
                double u = q[i];

                for (int j = 0; j < 4; j++)
                    u += W[4 * i + j] * a.r[j];
                assert_true(fabs(u) <= 1e-7);
            }
        }
}

/* A limit that holds a joint: v is exactly 0, and a row beside it that lets go. */
static void test_limit(void **state)
{
    both_problem p;
    both_answer a;
    (void)state;
    memset(&p, 0, sizeof p);
    p.bounded = p.size = p.n = 2;
    p.M[0] = p.M[MOST + 1] = 0.7;
    p.H[0] = p.H[MOST + 1] = 1.0;
    p.f[0] = -0.1;
    p.f[1] = 0.1;
    p.upper[0] = p.upper[1] = INFINITY;
    both_by_dynamics(&p, PERP_CONTACT_METHOD_AUTO, 0, NULL, &a);
    both_require_solved(&a, 0);
    assert_true(a.v[0] == 0.0 && fabs(a.r[0] - 0.1) <= 1e-16 && a.r[1] == 0.0);
    assert_int_equal(a.modes[0], PERP_CONTACT_STICK);
    assert_int_equal(a.modes[1], PERP_CONTACT_LOWER);
}

/* Two limits that contradict each other: the ray proves it, in the caller's rows, however far off
 * their bounds are. */
static void test_infeasible(void **state)
{
    static const double far[] = {0.0, 1e3, 1e6, 1e12};

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++)
        for (int k = 0; k < 4; k++) {
            both_problem p;
            both_answer a;

            memset(&p, 0, sizeof p);
            p.bounded = p.size = 2;
            p.n = 1;
            p.M[0] = 1.0;
            p.H[0] = p.H[MOST] = 1.0;
            p.w[0] = -1.0; /* v >= 1 */
            p.w[1] = 1.0;  /* v <= -1 */
            p.lower[0] = -far[k];
            p.upper[0] = INFINITY;
            p.lower[1] = -INFINITY;
            p.upper[1] = far[k];
            both_by_dynamics(&p, methods[m], 0, NULL, &a);
            assert_int_equal(a.result.outcome, PERP_OUTCOME_RAY);
            assert_int_equal(a.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
            assert_true(a.ray[0] == 1.0 && a.ray[1] == -1.0);
        }
}

/* Two bilateral rows after three with such bounds. */
static void begin(both_problem *p, const double *lower, const double *upper)
{
    memset(p, 0, sizeof *p);
    p->bounded = 3;
    p->bilateral = 2;
    p->size = 5;
    memcpy(p->lower, lower, 3 * sizeof *lower);
    memcpy(p->upper, upper, 3 * sizeof *upper);
}

/* Two bilateral rows that contradict each other, beside a row that slides at a bound far off: every
 * multiple of (3, -1) proves it, and no bound that is moved makes the problem solvable. */
static void test_infeasible_beside_far_bounds(void **state)
{
    static const double row[] = {1.0, 1.0, 2.0, 1.0, 3.0}, w[] = {0.0, 1.0, 2.0, 1.0, 0.0};
    static const double lower[] = {-5e-4, -INFINITY, -1e12}, upper[] = {1e-3, 0.0, INFINITY};

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        both_problem p;
        both_answer a;

        begin(&p, lower, upper);
        p.n = 1;
        p.M[0] = 2.0;
        p.f[0] = 1.0;
        for (int i = 0; i < 5; i++) {
            p.H[i * MOST] = row[i];
            p.w[i] = w[i];
        }
        both_by_dynamics(&p, methods[m], 0, NULL, &a);
        assert_int_equal(a.result.outcome, PERP_OUTCOME_RAY);
        assert_int_equal(a.result.certificate, PERP_CONTACT_CERTIFICATE_INFEASIBLE);
    }
}

/* Two velocities, and one to three more rows than they can meet: no v makes u = 0 in all, so that
 * some impulse would have to be as far as its bound. Impulses within them that cancel each other
 * excuse no u: sqrt(tol) of the largest |q| is asked of every row between its bounds. */
static void test_too_many_rows_of_far_bounds(void **state)
{
    (void)state;
    both_seed = 4;
    for (int k = 0; k < 60; k++)
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
            both_problem p;
            both_answer a;
            double most = 0.0;

            memset(&p, 0, sizeof p);
            both_add(&p, 0, 2, 0.5);
            p.n = 2;
            p.bounded = 1 + k % 3;
            p.size = p.rows + p.bounded;
            for (int i = 0; i < p.bounded; i++) {
                p.lower[i] = k % 2 > 0 ? -1e300 : -1e12;
                p.upper[i] = k % 4 > 1 ? 1e300 : 1.0;
            }
            both_fill_data(&p, 0.5, 0);
            both_by_dynamics(&p, methods[m], 0, NULL, &a);
            if (a.result.outcome != PERP_OUTCOME_SOLVED)
                continue;
            for (int i = 0; i < p.size; i++)
                most = fmax(most, fabs(p.q[i]));
            for (int i = 0; i < p.bounded; i++) {
                double u = p.w[p.rows + i];

                for (int j = 0; j < p.n; j++)
                    u += p.H[(p.rows + i) * MOST + j] * a.v[j];
                if (a.modes[1 + i] == PERP_CONTACT_STICK && !(fabs(u) <= 3e-5 * most))
                    fail_msg("%d, method %d: u of row %d is %g, beside %g", k, (int)methods[m], i,
                             u, most);
            }
        }
}

/* W of rank 4: the impulses of two bilateral rows and of the second one with bounds go far along
 * its null direction. Its bounds have to be moved off for that, and what W makes of those was then
 * the measure by which a start that solves nothing was called solved. */
static void test_starts_beside_far_bounds(void **state)
{
    static const double W[] = {19, -17, -8,  -10, -7, -17, 25, 18, 14, 11, -8, 18, 18,
                               10, 8,   -10, 14,  10, 8,   6,  -7, 11, 8,  6,  5};
    static const double lower[] = {-INFINITY, -5e11, -5e-10}, upper[] = {1e12, 1e12, 1e-9};
    static const double start[] = {1.0, 1.0, 1.0, 1.0, 1.0};

    (void)state;
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        both_problem p;
        both_answer a;

        begin(&p, lower, upper);
        p.n = 5;
        for (int i = 0; i < 25; i++)
            p.W[i / 5 * MOST + i % 5] = W[i];
        for (int i = 0; i < 5; i++)
            p.q[i] = 1.0;
        both_by_delassus(&p, methods[m], start, &a);
        for (int i = 0; a.result.outcome == PERP_OUTCOME_SOLVED && i < 5; i++) {
            double u = 1.0, terms = 1.0;

            for (int j = 0; j < 5; j++) {
                u += W[5 * i + j] * a.r[j];
                terms += fabs(W[5 * i + j] * a.r[j]);
            }
            /* 1e-6: the terms of rows coupled to this one are up to 10 times its own, and tol is of
             * all of them together; rounding of u's sum is far below */
            assert_true(i < 3 && a.r[i] == upper[i]   ? u <= 1e-6 * terms
                        : i < 3 && a.r[i] == lower[i] ? u >= -1e-6 * terms
                                                      : fabs(u) <= 1e-6 * terms);
        }
    }
}

static void refuse(double lower, double upper, double h, perp_status expected, int32_t method,
                   const char *text)
{
    const double one = 1.0, f = -1.0;
    perp_contact_laws laws = fresh_contact_laws();
    perp_contact_dynamics dynamics = fresh_contact_dynamics();
    perp_contact_settings settings = fresh_contact_settings();
    perp_contact_result result = fresh_contact_result();
    perp_matrix M, H;
    double r = 7.0;
    settings.method = method;
    M = matrix_rows(&one, 1, 1);
    H = matrix_rows(&h, 1, 1);
    laws.bounded = 1;
    laws.lower = &lower;
    laws.upper = &upper;
    dynamics.n = 1;
    dynamics.M = &M;
    dynamics.H = &H;
    assert_int_equal(perp_contact_solve(both_context, ANSWER(NULL, &r), &result, &settings,
                                        DYNAMICS(&laws, &dynamics, &f, &f), NULL),
                     expected);
    if (!strstr(perp_context_message(both_context), text))
        fail_msg("'%s' without '%s'", perp_context_message(both_context), text);
    assert_true(r == 7.0);
}

static void test_refusals(void **state)
{
    (void)state;
    refuse(2.0, 1.0, 1.0, PERP_ERROR_ARGUMENT, PERP_CONTACT_METHOD_AUTO,
           "lower[0] = 2 > upper[0] = 1");
    refuse(NAN, 1.0, 1.0, PERP_ERROR_NOT_FINITE, PERP_CONTACT_METHOD_AUTO, "lower[0]");
    refuse(-1.0, 1.0, 0.0, PERP_ERROR_ARGUMENT, PERP_CONTACT_METHOD_AUTO,
           "row with bounds 0: its impulse moves nothing");
    refuse(0.0, INFINITY, 0.0, PERP_ERROR_ARGUMENT, PERP_CONTACT_METHOD_AUTO,
           "row with bounds 0: its impulse moves nothing");
}

/* The normal that is a bound is just that, whatever a method made of it. */
static void test_clip(void **state)
{
    const int32_t starts[] = {0, 2}, dims[] = {2};
    const double mu[] = {1.0}, bound[] = {2.0}, trace[] = {1.0};
    double r[] = {1.0, 5.0};
    perp__contact_problem p;
    (void)state;
    memset(&p, 0, sizeof p);
    p.contacts = 1;
    p.rows = p.size = 2;
    p.starts = starts;
    p.dims = dims;
    p.mu = mu;
    p.bound = bound;
    p.trace = trace;
    perp__contact_clip(&p, 0, r);
    assert_true(r[0] == 2.0 && r[1] == 2.0);
    r[0] = 7.0;
    r[1] = -1.0;
    perp__contact_clip(&p, 0, r);
    assert_true(r[0] == 2.0 && r[1] == -1.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_enumerated),
        cmocka_unit_test(test_laws),
        cmocka_unit_test(test_motor),
        cmocka_unit_test(test_limit),
        cmocka_unit_test(test_far_bounds),
        cmocka_unit_test(test_rest),
        cmocka_unit_test(test_far_bounds_of_one_side),
        cmocka_unit_test(test_infeasible),
        cmocka_unit_test(test_infeasible_beside_far_bounds),
        cmocka_unit_test(test_too_many_rows_of_far_bounds),
        cmocka_unit_test(test_starts_beside_far_bounds),
        cmocka_unit_test(test_clip),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, both_make, both_destroy);
}
