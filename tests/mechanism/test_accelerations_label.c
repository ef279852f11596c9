/* Which answer is stable: contacts that give a little, against the roots of the whole compliant
 * system M x'' = -C_a (k J_a x + c J_a x'). */
#include "found.h"

/* Two contacts that slide so that each one's friction lifts or presses the other: Gamma = [[1, mu],
 * [-mu, 1]], eigenvalues 1 +- i mu. */
static void make_pair(table *s, double mu, double damping)
{
    static const double rows[4][2] = {{1, 0}, {0, 1}, {0, 1}, {1, 0}};
    int i;

    table_make(s, 2, 2, 2);
    for (i = 0; i < 4; i++)
        table_row(s->H, 2, i, rows[i]);
    s->mu[0] = s->mu[1] = mu;
    s->drift[1] = 1.0;
    s->drift[3] = -1.0;
    s->k[0] = -(1.0 + mu); /* N = (1, 1) */
    s->k[1] = -(1.0 - mu);
    s->settings.damping = damping;
}

static void check_roots(const perp_mechanism_found *found, double mu, double c)
{
    int32_t i;

    assert_int_equal(found->eigenvalue_count, 4);
    for (i = 0; i < 4; i++) { /* l^2 + gamma (c l + 1) = 0 for one of the two gammas */
        const double re = found->eigenvalues[2 * i], im = found->eigenvalues[2 * i + 1];
        double least = INFINITY, sign;

        for (sign = -1.0; sign < 2.0; sign += 2.0) {
            const double x = c * re + 1.0, y = c * im, g = sign * mu;

            least = fmin(least, hypot(re * re - im * im + x - g * y, 2 * re * im + y + g * x));
        }
        assert_true(least <= 1e-13 * (1.0 + re * re + im * im) * (1.0 + mu));
    }
}

static void test_flutter(void **state)
{
    static const double dampings[] = {0.5, 0.88, 0.91, 2.0, 0.0};
    const double mu = 2.0; /* stable for c^2 (1 + mu^2) > mu^2: c > 0.894 */
    size_t k;

    (void)state;
    for (k = 0; k < 5; k++) {
        const double c = dampings[k];
        const perp_mechanism_found *found;
        int32_t i, largest;
        table s;

        make_pair(&s, mu, c);
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        assert_int_equal(s.summary.reason, PERP_MECHANISM_ALWAYS_ONE);
        found = table_get(&s, 0);
        table_near(found->force[0], 1.0, 1e-15, "N");
        table_near(found->force[2], 1.0, 1e-15, "N");
        check_roots(found, mu, c);
        for (i = 0, largest = 0; i < 4; i++)
            largest |= found->eigenvalues[2 * i] > 0.0;
        assert_int_equal(found->stable, c * c * (1.0 + mu * mu) > mu * mu);
        assert_int_equal(found->stable, !largest);
        /* without damping nothing settles, and that is not called flutter */
        assert_int_equal(found->flutter, !found->stable && c > 0.0);
        assert_int_equal(s.summary.stable, found->stable);
        table_close(&s);
    }
}

/* The stiffness of the settings: roots scale with its square root. */
static void test_settings(void **state)
{
    table s;

    (void)state;
    make_pair(&s, 2.0, 2.0);
    s.settings.stiffness = 100.0; /* c^2 5 = 20 < 4 k */
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(table_get(&s, 0)->stable, 0);
    assert_int_equal(s.found.flutter, 1);
    s.settings.stiffness = 4.9; /* 20 > 19.6 */
    assert_int_equal(perp_mechanism_set(s.mechanism, &s.settings), PERP_OK);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(table_get(&s, 0)->stable, 1);
    table_close(&s);
}

/* ---- redundant contacts --------------------------------------------------------------------- */

typedef struct complex_number {
    double re, im;
} complex_number;

/* |det| of a 3 by 3 matrix of complex numbers by its permutations. */
static double determinant(complex_number m[3][3])
{
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                    {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    complex_number sum = {0, 0};
    int k, i;

    for (k = 0; k < 6; k++) {
        complex_number p = {k < 3 ? 1.0 : -1.0, 0.0};

        for (i = 0; i < 3; i++) {
            const complex_number e = m[i][order[k][i]], old = p;

            p.re = old.re * e.re - old.im * e.im;
            p.im = old.re * e.im + old.im * e.re;
        }
        sum.re += p.re;
        sum.im += p.im;
    }
    return hypot(sum.re, sum.im);
}

/* A body of three velocities on three contacts, M = I: l is a root if l^2 I + C_a J_a (c l + k) is
 * singular. All stick, or slide, or press without friction; six displacements at most, rank 3. */
static void test_redundant(void **state)
{
    static const double rows[6][3] = {{0, 1, -2}, {1, 0, 1}, {0, 1, 0.3},
                                      {1, 0, 1},  {0, 1, 2}, {1, 0, 1}};
    int kind;

    (void)state;
    for (kind = 0; kind < 3; kind++) {
        const perp_mechanism_found *found;
        double A[3][3] = {{0}};
        int32_t i, j, k, e;
        table s;

        table_make(&s, 3, 3, 2);
        for (i = 0; i < 6; i++)
            table_row(s.H, 3, i, rows[i]);
        for (j = 0; j < 3; j++) {
            s.mu[j] = kind == 2 ? 0.0 : 0.4;
            s.drift[2 * j + 1] = kind == 1 ? 1.0 : 0.0;
        }
        s.k[1] = -2.0;
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        found = table_get(&s, 0);
        assert_true(found->dimension > 0);
        assert_int_equal(found->free, 0);
        assert_int_equal(found->stable, 1);
        /* kind 0: x, y and angle; else y and angle */
        assert_int_equal(found->eigenvalue_count, kind == 0 ? 6 : 4);
        for (k = 0; k < 6; k++) /* C_a J_a */
            for (i = 0; i < 3 && (k % 2 == 0 || kind == 0); i++)
                for (j = 0; j < 3; j++)
                    A[i][j] += (rows[k][i] - (kind == 1 ? 0.4 * rows[k + 1][i] : 0.0)) * rows[k][j];
        for (e = 0; e < found->eigenvalue_count; e++) {
            const double re = found->eigenvalues[2 * e], im = found->eigenvalues[2 * e + 1];
            complex_number m[3][3];
            double size = 1.0;

            for (i = 0; i < 3; i++) {
                size *= (re * re + im * im) + (1.0 + 2.0 * hypot(re, im)) *
                                                  (fabs(A[i][0]) + fabs(A[i][1]) + fabs(A[i][2]));
                for (j = 0; j < 3; j++) {
                    m[i][j].re = A[i][j] * (2.0 * re + 1.0) + (i == j ? re * re - im * im : 0.0);
                    m[i][j].im = A[i][j] * 2.0 * im + (i == j ? 2.0 * re * im : 0.0);
                }
            }
            assert_true(hypot(re, im) > 0.0);
            assert_true(determinant(m) <= 1e-12 * size);
        }
        table_close(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flutter),
        cmocka_unit_test(test_settings),
        cmocka_unit_test(test_redundant),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
