/* Frozen steps: the wedge, whose answer is not the only one; the same bits again, and in other
 * units. */
#include "tabled.h"

#define DEGREE (3.14159265358979323846 / 180.0)

/* ---- more than one answer -------------------------------------------------------------------- */

/* theory.md (h): a mass in a groove with faces at 10 degrees. Pulled out it may jam or come. */
static void test_wedge(void **state)
{
    const double s = sin(10.0 * DEGREE), c = cos(10.0 * DEGREE);
    const double H[] = {c, s, -s, c, -c, s, s, c};
    int32_t pull, j;

    (void)state;
    for (pull = 0; pull < 2; pull++) {
        double left, right;
        tabled r;

        tabled_make(&r, 2, 2, 2);
        memcpy(r.H, H, sizeof H);
        r.mu[0] = r.mu[1] = 0.3;
        r.v[1] = pull ? 1.0 : -1.0;
        tabled_open(&r);
        assert_int_equal(tabled_advance(&r, 0.01), PERP_OUTCOME_SOLVED);
        assert_true(r.step.residual <= 1e-10);
        if (pull && r.v[1] != 0.0) { /* the other answer */
            tabled_near(r.v[1], 1.0, 1e-15, "v");
            assert_int_equal(r.step.closed, 0);
        } else {
            tabled_zero(r.v[0], "v[0]");
            tabled_zero(r.v[1], "v[1]");
        }
        for (j = 0; j < 2; j++) {
            assert_true(r.impulse[2 * j] >= 0.0);
            assert_true(fabs(r.impulse[2 * j + 1]) <= 0.3 * r.impulse[2 * j] * (1.0 + 1e-14));
        }
        /* momentum: M (v+ - v) = H'r */
        left = c * r.impulse[0] - s * r.impulse[1] - c * r.impulse[2] + s * r.impulse[3];
        right = s * r.impulse[0] + c * r.impulse[1] + s * r.impulse[2] + c * r.impulse[3];
        tabled_near(left, r.v[0], 1e-14, "momentum across");
        tabled_near(right, r.v[1] - (pull ? 1.0 : -1.0), 1e-14, "momentum along");
        tabled_close(&r);
    }
}

/* The same bits again, from the same handle and from another. */
static void test_determinism(void **state)
{
    double q[TABLED_N], v[TABLED_N], impulse[TABLED_ROWS];
    int32_t k, i;
    tabled r;

    (void)state;
    for (k = 0; k < 2; k++) {
        tabled_make_everything(&r);
        tabled_open(&r);
        for (i = 0; i < 40; i++)
            assert_int_equal(tabled_advance(&r, 0.01 * (1 + i % 3)), PERP_OUTCOME_SOLVED);
        if (k == 1) {
            assert_memory_equal(q, r.q, sizeof q);
            assert_memory_equal(v, r.v, sizeof v);
            assert_memory_equal(impulse, r.impulse, sizeof impulse);
        }
        memcpy(q, r.q, sizeof q);
        memcpy(v, r.v, sizeof v);
        memcpy(impulse, r.impulse, sizeof impulse);
        tabled_close(&r);
    }
}

/* Masses and forces in other units by a power of two: the same bits, impacts included. */
static void test_units(void **state)
{
    static const int32_t powers[] = {-300, -40, 40, 300};
    int32_t k, i, law;

    (void)state;
    for (law = PERP_MECHANISM_MOREAU; law <= PERP_MECHANISM_POISSON; law++)
        for (k = 0; k < 4; k++) {
            const double unit = ldexp(1.0, powers[k]);
            tabled r, other;

            tabled_make_everything(&r);
            r.restitution[0] = 0.5;
            r.settings.law = law;
            r.v[2] = -1.0;
            tabled_make_everything(&other);
            other.restitution[0] = 0.5;
            other.settings.law = law;
            other.v[2] = -1.0;
            for (i = 0; i < 25; i++)
                other.M[i] *= unit;
            for (i = 0; i < 5; i++)
                other.k[i] *= unit;
            other.bound[0] *= unit;
            tabled_open(&r);
            tabled_open(&other);
            for (i = 0; i < 20; i++) {
                assert_int_equal(tabled_advance(&r, 0.05), PERP_OUTCOME_SOLVED);
                assert_int_equal(tabled_advance(&other, 0.05), PERP_OUTCOME_SOLVED);
                assert_memory_equal(r.v, other.v, sizeof r.v);
                assert_memory_equal(r.q, other.q, sizeof r.q);
            }
            tabled_close(&r);
            tabled_close(&other);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wedge),
        cmocka_unit_test(test_determinism),
        cmocka_unit_test(test_units),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
