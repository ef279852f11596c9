/* Load-dependent friction with numbers of every size: every call ends, every answer is one, and
 * what is claimed of all answers is claimed only where the numbers can tell. Long doubles are the
 * judge: no product of three doubles leaves their range. */
#include "friction_run.h"

enum { LARGEST = 3 };

static uint64_t seed;

static int draw(int count)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (int)((seed >> 33) % (uint64_t)count);
}

static double draw_size(void)
{
    static const double sizes[] = {0.0,
                                   4.9e-324,
                                   1e-308,
                                   1e-160,
                                   1e-30,
                                   1e-12,
                                   1e-8,
                                   0.25,
                                   0.5,
                                   1.0,
                                   1.0,
                                   2.0,
                                   3.0,
                                   1e8,
                                   1e12,
                                   1e100,
                                   1e160,
                                   1e300,
                                   1.7976931348623157e308};

    return sizes[draw(3) == 0 ? draw(19) : 7 + draw(6)] * (draw(2) ? 1.0 : -1.0);
}

typedef struct sized {
    int n;
    double A[LARGEST * LARGEST], C[LARGEST * LARGEST];
    double b[LARGEST], d[LARGEST], mu[LARGEST], tau[LARGEST], velocity[LARGEST];
} sized;

/* A of moderate size: it must be positive definite. */
static void draw_system(sized *s, int n, int may_rest)
{
    int i, j;

    s->n = n;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) {
            s->A[n * i + j] = i == j ? 2.0 + i : 0.5;
            s->C[n * i + j] = draw_size();
        }
        s->b[i] = draw_size();
        s->d[i] = draw_size();
        s->tau[i] = draw_size();
        s->mu[i] = draw(3) ? 0.25 * draw(5) : fabs(draw_size());
        s->velocity[i] = may_rest ? draw(3) - 1 : 2 * draw(2) - 1;
    }
}

static int32_t begin(asked *a, const sized *s)
{
    describe(a, s->n, s->A, s->b, s->C, s->d, s->mu);
    start(a, NULL);
    return ask(a, s->tau, s->velocity);
}

/* Each row of an isolated answer beside its own terms, with the friction of the normal force
 * recomputed; 1e-9: tol is 1e-13, and a coefficient of a solution may stand for 1e3 of the terms.
 */
static void check_answer(const sized *s, const perp_load_found *found)
{
    int i, j;

    for (i = 0; i < s->n; i++) {
        const double v = s->velocity[i], x = found->acceleration[i];
        const double sign = v != 0.0 ? v : (double)((x > 0.0) - (x < 0.0));
        long double row = (long double)s->b[i] - s->tau[i], normal = s->d[i];
        long double terms = fabsl(s->b[i]) + fabsl(s->tau[i]), normal_terms = fabsl(s->d[i]);

        assert_true(isfinite(x) && isfinite(found->normal_force[i]) &&
                    isfinite(found->friction[i]));
        for (j = 0; j < s->n; j++) {
            row += (long double)s->A[s->n * i + j] * found->acceleration[j];
            terms += fabsl((long double)s->A[s->n * i + j] * found->acceleration[j]);
            normal += (long double)s->C[s->n * i + j] * found->acceleration[j];
            normal_terms += fabsl((long double)s->C[s->n * i + j] * found->acceleration[j]);
        }
        terms += s->mu[i] * normal_terms;
        if (found->modes[i] == PERP_LOAD_STICK)
            assert_true(x == 0.0 && (found->at_vertex ||
                                     fabsl(row) <= s->mu[i] * fabsl(normal) + 1e-9L * terms));
        else if (!(fabsl(row + found->friction[i]) <= 1e-9L * terms))
            fail_msg("row %d: %Lg beside %Lg", i, row + found->friction[i], terms);
        else if (!found->at_vertex) /* at a vertex the normal force is 0, or as good as that */
            assert_true(fabsl(found->friction[i] - s->mu[i] * sign * fabsl(normal)) <=
                        1e-9L * terms);
    }
}

static void test_every_answer_is_one(void **state)
{
    int round, answers = 0;

    (void)state;
    seed = 1;
    for (round = 0; round < 6000; round++) {
        int32_t count, k;
        sized s;
        asked a;

        draw_system(&s, 1 + round % LARGEST, round % 2);
        count = begin(&a, &s);
        for (k = 0; k < count; k++) {
            const perp_load_found found = answer(&a, k);
            int i;

            assert_true(found.residual < INFINITY);
            for (i = 0; i < s.n * (found.vertex_count + found.ray_count); i++)
                assert_true(isfinite(found.vertices[i]));
            if (found.dimension == 0)
                check_answer(&s, &found);
            answers++;
        }
        finish(&a);
    }
    assert_true(answers > 3000);
}

/* Two coordinates that press alike, stopped by a step or not, by accelerations of 1e-216: rows that
 * do not balance are no answer, be they what was sought. */
static void test_accelerations_of_next_to_nothing(void **state)
{
    int exponent, light;

    (void)state;
    for (exponent = 0; exponent <= 300; exponent += 10)
        for (light = 0; light < 2; light++) {
            const double large = pow(10.0, exponent), mass = light ? 3.1e-13 : 1.0;
            const sized s = {2,
                             {mass, mass / 8, mass / 8, mass},
                             {-large, -large, -large, -large},
                             {0.0, 0.0},
                             {-0x1p-52, -0x1p-52},
                             {1.25, 1.0},
                             {-8e-70, -3e-157},
                             {-1.0, -1.0}};
            perp_load_step step = fresh_load_step();
            asked a;
            int32_t count = begin(&a, &s), k;
            double next[2], normal[2];

            for (k = 0; k < count; k++) {
                const perp_load_found found = answer(&a, k);

                check_answer(&s, &found);
            }
            assert_int_equal(perp_load_friction_step(a.friction, next, normal, &step, s.tau,
                                                     s.velocity, NULL, 0x1p-20),
                             PERP_OK);
            for (k = 0; k < step.answers; k++) {
                const perp_load_found found = answer(&a, k);
                const double *x = found.acceleration;

                for (int i = 0; i < 2 && found.dimension == 0; i++) {
                    const double pressed = large * (fabs(x[0]) + fabs(x[1])) + 0x1p-52;
                    const double terms = mass * (fabs(x[0]) + fabs(x[1])) + s.mu[i] * pressed;

                    assert_true(fabs(s.A[2 * i] * x[0] + s.A[2 * i + 1] * x[1] + found.friction[i] -
                                     s.tau[i]) <= 1e-9 * (terms + fabs(s.tau[i])));
                }
            }
            finish(&a);
        }
}

/* One coordinate in motion: side N >= 0 and side N < 0 have an answer each or not. Returns their
 * number, or -1 where some number is within 1e-6 of a change, or beyond doubles. */
static int count_by_hand(const sized *s)
{
    int side, count = 0;

    for (side = -1; side <= 1; side += 2) {
        const long double t = (long double)s->mu[0] * s->velocity[0] * side;
        const long double inertia = s->A[0] + t * s->C[0];
        const long double force = (long double)s->tau[0] - s->b[0] - t * s->d[0];
        const long double x = force / inertia, normal = s->C[0] * x + s->d[0];

        if (!(fabsl(inertia) > 1e-6L * (s->A[0] + fabsl(t * s->C[0]))) || !(fabsl(x) < 1e300L) ||
            !(fabsl(force) > 1e-6L * (fabsl(s->tau[0]) + fabsl(s->b[0]) + fabsl(t * s->d[0]))) ||
            !(fabsl(normal) > 1e-6L * (fabsl(s->C[0] * x) + fabsl(s->d[0]))))
            return -1;
        count += side * normal > 0.0L;
    }
    return count;
}

static void test_exhaustive_counts(void **state)
{
    int round, compared = 0, open = 0;

    (void)state;
    seed = 2;
    for (round = 0; round < 20000; round++) {
        int32_t count;
        int expected;
        sized s;
        asked a;

        draw_system(&s, 1, 0);
        count = begin(&a, &s);
        expected = count_by_hand(&s);
        if (expected >= 0 && s.mu[0] > 0.0) {
            compared += a.summary.exhaustive;
            open += !a.summary.exhaustive;
            if (a.summary.exhaustive)
                assert_int_equal(count, expected);
            else
                assert_true(count <= expected);
        }
        finish(&a);
    }
    assert_true(compared > 5000 && open > 0);
}

/* A x + mu |C x + d| sgn v is one-to-one if and only if mu |C| < A. Rounding: mu |C| / A, and its
 * reciprocal, as eigenvalues of one row. */
static void test_uniqueness(void **state)
{
    int round, decided = 0;

    (void)state;
    seed = 3;
    for (round = 0; round < 5000; round++) {
        perp_load_uniqueness u = fresh_load_uniqueness();
        sized s;
        asked a;
        long double ratio;

        draw_system(&s, 1, 0);
        begin(&a, &s);
        ratio = (long double)s.mu[0] * fabs(s.C[0]) / s.A[0];
        assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
        assert_true(!isnan(u.margin) && !isnan(u.norm) && !isnan(u.radius));
        assert_true(u.margin == INFINITY ? ratio < 1e-308L : u.margin * ratio <= 1.0L + 1e-14L);
        if (u.verdict == PERP_LOAD_UNIQUE)
            assert_true(ratio < 1.0L + 1e-15L);
        if (u.verdict == PERP_LOAD_NOT_UNIQUE)
            assert_true(ratio > 1.0L - 1e-15L);
        decided += u.verdict != PERP_LOAD_UNDECIDED;
        finish(&a);
    }
    assert_true(decided > 3000);
}

/* Larger systems: every call ends, and no verdict is made of numbers that overflowed. */
static void test_larger_systems_end(void **state)
{
    int round;

    (void)state;
    seed = 4;
    for (round = 0; round < 2000; round++) {
        perp_load_uniqueness u = fresh_load_uniqueness();
        perp_load_step step = fresh_load_step();
        double next[LARGEST] = {42.0};
        perp_status status;
        sized s;
        asked a;
        int i;

        draw_system(&s, 2 + round % 2, round % 2);
        begin(&a, &s);
        assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, s.velocity), PERP_OK);
        assert_true(!isnan(u.margin) && !isnan(u.norm) && !isnan(u.radius));
        status = perp_load_friction_step(a.friction, next, NULL, &step, s.tau, s.velocity, NULL,
                                         round % 5 ? 1e-3 : 1e300);
        assert_true(status == PERP_OK || status == PERP_ERROR_NOT_FINITE);
        for (i = 0; i < s.n && status == PERP_OK; i++)
            assert_true(isfinite(next[i]));
        assert_true(status == PERP_OK || next[0] == 42.0);
        finish(&a);
    }
}

/* One entry of the largest double: balancing a matrix once went on for ever here. */
static void test_the_largest_number(void **state)
{
    const double A[] = {5.75, 2.25, 1, 1, 2.25, 7.75, 1.25, 3, 1, 1.25, 3.25, -1, 1, 3, -1, 3};
    const double C[] = {1e-100,    1e8,     1.7976931348623157e308,
                        -1e-160,   -0.3,    -1e-8,
                        1,         2.2e-16, -1e-8,
                        4.9e-324,  2,       1e12,
                        -2.2e-308, -0.3,    -2.2e-16,
                        1e-12};
    const double b[] = {1, -1.25, 1, -0.125}, d[] = {-3, -3, 0.75, 1}, mu[] = {0.25, 0.5, 0.375, 1};
    const double tau[] = {-1, -1, 1, 1}, velocity[] = {0, 1, 0, 0};
    perp_load_uniqueness u = fresh_load_uniqueness();
    asked a;

    (void)state;
    describe(&a, 4, A, b, C, d, mu);
    start(&a, NULL);
    ask(&a, tau, velocity);
    assert_int_equal(a.summary.exhaustive, 0);
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
    assert_int_not_equal(u.verdict, PERP_LOAD_UNIQUE); /* norms of 1e307 */
    finish(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_answer_is_one),
        cmocka_unit_test(test_exhaustive_counts),
        cmocka_unit_test(test_uniqueness),
        cmocka_unit_test(test_larger_systems_end),
        cmocka_unit_test(test_the_largest_number),
        cmocka_unit_test(test_accelerations_of_next_to_nothing),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
