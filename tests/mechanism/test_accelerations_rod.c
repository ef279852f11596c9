/* The rod of Painleve and Klein that slips on its tip: none, one, two accelerations, a half-line of
 * them; its regions and both critical coefficients of friction. q = (x, y, angle) of the centre,
 * the tip a half-length behind it; m = l = 1, I = 1/3. */
#include "found.h"

#define GRAVITY 9.81

typedef struct rod {
    table table;
    double q[3], v[3];
    int32_t with_curvature;
} rod;

static int32_t rod_contact(double *gap, double *H, double *drift, double *mu, double t,
                           const double *q, void *user)
{
    const rod *r = user;
    const double s = sin(q[2]), c = cos(q[2]);

    (void)drift;
    (void)t;
    gap[0] = q[1] - s;
    H[1] = 1.0;
    H[2] = -c;
    H[3] = 1.0;
    H[5] = s;
    mu[0] = r->table.mu[0];
    return 0;
}

static int32_t rod_mass(double *M, const double *q, void *user)
{
    (void)q;
    (void)user;
    M[0] = M[4] = 1.0;
    M[8] = 1.0 / 3.0;
    return 0;
}

static int32_t rod_force(double *k, double t, const double *q, const double *v, void *user)
{
    const rod *r = user;

    (void)t;
    (void)q;
    (void)v;
    k[1] = r->table.k[1];
    return 0;
}

static int32_t rod_curvature(double *bias, double t, const double *q, const double *v, void *user)
{
    (void)t;
    (void)user;
    bias[0] = sin(q[2]) * v[2] * v[2];
    bias[1] = cos(q[2]) * v[2] * v[2];
    return 0;
}

/* The handle; mu and the state may change afterwards. */
static void rod_open(rod *r, int32_t with_curvature)
{
    table *s = &r->table;

    table_make(s, 3, 1, 2);
    s->model.mass = rod_mass;
    s->model.force = rod_force;
    s->model.contact_rows = rod_contact;
    s->model.curvature = with_curvature ? rod_curvature : NULL;
    s->model.user = r;
    s->k[1] = -GRAVITY;
    table_open(s);
}

/* The tip slides with velocity -1 on the floor. Returns the number of answers. */
static int32_t rod_ask(rod *r, double angle, double omega, double mu)
{
    table *s = &r->table;

    s->mu[0] = mu;
    s->q[0] = cos(angle);
    s->q[1] = sin(angle);
    s->q[2] = angle;
    s->v[0] = -1.0 - sin(angle) * omega;
    s->v[1] = cos(angle) * omega;
    s->v[2] = omega;
    return table_ask(s);
}

static void check_modes(void **state, int32_t with_curvature)
{
    const double angle = atan(2.0), p = -0.8;
    const perp_mechanism_found *found;
    rod r;

    (void)state;
    rod_open(&r, with_curvature);
    /* b = omega^2 sin - g < 0, p < 0: none */
    assert_int_equal(rod_ask(&r, angle, 0.0, 2.0), 0);
    assert_int_equal(r.table.summary.reason, PERP_MECHANISM_NEGATIVE_INERTIA);
    assert_int_equal(r.table.summary.contact, 0);
    assert_int_equal(r.table.summary.exhaustive, 1);
    assert_int_equal(r.table.summary.closed, 1);
    assert_int_equal(r.table.summary.impact, 0);
    table_near(r.table.summary.inertia, p / 1.6, 1e-14, "inertia beside W_nn = 1.6");
    /* b > 0: two */
    assert_int_equal(rod_ask(&r, angle, 4.0, 2.0), 2);
    assert_int_equal(r.table.summary.stable, 1);
    found = table_get(&r.table, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SEPARATE);
    assert_int_equal(found->stable, 1);
    assert_true(found->force[0] == 0.0 && found->force[1] == 0.0);
    table_near(found->row_acceleration[0], 4.5008350559986541, 1e-13, "b");
    assert_int_equal(found->eigenvalue_count, 0);
    found = table_get(&r.table, 1);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
    assert_int_equal(found->stable, 0);
    assert_int_equal(found->flutter, 0);
    assert_int_equal(found->dimension, 0);
    assert_int_equal(found->at_vertex, 0);
    /* the bias by differences is good to 1e-12, and p divides it by 0.8 */
    table_near(found->force[0], 5.6260438199983176, 1e-12, "N");
    table_near(found->force[1], 2.0 * 5.6260438199983176, 1e-12, "F");
    assert_true(found->row_acceleration[0] == 0.0);
    table_near(found->acceleration[0], found->force[1], 1e-12, "x''");
    table_near(found->acceleration[1], found->force[0] - GRAVITY, 1e-12, "y''");
    assert_true(found->residual <= 1e-14);
    /* lambda^2 + gamma c lambda + gamma k = 0 with gamma = p, k = 1, c = 2 */
    assert_int_equal(found->eigenvalue_count, 2);
    table_near(fmax(found->eigenvalues[0], found->eigenvalues[2]), 0.8 + sqrt(0.64 + 0.8), 1e-13,
               "the growing root");
    table_near(fmin(found->eigenvalues[0], found->eigenvalues[2]), 0.8 - sqrt(0.64 + 0.8), 1e-13,
               "the other root");
    /* p > 0: one, pressing or not */
    assert_int_equal(rod_ask(&r, angle, 0.0, 1.0), 1);
    assert_int_equal(r.table.summary.reason, PERP_MECHANISM_ALWAYS_ONE);
    found = table_get(&r.table, 0);
    table_near(found->force[0], GRAVITY / (1.6 - 1.2), 1e-14, "N");
    assert_int_equal(found->stable, 1);
    assert_int_equal(rod_ask(&r, angle, 4.0, 1.0), 1);
    assert_int_equal(table_get(&r.table, 0)->modes[0], PERP_MECHANISM_SEPARATE);
    table_close(&r.table);
}

static void test_modes(void **state)
{
    check_modes(state, 0);
    check_modes(state, 1);
}

/* p = 0: mu = 4/3, where tan = 2. b < 0: none; b > 0: one; b = 0: every N >= 0. */
static void test_zero_inertia(void **state)
{
    const perp_mechanism_found *found;
    rod r;

    (void)state;
    rod_open(&r, 1);
    assert_int_equal(rod_ask(&r, atan(2.0), 0.0, 4.0 / 3.0), 0);
    assert_int_equal(r.table.summary.reason, PERP_MECHANISM_ZERO_INERTIA);
    table_near(r.table.summary.inertia, 0.0, 1e-15, "inertia");
    assert_int_equal(rod_ask(&r, atan(2.0), 4.0, 4.0 / 3.0), 1);
    r.table.k[1] = 0.0;
    assert_int_equal(rod_ask(&r, atan(2.0), 0.0, 4.0 / 3.0), 1);
    assert_int_equal(r.table.summary.families, 1);
    found = table_get(&r.table, 0);
    assert_int_equal(found->dimension, 1);
    assert_int_equal(found->free, 1);
    assert_int_equal(found->vertex_count, 1);
    assert_int_equal(found->ray_count, 1);
    assert_true(found->vertices[0] == 0.0 && found->vertices[1] == 0.0);
    table_near(found->rays[1] / found->rays[0], 4.0 / 3.0, 1e-14, "direction of the ray");
    assert_true(found->rays[0] > 0.0);
    assert_int_equal(found->stable, 0);
    table_close(&r.table);
}

/* Where b changes its sign N = 0 and N = -b / p meet. */
static void test_critical_speed(void **state)
{
    double low = 3.0, high = 4.0;
    rod r;

    (void)state;
    rod_open(&r, 0);
    while (high - low > 1e-14 * high && (low + high) / 2 > low && (low + high) / 2 < high) {
        const double middle = (low + high) / 2;

        if (rod_ask(&r, atan(2.0), middle, 2.0) == 0)
            low = middle;
        else
            high = middle;
    }
    /* answers within 1e-12 of a limit count, so the limit is met to 1e-12 or so */
    table_near(high, 3.3117840252100481, 1e-11, "critical speed");
    table_close(&r.table);
}

/* The angle where the count changes between `low` and `high`. */
static double edge(rod *r, double low, double high, double mu)
{
    const int32_t count = rod_ask(r, low, 0.0, mu);

    while ((low + high) / 2 > low && (low + high) / 2 < high) {
        const double middle = (low + high) / 2;

        if (rod_ask(r, middle, 0.0, mu) == count)
            low = middle;
        else
            high = middle;
    }
    return (low + high) / 2;
}

static void test_region(void **state)
{
    double first, last;
    rod r;

    (void)state;
    rod_open(&r, 0);
    first = edge(&r, 0.1, atan(2.0), 2.0);
    last = edge(&r, atan(2.0), 1.5, 2.0);
    table_near(tan(first), 3.0 - sqrt(5.0), 1e-9, "tan of the first angle");
    table_near(tan(last), 3.0 + sqrt(5.0), 1e-9, "tan of the last angle");
    table_near(first * 180.0 / acos(-1.0), 37.377368140649696, 1e-9, "first angle");
    table_near(last * 180.0 / acos(-1.0), 79.187683036428294, 1e-9, "last angle");
    table_close(&r.table);
}

/* The largest mu that has an acceleration at this angle, at rest in angle. */
static double largest_mu(rod *r, double angle)
{
    double low = 0.0, high = 100.0;

    while ((low + high) / 2 > low && (low + high) / 2 < high) {
        const double middle = (low + high) / 2;

        if (rod_ask(r, angle, 0.0, middle) == 1)
            low = middle;
        else
            high = middle;
    }
    return (low + high) / 2;
}

/* The effective inverse inertia p and its derivative by the angle (p is a trigonometric polynomial:
 * differences extrapolated once more leave 1e-11). */
static double inertia(rod *r, double angle, double mu)
{
    rod_ask(r, angle, 0.0, mu);
    return r->table.summary.inertia * (1.0 + 3.0 * cos(angle) * cos(angle));
}

static double slope(rod *r, double angle, double mu)
{
    double d[4], h = 0.02;
    int32_t k, j;

    for (k = 0; k < 4; k++, h /= 2)
        d[k] = (inertia(r, angle + h, mu) - inertia(r, angle - h, mu)) / (2 * h);
    for (j = 1; j < 4; j++)
        for (k = 3; k >= j; k--)
            d[k] += (d[k] - d[k - 1]) / (pow(4.0, j) - 1);
    return d[3];
}

/* The smallest mu with which there is an angle without an acceleration: there p has a double root.
 */
static void test_first_critical_friction(void **state)
{
    double low = 0.8, high = 1.4;
    rod r;

    (void)state;
    rod_open(&r, 0);
    while ((low + high) / 2 > low && (low + high) / 2 < high) {
        const double middle = (low + high) / 2;

        if (slope(&r, middle, largest_mu(&r, middle)) < 0.0)
            low = middle;
        else
            high = middle;
        if (high - low < 1e-12)
            break;
    }
    table_near(largest_mu(&r, low), 4.0 / 3.0, 1e-9, "critical coefficient");
    table_near(low * 180.0 / acos(-1.0), 63.434948822922, 1e-9, "its angle");
    table_close(&r.table);
}

/* Genot & Brogliato's second critical coefficient. In the time of p, sliding motion is
 *
 *   angle' = omega p,   omega' = -A b,   b = omega^2 sin - g,   A = (mu sin - cos) l / I,
 *
 * with a singular point p = b = 0 whose eigenvalues omega p_angle and -2 A omega sin coincide at
 * that mu. A is the angular acceleration per unit of N. */
static double difference_of_eigenvalues(rod *r, double mu)
{
    const double angle = edge(r, 0.1, atan(2.0), mu);
    const perp_mechanism_found *found;

    assert_int_equal(rod_ask(r, angle - 0.01, 0.0, mu), 1); /* p > 0, b < 0: pressing */
    found = table_get(&r->table, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
    /* theta'' = 3 (F sin - N cos): the ratio at that angle, from the forces of the answer */
    table_near(found->acceleration[2] / found->force[0],
               3 * (mu * sin(angle - 0.01) - cos(angle - 0.01)), 1e-9, "A");
    return slope(r, angle, mu) + 2 * sin(angle) * 3 * (mu * sin(angle) - cos(angle));
}

static void test_second_critical_friction(void **state)
{
    double low = 1.4, high = 1.7;
    rod r;

    (void)state;
    rod_open(&r, 0);
    assert_true(difference_of_eigenvalues(&r, low) * difference_of_eigenvalues(&r, high) < 0.0);
    while (high - low > 1e-12) {
        const double middle = (low + high) / 2;

        if (difference_of_eigenvalues(&r, middle) * difference_of_eigenvalues(&r, low) > 0.0)
            low = middle;
        else
            high = middle;
    }
    table_near(low, 1.539600717839002, 1e-9, "second critical coefficient");
    table_close(&r.table);
}

/* Of the motions into p = b = 0 one in each plane arrives with a load that has a limit, along the
 * eigenvector of k = omega p_angle: N = -b/p = b_angle omega / (l - k), l = -2 A omega sin the
 * other eigenvalue. 4.3615 at mu = 2; infinite where they coincide. */
static void test_limit_of_load(void **state)
{
    static const double mus[] = {1.7, 2.0, 3.0};
    int m;

    (void)state;
    for (m = 0; m < 3; m++) {
        const double three = 3 * mus[m], angle = atan((three - sqrt(three * three - 16)) / 2);
        const double s = sin(angle), c = cos(angle);
        const double omega = sqrt(GRAVITY / s), A = 3 * (mus[m] * s - c);
        const double k = omega * 3 * (-2 * c * s - mus[m] * (c * c - s * s)),
                     l = -2 * A * omega * s;
        const double lift = omega * omega * c; /* b_angle */
        const double limit = lift * omega / (l - k), away = 1e-6;
        const double spin = omega - away * -A * lift / (k - l);
        rod r;

        rod_open(&r, 0);
        assert_int_equal(rod_ask(&r, angle - away, spin, mus[m]), 1);
        /* the next terms are of the order of `away` */
        table_near(table_get(&r.table, 0)->force[0], limit, 1e-3 * limit, "limit of the load");
        if (m == 1)
            table_near(limit, 4.3615, 5e-5, "at mu = 2"); /* by the digits it was told with */
        table_close(&r.table);
    }
}

/* A tip that approaches the floor hits it: there is no acceleration to speak of. */
static void test_impact(void **state)
{
    rod r;

    (void)state;
    rod_open(&r, 0);
    rod_ask(&r, 1.0, 0.0, 2.0);
    r.table.v[1] -= 1e-9;
    assert_int_equal(table_ask(&r.table), 0);
    assert_int_equal(r.table.summary.impact, 1);
    assert_int_equal(r.table.summary.contact, 0);
    r.table.v[1] += 2e-9; /* it leaves: free flight */
    assert_int_equal(table_ask(&r.table), 1);
    assert_int_equal(r.table.summary.impact, 0);
    assert_int_equal(r.table.summary.closed, 0);
    assert_true(table_get(&r.table, 0)->acceleration[1] == -GRAVITY);
    table_close(&r.table);
}

/* Where there is one acceleration, motion follows it: over a short time T, in steps of T^2, the
 * mean acceleration (v(T) - v) / T differs by a multiple of T. */
static void check_motion(int32_t scheme, double omega)
{
    double last = 0.0, T;

    for (T = 1e-1; T > 1e-3; T /= 8) {
        double v[3], q[3], difference = 0.0;
        perp_mechanism_run_result result = fresh_mechanism_run_result();
        rod r;
        int i;

        rod_open(&r, 0);
        r.table.settings.scheme = scheme;
        assert_int_equal(perp_mechanism_set(r.table.mechanism, &r.table.settings), PERP_OK);
        assert_int_equal(rod_ask(&r, 1.0, omega, 0.5), 1);
        assert_int_equal(table_get(&r.table, 0)->modes[0], PERP_MECHANISM_SLIP);
        assert_int_equal(perp_mechanism_run(r.table.mechanism, q, v, &result,
                                            START(0.0, T * T, r.table.q, r.table.v), T, NULL, NULL),
                         PERP_OK);
        table_get(&r.table, 0); /* steps don't touch the answers */
        for (i = 0; i < 3; i++)
            difference =
                fmax(difference, fabs((v[i] - r.table.v[i]) / T - r.table.found.acceleration[i]));
        if (last > 0.0) /* first order: 8, with a tenth for the second at T = 0.1 */
            assert_true(last / difference > 6.0 && last / difference < 10.0);
        last = difference;
        table_close(&r.table);
    }
    assert_true(last < 0.1); /* of accelerations near 10 */
}

static void test_motion(void **state)
{
    (void)state;
    check_motion(PERP_MECHANISM_FROZEN, 1.0);
    check_motion(PERP_MECHANISM_IMPLICIT, -2.0);
    check_motion(PERP_MECHANISM_THETA, 1.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_modes),
        cmocka_unit_test(test_zero_inertia),
        cmocka_unit_test(test_critical_speed),
        cmocka_unit_test(test_region),
        cmocka_unit_test(test_first_critical_friction),
        cmocka_unit_test(test_second_critical_friction),
        cmocka_unit_test(test_limit_of_load),
        cmocka_unit_test(test_impact),
        cmocka_unit_test(test_motion),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
