/* Large mechanisms: a table with a thousand legs, a row of a hundred bodies. */
#include "tabled.h"

#define GRAVITY 9.81

/* ---- a table -------------------------------------------------------------------------------- */

enum { LEGS = 1000 };

/* theory.md (i): legs around the unit circle, a weight of 100 at (0.3, 0.1). Velocities: up, and
 * turning about two axes. */
static int32_t legs(double *gap, double *H, double *drift, double *mu, double t, const double *q,
                    void *user)
{
    int32_t j;

    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    for (j = 0; j < LEGS; j++) {
        const double angle = 2.0 * 3.14159265358979323846 * j / LEGS;

        H[3 * j] = 1.0;
        H[3 * j + 1] = cos(angle);
        H[3 * j + 2] = sin(angle);
        gap[j] = q[0] + H[3 * j + 1] * q[1] + H[3 * j + 2] * q[2];
    }
    return 0;
}

static int32_t weight(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)q;
    (void)v;
    (void)user;
    k[0] = -100.0;
    k[1] = -30.0;
    k[2] = -10.0;
    return 0;
}

static void test_table(void **state)
{
    static double impulse[LEGS], velocity[LEGS];
    static int32_t modes[LEGS];
    double wrench[3] = {0.0, 0.0, 0.0};
    int32_t j, k;
    tabled r;

    (void)state;
    tabled_make(&r, 3, LEGS, 1);
    r.model.mu = r.model.restitution = NULL;
    r.model.mass = NULL;
    r.model.force = weight;
    r.model.contact_rows = legs;
    tabled_open(&r);
    for (k = 0; k < 3; k++) {
        assert_int_equal(perp_mechanism_advance(r.mechanism, r.q, r.v, impulse, velocity, modes,
                                                NULL, &r.step, START(0.0, 0.5, r.q, r.v)),
                         PERP_OK);
        assert_int_equal(r.step.outcome, PERP_OUTCOME_SOLVED);
        for (j = 0; j < 3; j++)
            tabled_zero(r.v[j], "v");
    }
    for (j = 0; j < LEGS; j++) {
        const double angle = 2.0 * 3.14159265358979323846 * j / LEGS;

        assert_true(impulse[j] >= 0.0);
        tabled_zero(velocity[j], "u");
        wrench[0] += impulse[j];
        wrench[1] += impulse[j] * cos(angle);
        wrench[2] += impulse[j] * sin(angle);
    }
    /* any share among the legs will do; tol = 1e-10, times the legs that add up */
    tabled_near(wrench[0], 50.0, 1e-9, "weight");
    tabled_near(wrench[1], 15.0, 1e-9, "moment");
    tabled_near(wrench[2], 5.0, 1e-9, "moment");
    tabled_close(&r);
}

/* ---- a row of bodies ------------------------------------------------------------------------ */

enum { BODIES = 100, ROW_N = 3 * BODIES, ROW_CONTACTS = 3 * BODIES };

/* Squares on the floor, each on two corners and beside the next; the last one beside a wall. */
static int32_t row_mass(double *M, const double *q, void *user)
{
    int32_t i;

    (void)q;
    (void)user;
    for (i = 0; i < ROW_N; i++)
        M[i * ROW_N + i] = i % 3 == 2 ? 0.25 : 1.0 + 0.01 * (i / 3);
    return 0;
}

static int32_t row_force(double *k, double t, const double *q, const double *v, void *user)
{
    int32_t i;

    (void)t;
    (void)q;
    (void)v;
    for (i = 0; i < BODIES; i++)
        k[3 * i + 1] = -GRAVITY * (1.0 + 0.01 * i);
    k[0] = *(const double *)user;
    return 0;
}

static int32_t row_contacts(double *gap, double *H, double *drift, double *mu, double t,
                            const double *q, void *user)
{
    double *row = H;
    int32_t i, side;

    (void)drift;
    (void)mu;
    (void)t;
    (void)user;
    for (i = 0; i < BODIES; i++)
        for (side = 0; side < 2; side++, row += 2 * ROW_N) {
            const double c = cos(q[3 * i + 2]), s = sin(q[3 * i + 2]), x = side ? 0.5 : -0.5;
            const double along = c * x + s * 0.5, up = s * x - c * 0.5;

            *gap++ = q[3 * i + 1] + up;
            row[3 * i + 1] = 1.0;
            row[3 * i + 2] = along;
            row[ROW_N + 3 * i] = 1.0;
            row[ROW_N + 3 * i + 2] = -up;
        }
    for (i = 0; i < BODIES; i++, row += 2 * ROW_N) {
        row[3 * i] = -1.0;
        row[ROW_N + 3 * i + 1] = -1.0;
        if (i + 1 < BODIES) {
            row[3 * i + 3] = row[ROW_N + 3 * i + 4] = 1.0;
            *gap++ = q[3 * i + 3] - q[3 * i] - 1.0;
        } else
            *gap++ = BODIES - 1.0 - q[3 * i];
    }
    return 0;
}

/* Pushed against the wall with more than friction holds: everything stays at rest, exactly, and the
 * floor carries the weight. */
static void test_row(void **state)
{
    static double q[ROW_N], v[ROW_N], impulse[2 * ROW_CONTACTS], mu[ROW_CONTACTS];
    double push = 2000.0, up = 0.0, weight_of_all = 0.0, h = 0.0625;
    int32_t i, k;
    tabled r;

    (void)state;
    tabled_make(&r, 1, ROW_CONTACTS, 2);
    r.model.velocities = ROW_N;
    r.model.mass = row_mass;
    r.model.force = row_force;
    r.model.contact_rows = row_contacts;
    r.model.restitution = NULL;
    r.model.mu = mu;
    r.model.user = &push;
    for (i = 0; i < BODIES; i++) {
        q[3 * i] = i;
        q[3 * i + 1] = 0.5;
        mu[2 * i] = mu[2 * i + 1] = 0.3; /* the floor's; bodies beside each other are smooth */
        weight_of_all += GRAVITY * (1.0 + 0.01 * i);
    }
    tabled_open(&r);
    for (k = 0; k < 2; k++) {
        assert_int_equal(perp_mechanism_advance(r.mechanism, q, v, impulse, NULL, NULL, NULL,
                                                &r.step, START(0.0, h, q, v)),
                         PERP_OK);
        assert_int_equal(r.step.outcome, PERP_OUTCOME_SOLVED);
        for (i = 0; i < ROW_N; i++)
            tabled_zero(v[i], "v");
    }
    for (i = 0; i < 2 * BODIES; i++) {
        up += impulse[2 * i];
        assert_true(fabs(impulse[2 * i + 1]) <= 0.3 * impulse[2 * i] * (1.0 + 1e-14));
    }
    tabled_near(up, h * weight_of_all, 1e-8, "weight"); /* tol = 1e-10, times a hundred bodies */
    tabled_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_row),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
