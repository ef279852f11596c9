/* perp_lcp_all: all solutions of problems whose solutions are known, and of random ones against
 * rational arithmetic. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "rational.h"
#include "run.h"
#include "all_list.h"

#include "context.h"

/* ---- known solutions ----------------------------------------------------------------------- */

typedef struct known {
    const char *name;
    int n, M[16], q[4];
    int isolated, families, dimension, points, rays;
} known;

/* The matrices' classes are Cottle, Pang & Stone's, the counts by exact enumeration. */
static const known zoo[] = {
    {"P, not PD", 2, {1, 3, 0, 1}, {-1, -1}, 1, 0, 0, 1, 0},
    {"PSD, a segment", 2, {1, 1, 1, 1}, {-1, -1}, 0, 1, 1, 2, 0},
    {"P0, none", 2, {0, 1, 0, 0}, {1, -1}, 0, 0, 0, 0, 0},
    {"copositive-plus, none", 2, {0, -1, 1, 0}, {-1, -1}, 0, 0, 0, 0, 0},
    {"copositive-plus, one", 2, {0, -1, 1, 0}, {1, -1}, 1, 0, 0, 1, 0},
    {"strictly copositive", 2, {1, 2, 2, 1}, {-1, -1}, 3, 0, 0, 3, 0},
    {"Z, none", 2, {1, -2, -2, 1}, {-1, -1}, 0, 0, 0, 0, 0},
    {"Z, two", 2, {1, -2, -2, 1}, {1, 1}, 2, 0, 0, 2, 0},
    {"N, one", 2, {-1, 2, 2, -1}, {-1, -1}, 1, 0, 0, 1, 0},
    {"N, three", 2, {-1, 2, 2, -1}, {1, 1}, 3, 0, 0, 3, 0},
    {"bimatrix",
     4,
     {0, 0, 10, 30, 0, 0, 20, 15, 10, 30, 0, 0, 20, 15, 0, 0},
     {-1, -1, -1, -1},
     3,
     0,
     0,
     3,
     0},
    {"CPS 4.4.7", 3, {0, -1, 2, 2, 0, -2, -1, 1, 0}, {-3, 6, -1}, 1, 0, 0, 1, 0},
    {"everything", 3, {0}, {0}, 0, 1, 3, 1, 3},
    {"two half-lines", 2, {0, 0, 1, 0}, {0, -1}, 0, 2, 1, 2, 2},
    {"a degenerate point", 2, {2, 1, 1, 2}, {-2, -1}, 1, 0, 0, 1, 0},
};

static void test_zoo(void **state)
{
    size_t k;

    (void)state;
    for (k = 0; k < sizeof zoo / sizeof *zoo; k++) {
        const known *z = &zoo[k];
        gen_lcp problem;
        list l;

        gen_from_integers(&problem, z->n, z->M, z->q);
        enumerate(context, &l, &problem);
        if (l.isolated != z->isolated || l.families != z->families ||
            l.largest_dimension != z->dimension || l.points != z->points || l.rays != z->rays)
            fail_msg("%s: %d isolated, %d families, dimension %d, %d points, %d rays", z->name,
                     (int)l.isolated, (int)l.families, (int)l.largest_dimension, (int)l.points,
                     (int)l.rays);
        free(l.at);
        gen_destroy(&problem);
    }
}

static void test_empty(void **state)
{
    gen_lcp problem;
    list l;

    (void)state;
    gen_from_integers(&problem, 0, NULL, NULL);
    enumerate(context, &l, &problem);
    assert_int_equal(l.isolated, 1); /* the empty vector */
    free(l.at);
    gen_destroy(&problem);
}

/* Classes with one solution, with all kinds of bounds: it is found, alone. */
static void test_unique(void **state)
{
    static const int classes[] = {GEN_PD_SYMMETRIC, GEN_PD_UNSYMMETRIC, GEN_P, GEN_M};
    gen_random random;
    int round;

    (void)state;
    gen_seed(&random, 1);
    for (round = 0; round < 200; round++) {
        const int32_t n = 1 + gen_integer(&random, 8);
        gen_lcp problem;
        list l;

        gen_problem(&problem, &random, n, classes[round % 4], round / 4 % GEN_BOUNDS);
        enumerate(context, &l, &problem);
        assert_int_equal(l.isolated, 1);
        assert_int_equal(l.families, 0);
        assert_true(run_distance(l.first, problem.z, n) <= 1e-9);
        free(l.at);
        gen_destroy(&problem);
    }
}

/* M = -I, q = e: every vector of zeros and ones. */
static void test_many(void **state)
{
    const int32_t n = 10;
    gen_lcp problem;
    list l;
    int32_t i, code;

    (void)state;
    gen_problem(&problem, &(gen_random){1}, n, GEN_M, GEN_PLAIN);
    for (i = 0; i < n * n; i++)
        problem.M[i] = i % (n + 1) == 0 ? -1.0 : 0.0;
    for (i = 0; i < n; i++)
        problem.q[i] = 1.0;
    assert_int_equal(enumerate(context, &l, &problem).bases, 1024);
    assert_int_equal(l.isolated, 1024);
    for (code = 0; code < 1024; code++) {
        double z[10];

        for (i = 0; i < n; i++)
            z[i] = code >> i & 1;
        assert_true(is_listed(&l, z));
    }
    free(l.at);
    gen_destroy(&problem);
}

/* No block of a random matrix is singular: pivots that were put off are found in the end. */
static void test_regular_blocks(void **state)
{
    gen_random random;
    int32_t round, i, solutions = 0;

    (void)state;
    gen_seed(&random, 3);
    for (round = 0; round < 20; round++) {
        gen_lcp problem;
        list l;

        gen_problem(&problem, &random, 11, GEN_M, GEN_PLAIN);
        for (i = 0; i < 121; i++)
            problem.M[i] = gen_normal(&random);
        for (i = 0; i < 11; i++)
            problem.q[i] = gen_normal(&random);
        assert_int_equal(enumerate(context, &l, &problem).singular, 0);
        assert_int_equal(l.families, 0);
        solutions += l.isolated;
        free(l.at);
        gen_destroy(&problem);
    }
    assert_true(solutions > 0);
}

/* ---- against rational arithmetic ----------------------------------------------------------- */

/* A basic solution with a regular block is a vertex of every polyhedron of solutions that holds it:
 * none may be missing. Where every block is regular the isolated solutions are just those. */
static void test_rational(void **state)
{
    gen_random random;
    int round, solutions = 0;

    (void)state;
    gen_seed(&random, 2);
    for (round = 0; round < 500; round++) {
        int M[36], q[6], n = 1 + gen_integer(&random, 6), size = 1 + gen_integer(&random, 4), i;
        double basic[64][6];
        int32_t count = 0, k;
        gen_lcp problem;
        unsigned set;
        list l;

        for (i = 0; i < n * n; i++)
            M[i] = gen_integer(&random, 2 * size + 1) - size;
        for (i = 0; i < n; i++)
            q[i] = gen_integer(&random, 2 * size + 1) - size;
        gen_from_integers(&problem, n, M, q);
        enumerate(context, &l, &problem);
        for (set = 0; set < 1u << n; set++) {
            int64_t numerators[6], denominator;

            if (!rational_basic_solution(n, M, q, set, numerators, &denominator))
                continue;
            for (i = 0; i < n; i++)
                basic[count][i] = (double)numerators[i] / (double)denominator;
            assert_true(is_listed(&l, basic[count]));
            for (k = 0; k < count; k++)
                if (run_distance(basic[k], basic[count], n) <= 1e-12)
                    break;
            count += k == count; /* a degenerate one has several index sets */
        }
        solutions += count;
        if (l.families == 0)
            assert_true(l.isolated >= count);
        free(l.at);
        gen_destroy(&problem);
    }
    assert_true(solutions > 300);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_zoo),
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_unique),
        cmocka_unit_test(test_many),
        cmocka_unit_test(test_regular_blocks),
        cmocka_unit_test(test_rational),

    };

    return cmocka_run_group_tests(tests, make, destroy);
}
