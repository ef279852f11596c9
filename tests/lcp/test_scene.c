/* The generator of contact problems makes what its theory is about: z'M z = |m^-1/2 B x|^2 + sum mu
 * lambda c, copositive; gaps >= 0; the same bits for the same options. */
#include <math.h>
#include <string.h>

#include "suite.h"

#include "scene.h"

/* A small problem of any class, in order and in plain units. */
static scene_options plain(uint64_t seed)
{
    scene_options o = scene_draw(seed);

    o.contacts = 8 + (int32_t)(seed % 9);
    o.permuted = 0;
    o.scaling = SCENE_PLAIN;
    return o;
}

static double entry(const gen_lcp *problem, int32_t i, int32_t j)
{
    return problem->M[(size_t)i * (size_t)problem->n + (size_t)j];
}

/* Rows of one contact follow each other: normal, directions, lambda. */
static void check_rows(const gen_lcp *problem, int32_t each)
{
    int32_t half = (each - 2) / 2, c, d, j;

    assert_int_equal(problem->n % each, 0);
    for (c = 0; c < problem->n; c += each) {
        double mu = entry(problem, c + each - 1, c);

        assert_true(mu >= 0.0 && problem->q[c + each - 1] == 0.0);
        assert_true(entry(problem, c, c) > 0.0); /* every contact can move something */
        for (d = 1; d <= half; d++) {            /* opposite directions, bit for bit */
            assert_true(problem->q[c + d] == -problem->q[c + half + d]);
            for (j = 0; j < problem->n; j++)
                if (j % each != each - 1)
                    assert_true(entry(problem, c + d, j) == -entry(problem, c + half + d, j));
            assert_true(entry(problem, c + d, c + each - 1) == 1.0);
            assert_true(entry(problem, c + each - 1, c + d) == -1.0);
        }
    }
}

static void check_quadratic_form(const gen_lcp *problem, gen_random *random, int32_t each)
{
    double z[1024], form = 0.0, friction = 0.0, size = 0.0;
    int32_t i, j;

    assert_true(problem->n <= 1024);
    for (i = 0; i < problem->n; i++)
        z[i] = gen_uniform(random, 0, 1);
    for (i = 0; i < problem->n; i++)
        for (j = 0; j < problem->n; j++) {
            double term = z[i] * entry(problem, i, j) * z[j];

            form += term;
            size += fabs(term);
            if (i % each == each - 1 && j == i - each + 1)
                friction += term;
        }
    /* half a million products and sums, each with a rounding of 1e-16 of at most `size` */
    assert_true(form - friction >= -1e-10 * size);
}

static void test_structure(void **state)
{
    gen_random random;
    uint64_t seed;

    (void)state;
    gen_seed(&random, 71);
    for (seed = 1; seed <= 240; seed++) {
        scene_options o = plain(seed);
        int32_t each = o.class >= SCENE_PLANAR_WALL ? 4 : o.directions + 2;
        gen_lcp problem;

        scene_lcp(&problem, &o);
        check_rows(&problem, each);
        check_quadratic_form(&problem, &random, each);
        gen_destroy(&problem);
    }
}

/* Permutations and scalings change names and units only: the multiset of |entries| is the same, and
 * row i of the row-scaled problem is a positive multiple of row i of the plain one. */
static void test_units(void **state)
{
    uint64_t seed;

    (void)state;
    for (seed = 1; seed <= 60; seed++) {
        scene_options o = plain(seed);
        gen_lcp problem, scaled;
        int32_t i, j;

        scene_lcp(&problem, &o);
        o.scaling = SCENE_ROWS;
        scene_lcp(&scaled, &o);
        assert_int_equal(problem.n, scaled.n);
        for (i = 0; i < problem.n; i++) {
            double factor = 0.0;

            for (j = 0; j < problem.n && factor == 0.0; j++)
                if (entry(&problem, i, j) != 0.0)
                    factor = entry(&scaled, i, j) / entry(&problem, i, j);
            assert_true(factor >= 0.99e-6 && factor <= 1.01e6);
            for (j = 0; j < problem.n; j++) /* one rounding each */
                assert_true(fabs(entry(&scaled, i, j) - factor * entry(&problem, i, j)) <=
                            1e-15 * fabs(entry(&scaled, i, j)));
        }
        gen_destroy(&scaled);
        gen_destroy(&problem);
    }
}

static void test_same_bits(void **state)
{
    uint64_t seed;

    (void)state;
    for (seed = 1; seed <= 60; seed++) {
        scene_options o = scene_draw(seed);
        gen_lcp first, second;
        size_t bytes;

        o.contacts = 8;
        scene_lcp(&first, &o);
        scene_lcp(&second, &o);
        bytes = (size_t)first.n * sizeof(double);
        assert_int_equal(first.n, second.n);
        assert_memory_equal(first.M, second.M, bytes * (size_t)first.n);
        assert_memory_equal(first.q, second.q, bytes);
        gen_destroy(&second);
        gen_destroy(&first);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structure),
        cmocka_unit_test(test_units),
        cmocka_unit_test(test_same_bits),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
