/* Verdicts: what is called solved is, whatever the units and however large the numbers; parts of a
 * problem are judged as they are alone; and what has a solution gets one where n is small. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/perp.h>

#include "gen.h"
#include "rational.h"
#include "run.h"

#include "context.h"

static const int32_t methods[] = {PERP_LCP_AUTO, PERP_LCP_LEMKE, PERP_LCP_PGS, PERP_LCP_FISCHER,
                                  PERP_LCP_ACTIVE_SET};

/* Three linear equations with a coupling e that is noise: Cramer's rule gives
 * z = (13 - e 13 ..., ...) with determinant -3 + e^2, see below. */
static void test_noise_in_place_of_a_zero(void **state)
{
    static const double sizes[] = {1e-4, 1e-8, 1e-12, 1e-16, 1e-20, 1e-300};
    static const double lower[3] = {-INFINITY, -INFINITY, -INFINITY};
    static const double upper[3] = {INFINITY, INFINITY, INFINITY}, q[3] = {-1, 3, 5};
    size_t k;

    (void)state;
    for (k = 0; k < 6; k++) {
        const double e = sizes[k], M[9] = {1, e, 0, e, -1, 2, 0, 2, -1};
        /* z2 = 5 + 2 z1, z0 = 1 - e z1: e - e^2 z1 - z1 + 10 + 4 z1 + 3 = 0 */
        const double z1 = -(13 + e) / (3 - e * e);
        const double z[3] = {1 - e * z1, z1, 5 + 2 * z1};
        perp_matrix view = run_dense(M, 3);
        run r;

        run_view(&r, context, &view, q, lower, upper, NULL, NULL, "F18");
        assert_true(run_ok(&r));
        /* condition below 10, a few roundings */
        assert_true(run_distance(r.z, z, 3) <= 100 * DBL_EPSILON);
        run_release(&r);
    }
}

/* Rows whose entries are all noise, beside rows that the diagonals of others give units of noise:
 * their own units tell that they are violated, or leave them out. Numbers by exact fractions. */
#define E 1e-12
#define A (-0.1691873878492694)
#define B (-1.9606694254220529)
#define C (-0.99193125083922307)
static void test_rows_of_noise(void **state)
{
    static const double M[4][25] = {
        {0, 0, 0, A, B, 0, -E, -E, -E, -E, 0, -E, -E, 0, 0, A, -E, 0, B, -E, B, -E, 0, -E, B * E},
        {0, 0, 0, A, C, 0, -E, -E, -E, -E, 0, -E, -E, -E, -E, A, -E, -E, 0, 0, C, -E, -E, 0, -E},
        {0, 0, 0, A, C, -E, -E, -E, -E, -E, -E, -E, -E, -E, 0, 0, 0, 0, 0, B, -E, -E, -E, -E, -E},
        {0, 0, E, 1, 0, 0, -E, 0, -E, E, 0, 0, -1, 0, 0, E}};
    static const double q[4][5] = {
        {-E, -E, 0, 0, 1}, {-E, -E, -E, -E, -E}, {-E, -E, -E, -E, -E}, {-E, 0.5, -1, 1}};
    static const double low[5] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY, -INFINITY};
    static const double high[5] = {INFINITY, INFINITY, INFINITY, INFINITY, INFINITY};
    static const double bounds[4] = {0, -1.872169529180552, 3.0600212399750979, 3.97712430268185};
    size_t k, m;

    (void)state;
    for (k = 0; k < 4; k++)
        for (m = 0; m < sizeof methods / sizeof *methods; m++) {
            const int32_t n = k < 3 ? 5 : 4;
            perp_lcp_settings settings = run_settings(methods[m]);
            perp_matrix view = run_dense(M[k], n);
            double near;
            run r;

            if (methods[m] == PERP_LCP_PGS) /* no diagonal to sweep with */
                continue;
            run_view(&r, context, &view, q[k], k < 3 ? low : bounds, high, &settings, NULL,
                     "noise");
            if (methods[m] == PERP_LCP_AUTO)
                assert_int_equal(run_ok(&r), k != 2);
            /* rows 2 and 4 differ by E z_4 = 0, row 3 says z_4 = E / B: no solution */
            assert_false(k == 2 && run_ok(&r));
            /* ten times what is asked for, tol or its root, of rows that cancel */
            near = r.result.outcome == PERP_OUTCOME_SOLVED ? 1e-9 : 1e-4;
            if (k == 0 && run_ok(&r))
                assert_true(fabs(r.z[1] / 2254047384721.2793 - 1) <= near);
            if (k == 3 && run_ok(&r))
                assert_true(fabs(r.z[2] / 5e11 - 1) <= near);
            run_release(&r);
        }
}
#undef A
#undef B
#undef C
#undef E

/* [[2, 0], [0, 3]]: z = (1e30, 1/3) is exact; row 0 is no business of row 1. */
static void test_a_large_neighbour(void **state)
{
    static const double M[4] = {2, 0, 0, 3}, q[2] = {-1, 1}, lower[2] = {0, 1e30};
    static const double upper[2] = {INFINITY, INFINITY};
    static const double M2[4] = {3, 1e-40, 1e-40, 2}, q2[2] = {-1, 1};
    size_t m;

    (void)state;
    for (m = 0; m < sizeof methods / sizeof *methods; m++) {
        perp_lcp_settings settings = run_settings(methods[m]);
        perp_matrix view = run_dense(M, 2);
        run r;

        run_view(&r, context, &view, q, lower, upper, &settings, NULL, "parts");
        assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
        assert_true(r.z[0] == 0.5 && r.z[1] == 1e30 && r.w[0] == 0.0);
        run_release(&r);
        view = run_dense(M2, 2); /* a coupling that carries 1e-10 to row 0 */
        run_view(&r, context, &view, q2, lower, upper, &settings, NULL, "coupled");
        /* active sets take signs beside the largest z and may give up, but not be wrong (run_view)
         */
        if (r.result.outcome != PERP_OUTCOME_SOLVED && methods[m] != PERP_LCP_ACTIVE_SET)
            fail_msg("%s: %s", perp_lcp_method_text(methods[m]),
                     perp_outcome_text(r.result.outcome));
        assert_true(!run_ok(&r) ||
                    (fabs(r.z[0] - (1 - 1e-10) / 3) <= 4 * DBL_EPSILON && r.z[1] == 1e30));
        run_release(&r);
    }
}

/* Finite input never crashes, and what is called solved is finite and solves: run_view checks both
 * against exact sums. Skew matrices with entries from 1e-300 to 1e300, scaled or not. */
static void test_hostile_sizes(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 70);
    for (round = 0; round < 600; round++) {
        const int32_t n = 3 + gen_integer(&random, 6);
        double M[64], q[8];
        perp_lcp_settings settings = run_settings(methods[round % 5]);
        perp_matrix view;
        char where[32];
        int32_t i, j;
        run r;

        for (i = 0; i < n; i++) {
            q[i] = gen_uniform(&random, -1, 1);
            for (j = 0; j <= i; j++) {
                const double x = pow(10, gen_uniform(&random, -300, 300));

                M[i * n + j] = gen_integer(&random, 3) == 0 ? 0.0 : x;
                M[j * n + i] = i == j && (round % 5 == 2 || round % 5 == 4) ? x : -M[i * n + j];
            }
        }
        settings.scaling = round % 2;
        settings.max_iterations = 1000;
        view = run_dense(M, n);
        snprintf(where, sizeof where, "round %d", round);
        run_view(&r, context, &view, q, NULL, NULL, &settings, NULL, where);
        run_release(&r);
    }
}

/* The sweep overflows after a pause: no method's own word is believed. */
static void test_a_pause_is_no_verdict(void **state)
{
    static const double M[16] = {4, -1, 0, 0, -3, 4, -3, 0, 0, -2, 4, 0, 0, 0, 0, 3};
    static const double q[4] = {1, 1, 1, 1};
    static const double lower[4] = {-INFINITY, -INFINITY, -INFINITY, 1e154};
    static const double upper[4] = {1, INFINITY, INFINITY, DBL_MAX};
    perp_lcp_settings settings = run_settings(PERP_LCP_PGS);
    perp_matrix view = run_dense(M, 4);
    run r;

    (void)state;
    run_view(&r, context, &view, q, lower, upper, &settings, NULL, "F2");
    /* (4, -1, 0; -3, 4, -3; 0, -2, 4) z = -1: z = (-17, -40, -27) / 28 */
    assert_int_equal(r.result.outcome, PERP_OUTCOME_SOLVED);
    assert_true(fabs(r.z[0] + 17.0 / 28) <= 1e-12 && fabs(r.z[1] + 40.0 / 28) <= 1e-12 &&
                fabs(r.z[2] + 27.0 / 28) <= 1e-12 && r.z[3] == 1e154);
    run_release(&r);
}

/* Blocks of random problems on the diagonal, each in units of its own: M_k 2^a, q_k 2^b. */
typedef struct stack {
    gen_lcp parts[4];
    int32_t a[4], b[4], n;
    double M[40 * 40], q[40], lower[40], upper[40];
} stack;

static void make_stack(stack *s, gen_random *random, int spread)
{
    int32_t at = 0, i, j;
    int k;

    memset(s, 0, sizeof *s);
    for (k = 0; k < 4; k++) {
        gen_problem(&s->parts[k], random, 1 + gen_integer(random, 9),
                    gen_integer(random, GEN_CLASSES), GEN_PLAIN);
        s->a[k] = gen_integer(random, 2 * spread + 1) - spread;
        s->b[k] = gen_integer(random, 2 * spread + 1) - spread;
        s->n += s->parts[k].n;
    }
    for (k = 0; k < 4; at += s->parts[k++].n)
        for (i = 0; i < s->parts[k].n; i++) {
            for (j = 0; j < s->parts[k].n; j++)
                s->M[(at + i) * s->n + at + j] =
                    ldexp(s->parts[k].M[i * s->parts[k].n + j], s->a[k]);
            s->q[at + i] = ldexp(s->parts[k].q[i], s->b[k]);
        }
}

/* The answer of every part must solve it as it does alone, the verdict is the worst of theirs. */
static void compare_stack(const stack *s, const run *whole, const perp_lcp_settings *settings,
                          const char *where)
{
    int32_t at = 0, i;
    int k, good = 1;

    for (k = 0; k < 4; at += s->parts[k++].n) {
        const gen_lcp *part = &s->parts[k];
        double z[9], own, size = 0.0;
        check_lcp problem = {&part->view, part->q, NULL, NULL, 1};
        check_measures m;
        run alone;

        run_view(&alone, context, &part->view, part->q, NULL, NULL, settings, NULL, where);
        good &= run_ok(&alone);
        for (i = 0; i < part->n; i++)
            z[i] = ldexp(whole->z[at + i], s->a[k] - s->b[k]);
        check_measure(&m, &problem, z, NULL);
        own = m.residual;
        if (run_ok(whole) && !(own <= settings->tol))
            fail_msg("%s: part %d of a good whole has the residual %g", where, k, own);
        for (i = 0; i < part->n; i++)
            size = fmax(size, fabs(part->z[i]));
        /* a unique solution to within the condition of these problems of small numbers */
        if (run_ok(whole) && run_ok(&alone))
            assert_true(run_distance(alone.w, part->w, part->n) <= 1e-6 * fmax(1.0, size));
        run_release(&alone);
    }
    if (good != run_ok(whole))
        fail_msg("%s: the parts alone are %s, the whole is %s", where, good ? "good" : "not good",
                 perp_outcome_text(whole->result.outcome));
}

static void test_parts_are_judged_as_alone(void **state)
{
    static stack s;
    gen_random random;
    int round, k;

    (void)state;
    gen_seed(&random, 71);
    for (round = 0; round < 300; round++) {
        /* pgs and active_set do not solve all classes even alone */
        perp_lcp_settings settings = run_settings(methods[round % 3 == 2 ? 3 : round % 3]);
        perp_matrix view;
        char where[48];
        run r;

        make_stack(&s, &random, round < 30 ? 0 : 100);
        view = run_dense(s.M, s.n);
        snprintf(where, sizeof where, "round %d, %s", round, perp_lcp_method_text(settings.method));
        run_view(&r, context, &view, s.q, NULL, NULL, &settings, NULL, where);
        compare_stack(&s, &r, &settings, where);
        run_release(&r);
        for (k = 0; k < 4; k++)
            gen_destroy(&s.parts[k]);
    }
}

/* ---- small problems with a solution ---------------------------------------------------------- */

#define LARGEST 12 /* up to this n the pattern tree has the last word */

typedef struct integers {
    int32_t n;
    int M[LARGEST * LARGEST], q[LARGEST];
    int planted; /* made from a solution */
} integers;

/* Kinds of M: full, few entries of -1..1, symmetric, a product of rank r <= n / 2 + 1, skew. */
static void make_matrix(integers *p, gen_random *random, int kind)
{
    const int32_t n = p->n, rank = 1 + gen_integer(random, n / 2 + 1);
    int A[LARGEST * LARGEST], B[LARGEST * LARGEST], i, j, k;

    for (i = 0; i < n * n; i++) {
        p->M[i] = kind == 1 ? (gen_integer(random, 5) - 2) / 2 : gen_integer(random, 7) - 3;
        A[i] = gen_integer(random, 3) - 1;
        B[i] = gen_integer(random, 3) - 1;
    }
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            if (kind == 2 || kind == 4)
                p->M[i * n + j] = (kind == 4 ? -1 : 1) * p->M[j * n + i];
            if (kind == 4 && i == j)
                p->M[i * n + j] = gen_integer(random, 2);
        }
    for (i = 0; i < n && kind == 3; i++)
        for (j = 0; j < n; j++)
            for (p->M[i * n + j] = 0, k = 0; k < rank; k++)
                p->M[i * n + j] += A[i * n + k] * B[k * n + j];
}

/* q is random, or -M z + w of complementary z and w; a third of their pairs are both 0. */
static void make_integers(integers *p, gen_random *random, int round)
{
    const int32_t n = p->n = 1 + gen_integer(random, LARGEST);
    int i, j;

    make_matrix(p, random, round % 5);
    p->planted = round % 3 == 2;
    for (i = 0; i < n; i++)
        p->q[i] = p->planted ? 0 : gen_integer(random, 7) - 3;
    for (j = 0; j < n && p->planted; j++) {
        const int at = gen_integer(random, 3), value = 1 + gen_integer(random, 3);

        p->q[j] += at == 1 ? value : 0;
        for (i = 0; i < n && at == 2; i++)
            p->q[i] -= p->M[i * n + j] * value;
    }
}

/* All index sets with a regular block, exactly. */
static int has_solution(const integers *p)
{
    int64_t numerators[RATIONAL_LARGEST], denominator;
    unsigned set;

    for (set = 0; set < 1u << p->n; set++)
        if (rational_basic_solution(p->n, p->M, p->q, set, numerators, &denominator))
            return 1;
    return 0;
}

/* Problems of small integers up to n = 12: where there is a solution, auto has one too; the point
 * it returns is checked by run_lcp. Index sets are enumerated where it has none, and where that is
 * cheap. VERDICTS in the environment asks for another number of problems. */
static void test_auto_solves_what_has_a_solution(void **state)
{
    const char *wanted = getenv("VERDICTS");
    const long count = wanted ? atol(wanted) : 4000;
    long round, solvable = 0, patterns = 0, unsolved = 0;
    gen_random random;

    (void)state;
    gen_seed(&random, 72);
    for (round = 0; round < count; round++) {
        integers p;
        gen_lcp problem;
        int known;
        run r;

        make_integers(&p, &random, (int)(round % 15));
        gen_from_integers(&problem, p.n, p.M, p.q);
        run_lcp(&r, context, &problem, NULL, NULL, "integers");
        known = p.planted || ((p.n <= 6 || !run_ok(&r)) && has_solution(&p));
        solvable += known || run_ok(&r);
        patterns += r.result.method == PERP_LCP_PATTERNS;
        if (known && !run_ok(&r)) {
            unsolved++;
            print_error("round %ld of n = %d has a solution, but ends as %s\n", round, (int)p.n,
                        perp_outcome_text(r.result.outcome));
        }
        run_release(&r);
        gen_destroy(&problem);
    }
    assert_int_equal(unsolved, 0);
    /* the question is asked, and enumeration answers some of it */
    assert_true(solvable > count / 4 && patterns > count / 100);
    if (wanted)
        print_message("%ld problems, %ld solvable, %ld solved by patterns\n", count, solvable,
                      patterns);
}

/* The budget is one for the whole call, and what is called iterations is all of them. */
static void test_max_iterations_is_a_budget(void **state)
{
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 73);
    for (round = 0; round < 300; round++) {
        const int32_t n = 1 + gen_integer(&random, 12);
        perp_lcp_settings settings = run_settings(methods[round % 5]);
        int M[144], q[12], i;
        gen_lcp problem;
        run r;

        for (i = 0; i < n * n; i++)
            M[i] = i % (n + 1) == 0 ? 1 + gen_integer(&random, 3) : gen_integer(&random, 7) - 3;
        for (i = 0; i < n; i++)
            q[i] = gen_integer(&random, 7) - 3;
        gen_from_integers(&problem, n, M, q);
        settings.max_iterations = 1 + round % 7;
        run_lcp(&r, context, &problem, &settings, NULL, "budget");
        assert_true(r.result.iterations <= settings.max_iterations);
        run_release(&r);
        gen_destroy(&problem);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_in_place_of_a_zero),
        cmocka_unit_test(test_rows_of_noise),
        cmocka_unit_test(test_a_large_neighbour),
        cmocka_unit_test(test_hostile_sizes),
        cmocka_unit_test(test_a_pause_is_no_verdict),
        cmocka_unit_test(test_parts_are_judged_as_alone),
        cmocka_unit_test(test_auto_solves_what_has_a_solution),
        cmocka_unit_test(test_max_iterations_is_a_budget),
    };

    return cmocka_run_group_tests(tests, make, destroy);
}
