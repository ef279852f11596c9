/* Random systems of integers: every answer by exact elimination of all patterns, in motion and at
 * rest, with normal forces of exactly 0 and limits met exactly; large systems with known answers.
 */
#include "friction_run.h"

#include "rational.h"

enum { LARGEST = 4, MOST = 700, LARGE = 40 };

static uint64_t seed;

static int draw(int low, int high)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (int)((seed >> 33) % (uint64_t)(high - low + 1));
}

/* A, C, b, d, tau integers; mu and mu_static quarters. */
typedef struct integers {
    int n, A[LARGEST * LARGEST], C[LARGEST * LARGEST], b[LARGEST], d[LARGEST], tau[LARGEST];
    int mu[LARGEST], mu_static[LARGEST], velocity[LARGEST];
} integers;

static void draw_system(integers *s, int n)
{
    int L[LARGEST * LARGEST], i, j, k;

    s->n = n;
    for (i = 0; i < n * n; i++) {
        L[i] = draw(-1, 1);
        s->C[i] = draw(-3, 3);
    }
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            for (s->A[n * i + j] = i == j, k = 0; k < n; k++)
                s->A[n * i + j] += L[n * i + k] * L[n * j + k];
        s->b[i] = draw(-3, 3);
        s->d[i] = draw(-3, 3);
        s->tau[i] = draw(-4, 4);
        s->mu[i] = draw(0, 4);
        s->mu_static[i] = s->mu[i] + draw(0, 1);
        s->velocity[i] = draw(-1, 1);
    }
}

typedef struct exact_answers {
    int count, singular;
    double x[MOST][LARGEST];
} exact_answers;

/* The pattern's point by Cramer's rule with a common denominator; kept if it is an answer. Modes: 0
 * slides, 1 and -1 starts, 2 sticks; sides: 1 or -1. */
static void try_exact(const integers *s, exact_answers *e, const int *mode, const int *side)
{
    int64_t K[LARGEST * LARGEST], rhs[LARGEST], x[LARGEST], det;
    int n = s->n, i, j, k;

    for (i = 0; i < n; i++) { /* rows times 4 */
        const int t = s->mu[i] * side[i] * (mode[i] == 0 ? s->velocity[i] : mode[i]);

        for (j = 0; j < n; j++)
            K[n * i + j] = mode[i] == 2 ? i == j : 4 * s->A[n * i + j] + t * s->C[n * i + j];
        rhs[i] = mode[i] == 2 ? 0 : 4 * (s->tau[i] - s->b[i]) - t * s->d[i];
    }
    det = rational_solve(n, K, rhs, x);
    if (det == 0) {
        e->singular = 1;
        return;
    }
    for (i = 0; i < n; i++) {
        int64_t normal = s->d[i] * det, friction = (s->tau[i] - s->b[i]) * det;

        for (j = 0; j < n; j++) {
            normal += s->C[n * i + j] * x[j];
            friction -= s->A[n * i + j] * x[j];
        }
        if (mode[i] == 2 ? 4 * llabs(friction) > s->mu_static[i] * llabs(normal)
                         : side[i] * normal < 0 || (mode[i] != 0 && mode[i] * x[i] <= 0))
            return;
    }
    for (k = 0; k < e->count; k++) {
        for (i = 0; i < n && e->x[k][i] == (double)x[i] / (double)det; i++)
            ;
        if (i == n)
            return;
    }
    assert_true(e->count < MOST);
    for (i = 0; i < n; i++)
        e->x[e->count][i] = (double)x[i] / (double)det;
    e->count++;
}

static void enumerate_exactly(const integers *s, exact_answers *e)
{
    static const int modes[] = {2, 1, 1, -1, -1}, sides[] = {0, 1, -1, 1, -1};
    int mode[LARGEST], side[LARGEST], code, total = 1, i;

    e->count = e->singular = 0;
    for (i = 0; i < s->n; i++)
        total *= s->velocity[i] ? 2 : 5;
    for (code = 0; code < total; code++) {
        int rest = code;

        for (i = 0; i < s->n; i++) {
            const int choices = s->velocity[i] ? 2 : 5, choice = rest % choices;

            rest /= choices;
            mode[i] = s->velocity[i] ? 0 : modes[choice];
            side[i] = s->velocity[i] ? 1 - 2 * choice : sides[choice];
        }
        try_exact(s, e, mode, side);
    }
}

static void to_doubles(int count, double *to, const int *from, double unit)
{
    int i;

    for (i = 0; i < count; i++)
        to[i] = from[i] * unit;
}

/* Whether some answer is x. Answers are quotients of small integers: 1e-12 is their conditions. */
static int has(asked *a, int n, const double *x)
{
    int32_t k;
    int i;

    for (k = 0; k < a->summary.count; k++) {
        const perp_load_found found = answer(a, k);

        for (i = 0; i < n; i++)
            if (!(fabs(found.acceleration[i] - x[i]) <= 1e-12 * (1 + fabs(x[i]))))
                break;
        if (i == n)
            return 1;
    }
    return 0;
}

static void test_against_integers(void **state)
{
    static exact_answers exact;
    int counts[10] = {0}, singular = 0, round, k;

    (void)state;
    seed = 11;
    for (round = 0; round < 1500; round++) {
        double A[16], C[16], b[4], d[4], tau[4], mu[4], mu_static[4], v[4];
        perp_load_uniqueness unique = fresh_load_uniqueness();
        const int n = 1 + round % LARGEST;
        integers s;
        asked a;

        draw_system(&s, n);
        enumerate_exactly(&s, &exact);
        if (exact.singular) { /* families: their own test */
            singular++;
            continue;
        }
        to_doubles(n * n, A, s.A, 1);
        to_doubles(n * n, C, s.C, 1);
        to_doubles(n, b, s.b, 1);
        to_doubles(n, d, s.d, 1);
        to_doubles(n, tau, s.tau, 1);
        to_doubles(n, mu, s.mu, 0.25);
        to_doubles(n, mu_static, s.mu_static, 0.25);
        to_doubles(n, v, s.velocity, 0.1);
        describe(&a, n, A, b, C, d, mu)->mu_static = mu_static;
        start(&a, NULL);
        if (ask(&a, tau, v) != exact.count)
            fail_msg("round %d: %d answers, expected %d", round, a.summary.count, exact.count);
        for (k = 0; k < exact.count; k++)
            assert_true(has(&a, n, exact.x[k]));
        assert_int_equal(perp_load_friction_uniqueness(a.friction, &unique, v), PERP_OK);
        if (unique.verdict == PERP_LOAD_UNIQUE)
            assert_int_equal(exact.count, 1);
        counts[exact.count < 9 ? exact.count : 9]++;
        finish(&a);
    }
    assert_true(counts[0] > 50 && counts[1] > 300 && counts[2] > 100 && counts[3] > 20);
    assert_true(counts[4] > 3 && singular < 300);
}

/* The margin: just below it unique, just above it not, for all torques by the determinants. */
static void test_margin(void **state)
{
    int round, k;

    (void)state;
    seed = 5;
    for (round = 0; round < 60; round++) {
        double A[16], C[16], b[4], d[4], mu[4];
        const int n = 1 + round % LARGEST;
        perp_load_uniqueness u = fresh_load_uniqueness();
        double margin;
        integers s;
        asked a;

        draw_system(&s, n);
        to_doubles(n * n, A, s.A, 1);
        to_doubles(n * n, C, s.C, 1);
        to_doubles(n, b, s.b, 1);
        to_doubles(n, d, s.d, 1);
        to_doubles(n, mu, s.mu, 0.25);
        describe(&a, n, A, b, C, d, mu);
        start(&a, NULL);
        assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
        margin = u.margin;
        assert_int_equal(u.verdict == PERP_LOAD_UNIQUE, margin > 1);
        if (isfinite(margin)) {
            assert_true(1 / u.norm <= margin * (1 + 1e-10));
            assert_true(1 / u.radius <= margin * (1 + 1e-10));
        }
        for (k = -1; k <= 1 && isfinite(margin); k += 2) {
            int i;

            for (i = 0; i < n; i++) /* 1e-6: determinants near a double root change by 1e-12 */
                mu[i] = s.mu[i] * 0.25 * margin * (1 + 1e-6 * k);
            assert_int_equal(perp_load_friction_set(a.friction, &a.system), PERP_OK);
            assert_int_equal(perp_load_friction_uniqueness(a.friction, &u, NULL), PERP_OK);
            assert_int_equal(u.verdict, k < 0 ? PERP_LOAD_UNIQUE : PERP_LOAD_NOT_UNIQUE);
        }
        finish(&a);
    }
}

/* n = 40 by a search: blocks of (j), coupled by nothing, so that every answer is a choice of -2 or
 * -2/5 in each; and, below the critical coefficient, the one answer of a full matrix. */
static void test_large(void **state)
{
    static double A[LARGE * LARGE], C[LARGE * LARGE], zero[LARGE], d[LARGE], mu[LARGE], v[LARGE];
    static double tau[LARGE];
    perp_load_uniqueness unique = fresh_load_uniqueness();
    perp_load_inverse inverse = fresh_load_inverse();
    int32_t i, j, k;
    double wanted[LARGE], torque[LARGE];
    asked a;

    (void)state;
    for (i = 0; i < LARGE; i++) {
        A[i * (LARGE + 1)] = 1;
        C[i * (LARGE + 1)] = 3;
        d[i] = 2;
        mu[i] = 0.5;
        v[i] = 1;
    }
    describe(&a, LARGE, A, zero, C, d, mu);
    start(&a, NULL);
    assert_true(ask(&a, zero, v) >= 2);
    assert_int_equal(a.summary.exhaustive, 0);
    for (k = 0; k < a.summary.count; k++)
        for (i = 0; i < LARGE; i++) {
            const double x = answer(&a, k).acceleration[i];

            assert_close(x, x < -1 ? -2 : -0.4, 4);
        }
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &unique, v), PERP_OK);
    assert_int_equal(unique.verdict, PERP_LOAD_NOT_UNIQUE); /* det(I - G) = (-1/2)^40 is not, but */
    finish(&a);

    seed = 9;
    for (i = 0; i < LARGE; i++)
        for (j = 0; j < LARGE; j++) {
            C[LARGE * i + j] = draw(-3, 3);
            A[LARGE * i + j] = i == j ? 12 : 1.0 / (1 + abs(i - j));
            mu[i] = 0.05;
            wanted[i] = draw(-9, 9);
            v[i] = i % 3 == 0 ? -1 : 1;
        }
    describe(&a, LARGE, A, zero, C, d, mu);
    start(&a, NULL);
    assert_int_equal(perp_load_friction_uniqueness(a.friction, &unique, v), PERP_OK);
    assert_int_equal(unique.verdict, PERP_LOAD_UNIQUE);
    assert_int_equal(unique.exact, 0);
    assert_int_equal(perp_load_friction_inverse(a.friction, torque, &inverse, v, wanted), PERP_OK);
    assert_int_equal(inverse.accelerations, 1);
    assert_int_equal(inverse.exhaustive, 1); /* proved by a norm */
    for (i = 0; i < LARGE; i++)              /* condition 10 */
        assert_close(answer(&a, 0).acceleration[i], wanted[i], 50);
    for (i = 0; i < LARGE; i += 2) /* and with every other coordinate at rest */
        v[i] = 0;
    memcpy(tau, torque, sizeof tau);
    assert_int_equal(ask(&a, tau, v), 1);
    finish(&a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_integers),
        cmocka_unit_test(test_margin),
        cmocka_unit_test(test_large),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
