/* Verdicts against an independent look at the rows: programs whose Jacobians have noise where zeros
 * should be, systems that fall into parts in any units, numbers at the edge of the doubles. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "problems.h"

#include "context.h"

enum { MOST = 16 };

/* F, and the sum of the magnitudes of each row's terms. */
typedef void (*equations)(double *F, double *terms, const double *z);

static void add(double *F, double *terms, int32_t i, double term)
{
    F[i] += term;
    terms[i] += fabs(term);
}

/* Hock & Schittkowski 80: min exp(x1 x2 x3 x4 x5), |x|^2 = 10, x2 x3 = 5 x4 x5, x1^3 + x2^3 = -1.
 * x in a box, multipliers free. */
static void hs80(double *F, double *terms, const double *z)
{
    const double *x = z, *y = z + 5, e = exp(x[0] * x[1] * x[2] * x[3] * x[4]);

    for (int32_t i = 0; i < 8; i++)
        F[i] = terms[i] = 0;
    for (int32_t i = 0; i < 5; i++) {
        double others = 1;

        for (int32_t j = 0; j < 5; j++)
            others *= i == j ? 1 : x[j];
        add(F, terms, i, e * others);
        add(F, terms, i, -y[0] * 2 * x[i]);
        add(F, terms, 5, x[i] * x[i]);
    }
    add(F, terms, 5, -10);
    add(F, terms, 1, -y[1] * x[2]);
    add(F, terms, 2, -y[1] * x[1]);
    add(F, terms, 3, y[1] * 5 * x[4]);
    add(F, terms, 4, y[1] * 5 * x[3]);
    add(F, terms, 6, x[1] * x[2]);
    add(F, terms, 6, -5 * x[3] * x[4]);
    for (int32_t i = 0; i < 2; i++) {
        add(F, terms, i, -y[2] * 3 * x[i] * x[i]);
        add(F, terms, 7, x[i] * x[i] * x[i]);
    }
    add(F, terms, 7, 1);
}

/* Hock & Schittkowski 93, the transformer: monomials c prod x_i^k_i of the objective and of two
 * constraints >= 0; x >= 0, multipliers >= 0. */
typedef struct monomial {
    int32_t function; /* 0: the objective */
    double c;
    int32_t powers[6];
} monomial;

static const monomial transformer[] = {
    {0, 0.0204, {2, 0, 0, 1, 0, 0}},
    {0, 0.0204, {1, 1, 0, 1, 0, 0}},
    {0, 0.0204, {1, 0, 1, 1, 0, 0}},
    {0, 0.0187, {1, 1, 1, 0, 0, 0}},
    {0, 0.0187 * 1.57, {0, 2, 1, 0, 0, 0}},
    {0, 0.0187, {0, 1, 1, 1, 0, 0}},
    {0, 0.0607, {2, 0, 0, 1, 2, 0}},
    {0, 0.0607, {1, 1, 0, 1, 2, 0}},
    {0, 0.0607, {1, 0, 1, 1, 2, 0}},
    {0, 0.0437, {1, 1, 1, 0, 0, 2}},
    {0, 0.0437 * 1.57, {0, 2, 1, 0, 0, 2}},
    {0, 0.0437, {0, 1, 1, 1, 0, 2}},
    {1, 0.001, {1, 1, 1, 1, 1, 1}},
    {1, -2.07, {0, 0, 0, 0, 0, 0}},
    {2, 1, {0, 0, 0, 0, 0, 0}},
    {2, -0.00062, {2, 0, 0, 1, 2, 0}},
    {2, -0.00062, {1, 1, 0, 1, 2, 0}},
    {2, -0.00062, {1, 0, 1, 1, 2, 0}},
    {2, -0.00058, {1, 1, 1, 0, 0, 2}},
    {2, -0.00058 * 1.57, {0, 2, 1, 0, 0, 2}},
    {2, -0.00058, {0, 1, 1, 1, 0, 2}},
};

static double power(double x, int32_t k)
{
    return k <= 0 ? 1 : k == 1 ? x : x * x;
}

static void hs93(double *F, double *terms, const double *z)
{
    for (int32_t i = 0; i < 8; i++)
        F[i] = terms[i] = 0;
    for (size_t k = 0; k < sizeof transformer / sizeof *transformer; k++) {
        const monomial *t = &transformer[k];
        const double y = t->function ? -z[5 + t->function] : 1;
        double value = t->c;

        for (int32_t i = 0; i < 6; i++)
            value *= power(z[i], t->powers[i]);
        if (t->function)
            add(F, terms, 5 + t->function, value);
        for (int32_t i = 0; i < 6; i++) {
            double slope = y * t->c * t->powers[i];

            for (int32_t j = 0; j < 6; j++)
                slope *= power(z[j], t->powers[j] - (i == j));
            if (t->powers[i] > 0)
                add(F, terms, i, slope);
        }
    }
}

/* Columns of 8. */
typedef void (*slopes)(double *J, const double *z);

static void couple(double *J, int32_t i, int32_t k, double slope)
{
    J[i + 8 * (5 + k)] -= slope;
    J[5 + k + 8 * i] += slope;
}

static void hs80_slopes(double *J, const double *z)
{
    const double *x = z, *y = z + 5, e = exp(x[0] * x[1] * x[2] * x[3] * x[4]);

    memset(J, 0, 64 * sizeof *J);
    for (int32_t i = 0; i < 5; i++)
        for (int32_t j = 0; j < 5; j++) {
            double but_i = 1, but_j = 1, but_both = i == j ? 0 : 1;

            for (int32_t k = 0; k < 5; k++) {
                but_i *= k == i ? 1 : x[k];
                but_j *= k == j ? 1 : x[k];
                but_both *= k == i || k == j ? 1 : x[k];
            }
            J[i + 8 * j] = e * (but_i * but_j + but_both);
        }
    for (int32_t i = 0; i < 5; i++) {
        J[9 * i] -= 2 * y[0];
        couple(J, i, 0, 2 * x[i]);
    }
    J[1 + 8 * 2] -= y[1];
    J[2 + 8 * 1] -= y[1];
    J[3 + 8 * 4] += 5 * y[1];
    J[4 + 8 * 3] += 5 * y[1];
    couple(J, 1, 1, x[2]);
    couple(J, 2, 1, x[1]);
    couple(J, 3, 1, -5 * x[4]);
    couple(J, 4, 1, -5 * x[3]);
    for (int32_t i = 0; i < 2; i++) {
        J[9 * i] -= 6 * x[i] * y[2];
        couple(J, i, 2, 3 * x[i] * x[i]);
    }
}

static double derivative(const monomial *t, const double *x, int32_t a, int32_t b)
{
    double value = t->c;

    for (int32_t i = 0; i < 6; i++) {
        int32_t k = t->powers[i];

        if (i == a)
            value *= k--;
        if (i == b)
            value *= k--;
        value *= value != 0 ? power(x[i], k) : 1;
    }
    return value;
}

static void hs93_slopes(double *J, const double *z)
{
    memset(J, 0, 64 * sizeof *J);
    for (size_t k = 0; k < sizeof transformer / sizeof *transformer; k++) {
        const monomial *t = &transformer[k];
        const double y = t->function ? -z[5 + t->function] : 1;

        for (int32_t i = 0; i < 6; i++) {
            if (t->function)
                couple(J, i, t->function, derivative(t, z, i, -1));
            for (int32_t j = 0; j < 6; j++)
                J[i + 8 * j] += y * derivative(t, z, i, j);
        }
    }
}

typedef struct program {
    equations rows;
    slopes slopes;
    double lower[8], upper[8];
    int32_t variables;
} program;

static const program programs[] = {
    {hs80,
     hs80_slopes,
     {-2.3, -2.3, -3.2, -3.2, -3.2, -INFINITY, -INFINITY, -INFINITY},
     {2.3, 2.3, 3.2, 3.2, 3.2, INFINITY, INFINITY, INFINITY},
     5},
    {hs93,
     hs93_slopes,
     {0},
     {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY, INFINITY},
     6},
};

static int32_t program_function(double *F, const double *z, void *user)
{
    double terms[MOST];

    ((const program *)user)->rows(F, terms, z);
    return 0;
}

static int32_t program_jacobian(double *J, const double *z, void *user)
{
    ((const program *)user)->slopes(J, z);
    return 0;
}

static perp_ncp_problem problem_of(const program *p)
{
    perp_ncp_problem problem = fresh_ncp_problem();

    problem.n = 8;
    problem.function = program_function;
    problem.jacobian = program_jacobian;
    problem.lower = p->lower;
    problem.upper = p->upper;
    problem.user = (void *)(uintptr_t)p;
    return problem;
}

static int32_t is_good(const perp_ncp_result *result)
{
    return result->outcome == PERP_OUTCOME_SOLVED || result->outcome == PERP_OUTCOME_ROUNDING_LIMIT;
}

/* What a row is wrong by, beside its own terms; those of a program of numbers between 1 and 100
 * that are below 1e-2 are small. */
static double worst_row(const program *p, const double *z)
{
    double F[8], terms[8], worst = 0;

    p->rows(F, terms, z);
    for (int32_t i = 0; i < 8; i++) {
        double wrong = fabs(F[i]);

        if (z[i] == p->lower[i])
            wrong = fmax(-F[i], 0);
        else if (z[i] == p->upper[i])
            wrong = fmax(F[i], 0);
        worst = fmax(worst, fmin(wrong / (terms[i] + 1e-2), wrong <= 0 ? 0 : INFINITY));
    }
    return worst;
}

/* Values for which no bound is near: differences tell of a mistake in the problems themselves. */
static void test_jacobians(void **state)
{
    const double z[] = {0.9, 1.1, 0.7, 0.6, 1.3, 0.5, 1.2, 0.4};

    (void)state;
    for (int p = 0; p < 2; p++) {
        perp_ncp_problem problem = problem_of(&programs[p]);
        perp_ncp_check check = fresh_ncp_check();

        assert_int_equal(perp_ncp_check_jacobian(context, &check, &problem, z), PERP_OK);
        assert_int_equal(check.wrong, 0);
    }
}

/* From 300 starts at random: what is called good is right in every row. A tested residual of 1e-10
 * beside the largest terms, 1e3 times those of other rows, leaves 1e-7 of theirs. */
static void count_false(int p, int32_t method, int starts, int *good)
{
    const program *q = &programs[p];
    const perp_ncp_problem problem = problem_of(q);
    perp_ncp_settings settings = fresh_ncp_settings();
    uint64_t random = 12345;

    settings.method = method;
    *good = 0;
    for (int s = 0; s < starts; s++) {
        perp_ncp_result result = fresh_ncp_result();
        double z0[8], z[8];

        for (int i = 0; i < 8; i++) {
            const double u = zoo_random(&random), width = q->upper[i] - q->lower[i];

            z0[i] = i >= q->variables ? 4 * u - (p == 0 ? 2 : 0)
                    : p == 0          ? q->lower[i] + u * width
                                      : 15 * u;
        }
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        if (!is_good(&result))
            continue;
        ++*good;
        if (!(worst_row(q, z) <= 1e-6))
            fail_msg("program %d, start %d: %s, a row is wrong by %g", p, s,
                     perp_outcome_text(result.outcome), worst_row(q, z));
    }
}

static void test_no_start_is_called_solved(void **state)
{
    int good;

    (void)state;
    for (int32_t method = PERP_NCP_AUTO; method <= PERP_NCP_JOSEPHY; method++) {
        count_false(0, method, 300, &good);
        assert_true(good >= 100); /* or this test would test nothing */
    }
    count_false(1, PERP_NCP_AUTO, 20, &good); /* restarts alone solve it, now and then */
    assert_true(good >= 3);
}

/* ---- numbers at the edge --------------------------------------------------------------------- */

/* F = c (M z + q), M and q from a palette; c = 0 is never drawn. */
typedef struct edge {
    int32_t n, with_jacobian;
    double M[25], q[5], lower[5], upper[5], start[5];
} edge;

static int32_t edge_function(double *F, const double *z, void *user)
{
    const edge *e = user;

    for (int32_t i = 0; i < e->n; i++) {
        assert_true(isfinite(z[i]) && z[i] >= e->lower[i] && z[i] <= e->upper[i]);
        F[i] = e->q[i];
        for (int32_t j = 0; j < e->n; j++)
            if (e->M[i + e->n * j] != 0)
                F[i] += e->M[i + e->n * j] * z[j];
    }
    return 0;
}

static int32_t edge_jacobian(double *J, const double *z, void *user)
{
    const edge *e = user;

    (void)z;
    memcpy(J, e->M, (size_t)(e->n * e->n) * sizeof *J);
    return 0;
}

static double from_palette(uint64_t *random)
{
    static const double palette[] = {0,        1,     -1,     2,      -3,    1e300,  -1e300,
                                     1e-300,   1e150, -1e150, 1e-150, 1e308, 1e-308, 4.9e-324,
                                     0x1p1023, 1e12,  -1e-12, 0,      0.5,   1e307};

    return palette[(size_t)(zoo_random(random) * (sizeof palette / sizeof *palette))];
}

static void draw(edge *e, uint64_t *random)
{
    e->n = 1 + (int32_t)(5 * zoo_random(random));
    for (int32_t i = 0; i < e->n * e->n; i++)
        e->M[i] = from_palette(random);
    for (int32_t i = 0; i < e->n; i++) {
        const double a = from_palette(random), b = from_palette(random), u = zoo_random(random);

        e->q[i] = from_palette(random);
        e->lower[i] = u < 0.3 ? -INFINITY : u < 0.7 ? 0 : fmin(a, b);
        e->upper[i] = u < 0.7 ? INFINITY : fmax(a, b);
        e->start[i] = zoo_random(random) < 0.5 ? 0 : from_palette(random);
    }
}

/* Finite data are never refused, whatever overflows on the way, and what is called good is: finite,
 * with F's sign right in each row, to a part of its terms that rounding and tol explain. */
static void test_edges(void **state)
{
    uint64_t random = 31;
    int good = 0;

    (void)state;
    for (int repeat = 0; repeat < 1500; repeat++) {
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_problem problem = problem_of(&programs[0]);
        perp_ncp_result result = fresh_ncp_result();
        double z[5], w[5];
        edge e;

        memset(&e, 0, sizeof e);
        draw(&e, &random);
        problem.n = e.n;
        problem.function = edge_function;
        problem.jacobian = repeat % 4 == 3 ? NULL : edge_jacobian;
        problem.lower = e.lower;
        problem.upper = e.upper;
        problem.user = &e;
        settings.method = repeat % 3;
        settings.restarts = 3;
        if (perp_ncp_solve(context, z, w, &result, &settings, &problem, e.start) != PERP_OK)
            fail_msg("%d: %s", repeat, perp_context_message(context));
        for (int32_t i = 0; i < e.n; i++)
            assert_true(z[i] >= e.lower[i] && z[i] <= e.upper[i]);
        assert_false(isnan(result.residual) || isnan(result.natural_residual) ||
                     isnan(result.backward_error));
        if (!is_good(&result))
            continue;
        good++;
        for (int32_t i = 0; i < e.n; i++)
            assert_true(isfinite(z[i]) && isfinite(w[i]));
    }
    assert_true(good > 150);
}

/* ---- functions that saturate ----------------------------------------------------------------- */

/* F_i = tanh(s_i (z_i - a_i)): away from a_i its slope is as good as none. */
typedef struct sigmoids {
    int32_t n;
    double s[4], a[4];
} sigmoids;

static int32_t sigmoid_function(double *F, const double *z, void *user)
{
    const sigmoids *p = user;

    for (int32_t i = 0; i < p->n; i++)
        F[i] = tanh(p->s[i] * (z[i] - p->a[i]));
    return 0;
}

static int32_t sigmoid_jacobian(double *J, const double *z, void *user)
{
    const sigmoids *p = user;

    memset(J, 0, (size_t)(p->n * p->n) * sizeof *J);
    for (int32_t i = 0; i < p->n; i++) {
        const double c = cosh(fmin(fabs(p->s[i] * (z[i] - p->a[i])), 300));

        J[i + p->n * i] = p->s[i] / c / c;
    }
    return 0;
}

/* F grows with each z_i, so a is the only answer. A slope of 1e-100 says that bounds are near
 * wherever z is; F at the bound says otherwise. s (z - a) = tanh^-1 w: 1e-4 / s is far off. */
static void test_where_functions_saturate(void **state)
{
    uint64_t random = 7;
    int good = 0;

    (void)state;
    for (int repeat = 0; repeat < 600; repeat++) {
        perp_ncp_settings settings = fresh_ncp_settings();
        perp_ncp_problem problem = fresh_ncp_problem();
        perp_ncp_result result = fresh_ncp_result();
        double z[4], z0[4], lower[4], upper[4];
        sigmoids p;

        problem.n = p.n = 1 + repeat % 4;
        for (int32_t i = 0; i < p.n; i++) {
            p.s[i] = pow(10, 3 * zoo_random(&random));
            p.a[i] = 0.5 + 2 * zoo_random(&random);
            z0[i] = 4 * zoo_random(&random);
            lower[i] = repeat % 8 < 4 ? 0 : -INFINITY;
            upper[i] = repeat % 8 < 6 ? INFINITY : 1e3;
        }
        problem.function = sigmoid_function;
        problem.jacobian = sigmoid_jacobian;
        problem.lower = lower;
        problem.upper = upper;
        problem.user = &p;
        settings.method = repeat / 8 % 3;
        settings.polish = repeat % 5 > 0;
        settings.restarts = 8;
        assert_int_equal(perp_ncp_solve(context, z, NULL, &result, &settings, &problem, z0),
                         PERP_OK);
        for (int32_t i = 0; is_good(&result) && i < p.n; i++)
            if (!(fabs(z[i] - p.a[i]) <= 1e-4 / p.s[i]))
                fail_msg("%d, method %d: %s, but z[%d] is %g, not %g", repeat, settings.method,
                         perp_outcome_text(result.outcome), i, z[i], p.a[i]);
        good += is_good(&result);
    }
    assert_true(good >= 100); /* or this test would test nothing */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_jacobians),
        cmocka_unit_test(test_no_start_is_called_solved),
        cmocka_unit_test(test_edges),
        cmocka_unit_test(test_where_functions_saturate),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
