/* All accelerations of small machines against closed forms. */
#include "found.h"

#define GRAVITY 9.81

static const double normal[] = {0, 1}, tangent[] = {1, 0};

/* A point of mass 1 on the floor, force (push, -weight). */
static void make_block(table *s, double push, double weight, double mu)
{
    table_make(s, 2, 1, 2);
    table_row(s->H, 2, 0, normal);
    table_row(s->H, 2, 1, tangent);
    s->k[0] = push;
    s->k[1] = -weight;
    s->mu[0] = mu;
}

static void test_stick_and_slip(void **state)
{
    const perp_mechanism_found *found;
    table s;

    (void)state;
    make_block(&s, 0.5 - 1e-9, 1.0, 0.5); /* below the threshold */
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_ALWAYS_ONE);
    assert_true(s.summary.inertia == 1.0);
    assert_int_equal(s.summary.patterns, 4);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_STICK);
    assert_int_equal(found->at_vertex, 0);
    assert_int_equal(found->stable, 1);
    assert_int_equal(found->eigenvalue_count, 4);
    assert_true(found->acceleration[0] == 0.0 && found->acceleration[1] == 0.0);
    assert_true(found->force[0] == 1.0 && found->force[1] == -(0.5 - 1e-9));
    s.k[0] = 0.5; /* at it */
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_STICK);
    assert_int_equal(found->at_vertex, 1);
    assert_true(found->acceleration[0] == 0.0);
    s.k[0] = -0.5 - 1e-9; /* above */
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
    assert_int_equal(found->at_vertex, 0);
    /* 1e-9 is what is left of 0.5: 7 digits are */
    table_near(found->acceleration[0] / -1e-9, 1.0, 1e-6, "acceleration");
    assert_true(found->acceleration[1] == 0.0 && found->force[1] == 0.5);
    s.k[1] = 1.0; /* pulled up */
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SEPARATE);
    assert_true(found->acceleration[1] == 1.0 && found->force[0] == 0.0);
    s.k[1] = 0.0; /* without weight: touches, and nothing presses */
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->at_vertex, 1);
    assert_true(found->force[0] == 0.0);
    table_close(&s);
}

/* mu tan: a slope of exactly the angle of friction, with rounding in both. */
static void test_slope(void **state)
{
    double angle;

    (void)state;
    for (angle = 0.05; angle < 1.5; angle += 0.05) {
        table s;

        make_block(&s, 3.0 * GRAVITY * sin(angle), 3.0 * GRAVITY * cos(angle), tan(angle));
        s.M[0] = s.M[3] = 3.0;
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        assert_int_equal(table_get(&s, 0)->modes[0], PERP_MECHANISM_STICK);
        assert_int_equal(s.found.at_vertex, 1);
        assert_true(s.found.acceleration[0] == 0.0 && s.found.acceleration[1] == 0.0);
        table_near(s.found.force[0], 3.0 * GRAVITY * cos(angle), 1e-14, "N");
        table_close(&s);
    }
}

/* Between the two coefficients a block can rest or go on, by the letter of the law. */
static void test_static_friction(void **state)
{
    table s;

    (void)state;
    make_block(&s, 0.55, 1.0, 0.5);
    s.mu_static[0] = 0.6;
    s.model.mu_static = s.mu_static;
    table_open(&s);
    assert_int_equal(table_ask(&s), 2);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_STATIC_FRICTION);
    assert_int_equal(s.summary.contact, 0);
    table_near(table_get(&s, 0)->acceleration[0], 0.0, 0.0, "rest");
    assert_int_equal(s.found.modes[0], PERP_MECHANISM_STICK);
    table_near(table_get(&s, 1)->acceleration[0], 0.05, 1e-15, "slip");
    s.v[0] = 1.0; /* in motion: one */
    assert_int_equal(table_ask(&s), 1);
    table_near(table_get(&s, 0)->acceleration[0], 0.05, 1e-15, "motion");
    s.v[0] = -1.0;
    assert_int_equal(table_ask(&s), 1);
    table_near(table_get(&s, 0)->acceleration[0], 1.05, 1e-15, "motion");
    assert_int_equal(s.summary.patterns, 2);
    table_close(&s);
    make_block(&s, 0.55, 1.0, 0.5); /* with Stribeck's curve a slow slip has the static one */
    s.mu_static[0] = 0.6;
    s.model.mu_static = s.mu_static;
    s.stribeck[0] = 1.0;
    s.model.stribeck = s.stribeck;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    s.v[0] = 1.0;
    assert_int_equal(table_ask(&s), 1);
    table_near(table_get(&s, 0)->acceleration[0], 0.05 - 0.1 * exp(-1.0), 1e-15, "Stribeck");
    table_close(&s);
}

/* ---- a box of mass 2 and inertia 3 on two corners, at (-2,-1) and (2,-1) of its centre --------
 */

static void make_box(table *s, double push, double mu)
{
    static const double rows[4][3] = {{0, 1, -2}, {1, 0, 1}, {0, 1, 2}, {1, 0, 1}};
    int i;

    table_make(s, 3, 2, 2);
    s->M[0] = s->M[4] = 2.0;
    s->M[8] = 3.0;
    for (i = 0; i < 4; i++)
        table_row(s->H, 3, i, rows[i]);
    s->k[0] = push;
    s->k[1] = -2.0 * GRAVITY;
    s->mu[0] = s->mu[1] = mu;
}

static void test_box(void **state)
{
    const double weight = 2.0 * GRAVITY;
    const perp_mechanism_found *found;
    table s;

    (void)state;
    make_box(&s, 0.4 * weight, 0.5); /* rests: one force along the floor is free */
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(s.summary.families, 1);
    assert_int_equal(s.summary.stable, 1);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_REDUNDANT);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 1);
    assert_int_equal(found->free, 0);
    assert_int_equal(found->vertex_count, 2);
    assert_int_equal(found->ray_count, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_STICK);
    assert_int_equal(found->modes[1], PERP_MECHANISM_STICK);
    assert_true(found->acceleration[0] == 0.0 && found->acceleration[2] == 0.0);
    assert_int_equal(found->eigenvalue_count, 6); /* three displacements, not four */
    /* 2 (N2 - N1) + F = 0 with F = -0.4 weight */
    table_near(found->force[0], 0.4 * weight, 1e-13, "left");
    table_near(found->force[2], 0.6 * weight, 1e-13, "right");
    /* the left friction from -0.5 N1 to -0.4 weight + 0.5 N2 = -0.1 weight */
    table_near(fmin(found->vertices[1], found->vertices[5]), -0.2 * weight, 1e-9, "from");
    table_near(fmax(found->vertices[1], found->vertices[5]), -0.1 * weight, 1e-9, "to");
    table_close(&s);
    make_box(&s, 0.6 * weight, 0.5); /* starts to slide: F = -0.5 weight */
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
    table_near(found->acceleration[0], 0.1 * GRAVITY, 1e-14, "acceleration");
    assert_true(found->acceleration[1] == 0.0 && found->acceleration[2] == 0.0);
    table_near(found->force[0], 0.375 * weight, 1e-14, "left");
    table_near(found->force[2], 0.625 * weight, 1e-14, "right");
    s.v[0] = -1.0; /* slides the other way */
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    table_near(found->acceleration[0], 1.1 * GRAVITY, 1e-14, "acceleration");
    table_near(found->force[0], 0.625 * weight, 1e-14, "left");
    table_close(&s);
    make_box(&s, 2.5 * weight, 3.0); /* tips over its right corner, which sticks */
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SEPARATE);
    assert_int_equal(found->modes[1], PERP_MECHANISM_STICK);
    /* about the corner, inertia 3 + 2 (4 + 1): the push of 2.5 at height 1 against weight at 2 */
    table_near(found->acceleration[2], -0.5 * weight / 13.0, 1e-14, "angular");
    table_near(found->row_acceleration[0], 4 * 0.5 * weight / 13.0, 1e-14, "left corner rises");
    assert_true(found->row_acceleration[2] == 0.0 && found->row_acceleration[3] == 0.0);
    table_close(&s);
}

/* ---- forces that share ---------------------------------------------------------------------- */

static void test_table(void **state)
{
    static const double places[4][2] = {{1, .5}, {-1, .5}, {-1, -.5}, {1, -.5}};
    static const double least[] = {37.5, 22.5, 12.5, 27.5};
    const perp_mechanism_found *found;
    int i, k;
    table s;

    (void)state;
    table_make(&s, 3, 4, 1);
    for (i = 0; i < 4; i++) {
        const double row[] = {1, places[i][1], -places[i][0]};

        table_row(s.H, 3, i, row);
    }
    s.k[0] = -100.0;
    s.k[1] = -10.0;
    s.k[2] = 30.0;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(s.summary.reason, PERP_MECHANISM_REDUNDANT);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 1);
    assert_int_equal(found->free, 0);
    assert_int_equal(found->vertex_count, 2);
    assert_int_equal(found->ray_count, 0);
    assert_int_equal(found->at_vertex, 0);
    assert_int_equal(found->stable, 1);
    for (k = 0; k < 2; k++) {
        const double *f = found->vertices + 4 * k, t = f[0] - least[0];

        table_near(t, t < 0 ? -12.5 : 22.5, 1e-9, "end of the family");
        for (i = 0; i < 4; i++)
            table_near(f[i], least[i] + (i % 2 ? -t : t), 1e-9, "force of a leg");
    }
    assert_true((found->vertices[0] < 37.5) != (found->vertices[4] < 37.5));
    for (i = 0; i < 3; i++)
        assert_true(found->acceleration[i] == 0.0);
    table_close(&s);
}

/* Between two faces, 10 degrees off the vertical, with mu > tan: pushed in it rests, with any
 * clamping force; pulled out it stays or leaves. */
static void make_wedge(table *s, double force)
{
    const double angle = 10.0 * acos(-1.0) / 180.0, c = cos(angle), n = sin(angle);
    const double rows[4][2] = {{c, n}, {-n, c}, {-c, n}, {n, c}};
    int i;

    table_make(s, 2, 2, 2);
    for (i = 0; i < 4; i++)
        table_row(s->H, 2, i, rows[i]);
    s->mu[0] = s->mu[1] = 0.3;
    s->k[1] = force;
}

static void test_wedge(void **state)
{
    const perp_mechanism_found *found;
    table s;

    (void)state;
    make_wedge(&s, -1.0);
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 2);
    assert_int_equal(found->free, 0);
    assert_true(found->ray_count > 0);
    assert_true(found->acceleration[0] == 0.0 && found->acceleration[1] == 0.0);
    s.k[1] = 1.0;
    assert_int_equal(table_ask(&s), 2);
    found = table_get(&s, 0);
    assert_true(found->acceleration[1] == 1.0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SEPARATE);
    found = table_get(&s, 1);
    assert_int_equal(found->dimension, 2);
    assert_true(found->ray_count > 0);
    assert_true(found->acceleration[1] == 0.0);
    s.v[1] = -1.0; /* slides in: N of theory, weight 1 */
    s.k[1] = -1.0;
    s.H[1] = s.H[5] = 0.0; /* parallel faces: a contact that approaches would be an impact */
    s.H[2] = s.H[6] = 0.0;
    s.H[3] = s.H[7] = 1.0;
    assert_int_equal(table_ask(&s), 1); /* any clamping force, friction against the motion */
    found = table_get(&s, 0);
    assert_int_equal(found->dimension, 1);
    assert_int_equal(found->free, 1);
    assert_int_equal(found->vertex_count, 1);
    assert_int_equal(found->ray_count, 1);
    table_near(found->rays[1] / found->rays[0], 0.3, 1e-12, "friction");
    table_close(&s);
}

/* ---- dry friction and bilateral rows -------------------------------------------------------- */

static void test_dry(void **state)
{
    static const double one[] = {1.0};
    const perp_mechanism_found *found;
    table s;

    (void)state;
    table_make(&s, 1, 0, 2);
    s.model.dry = 1;
    table_row(s.B, 1, 0, one);
    s.M[0] = 2.0;
    s.bound[0] = 3.0;
    s.k[0] = 2.0;
    table_open(&s);
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_STICK);
    assert_true(found->force[0] == -2.0 && found->acceleration[0] == 0.0);
    s.k[0] = -3.0;
    assert_int_equal(table_ask(&s), 1);
    assert_int_equal(table_get(&s, 0)->at_vertex, 1);
    s.k[0] = -5.0;
    assert_int_equal(table_ask(&s), 1);
    found = table_get(&s, 0);
    assert_int_equal(found->modes[0], PERP_MECHANISM_SLIP);
    assert_true(found->force[0] == 3.0);
    table_near(found->acceleration[0], -1.0, 1e-15, "slip"); /* M's factor is sqrt(2) */
    s.v[0] = 1.0;
    assert_int_equal(table_ask(&s), 1);
    table_near(table_get(&s, 0)->acceleration[0], -4.0, 1e-15, "motion");
    s.bound[0] = 0.0;
    assert_int_equal(table_ask(&s), 1);
    table_near(table_get(&s, 0)->acceleration[0], -2.5, 1e-15, "no friction");
    table_close(&s);
}

static int32_t pendulum(double *c, double *G, double *drift, double t, const double *q, void *user)
{
    const table *s = user;
    int i;

    (void)drift;
    (void)t;
    for (i = 0; i < s->model.bilateral; i++) {
        c[i] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0);
        G[2 * i] = q[0];
        G[2 * i + 1] = q[1];
    }
    return 0;
}

/* A pendulum of length 1 and mass 2: G v' = -|v|^2, the force per row 2 (q'g - |v|^2). */
static void test_bilateral(void **state)
{
    const double q[] = {0.6, -0.8}, v[] = {2.4, 1.8}, y = -2.0 * (0.8 * GRAVITY + 9.0);
    const perp_mechanism_found *found;
    int32_t rows;

    (void)state;
    for (rows = 1; rows < 4; rows++) {
        double sum = 0.0;
        table s;
        int i;

        table_make(&s, 2, 0, 2);
        s.model.bilateral = rows;
        s.model.bilateral_rows = pendulum;
        s.M[0] = s.M[3] = 2.0;
        s.k[1] = -2.0 * GRAVITY;
        memcpy(s.q, q, sizeof q);
        memcpy(s.v, v, sizeof v);
        table_open(&s);
        assert_int_equal(table_ask(&s), 1);
        found = table_get(&s, 0);
        for (i = 0; i < rows; i++)
            sum += found->force[i];
        if (rows == 1)
            table_near(sum, y, 1e-13, "force");
        table_near(found->acceleration[0], 0.5 * y * q[0], 1e-12, "x''");
        table_near(found->acceleration[1], 0.5 * y * q[1] - GRAVITY, 1e-12, "y''");
        assert_true(found->row_acceleration[0] == 0.0);
        assert_int_equal(found->dimension, rows - 1);
        assert_int_equal(found->free, 0);
        assert_int_equal(found->stable, 1);
        for (i = 0; i < found->ray_count; i++) {
            const double *ray = found->rays + i * rows;

            table_near(ray[0] + ray[1] + (rows > 2 ? ray[2] : 0.0), 0.0, 1e-12, "a ray's sum");
        }
        table_close(&s);
    }
}

/* A wheel pressed against a bilateral rail: a contact whose inertia counts the rail. A body of
 * three velocities, v2 tied to v1; normal on v1, friction along v0, coupled by M. */
static void test_held(void **state)
{
    static const double n[] = {0, 1, 0}, t[] = {1, 0, 0}, flag[] = {0, 1, -1};
    table s;

    (void)state;
    table_make(&s, 3, 1, 2);
    s.model.bilateral = 1;
    table_row(s.H, 3, 0, n);
    table_row(s.H, 3, 1, t);
    table_row(s.G, 3, 0, flag);
    s.M[2] = s.M[6] = 0.5; /* v0 with v2 */
    s.mu[0] = 5.0;
    s.k[1] = -1.0;
    s.v[0] = 1.0;
    table_open(&s);
    /* tied: M = [[1, .5], [.5, 2]] in (v0, v1): inverse [[2, -.5], [-.5, 1]] / 1.75 */
    table_ask(&s);
    table_near(s.summary.inertia, 1.0 + 5.0 * 0.5, 1e-14, "inertia");
    s.v[0] = -1.0;
    assert_int_equal(table_ask(&s), 0);
    table_near(s.summary.inertia, 1.0 - 5.0 * 0.5, 1e-14, "inertia");
    assert_int_equal(s.summary.reason, PERP_MECHANISM_NEGATIVE_INERTIA);
    table_close(&s);
}

/* No constant has a dimension: masses, lengths and times in other units (powers of two) change no
 * bit but exponents. */
static void test_units(void **state)
{
    double reference[4] = {0};
    int mass, length;

    (void)state;
    for (mass = -60; mass <= 60; mass += 60)
        for (length = -40; length <= 40; length += 40) {
            const double force = ldexp(1.0, mass + length);
            table s;
            int i;

            make_box(&s, 0.6 * 2.0 * GRAVITY * force, 0.5);
            s.k[1] *= force;
            s.M[0] = s.M[4] = ldexp(2.0, mass);
            s.M[8] = ldexp(3.0, mass + 2 * length);
            for (i = 0; i < 4; i++)
                s.H[3 * i + 2] = ldexp(s.H[3 * i + 2], length);
            table_open(&s);
            assert_int_equal(table_ask(&s), 1);
            assert_int_equal(table_get(&s, 0)->dimension, 0);
            assert_int_equal(s.found.stable, 1);
            for (i = 0; i < 4; i++) {
                if (mass == -60 && length == -40)
                    reference[i] = s.found.force[i] / force;
                assert_true(s.found.force[i] == reference[i] * force);
            }
            s.k[0] = 0.4 * 2.0 * GRAVITY * force; /* and the family */
            assert_int_equal(table_ask(&s), 1);
            assert_int_equal(table_get(&s, 0)->dimension, 1);
            assert_int_equal(s.found.free, 0);
            assert_true(s.found.acceleration[0] == 0.0);
            table_close(&s);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stick_and_slip),
        cmocka_unit_test(test_slope),
        cmocka_unit_test(test_static_friction),
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_wedge),
        cmocka_unit_test(test_dry),
        cmocka_unit_test(test_bilateral),
        cmocka_unit_test(test_held),
        cmocka_unit_test(test_units),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
