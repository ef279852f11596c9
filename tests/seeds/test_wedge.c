/* Contacts that share a load in more than one way: a wedge held by its own friction, and a table
 * with four legs. Velocities, resultants and complementarity are determined, single impulses are
 * not. */
#include <stdio.h>

#include "suite.h"

#include "world/scene.h"

#define HALF_ANGLE (PI / 18.0)

/* A point of mass 1 between two walls that open upwards with a half-angle of 10 degrees. mu = 0.3
 * is more than tan 10 degrees = 0.17632698070846497: it locks itself. */
static perp_body open_wedge(scene *s, double mu, double vy, double gravity)
{
    perp_body_settings settings = scene_settings();
    perp_body body;

    scene_open(s, 1, 0.0, -gravity, 0.0);
    settings.velocity[1] = vy;
    body = scene_add(s, &settings);
    scene_plane(s, s->ground, cos(HALF_ANGLE), sin(HALF_ANGLE), 0.0, 0.0, mu, 0.0);
    scene_plane(s, s->ground, -cos(HALF_ANGLE), sin(HALF_ANGLE), 0.0, 0.0, mu, 0.0);
    scene_sphere(s, body, 0.0, mu, 0.0);
    return body;
}

/* Every contact obeys its laws: no pull, no overlap, friction in its cone and against the slip. */
static void check_laws(scene *s, double scale)
{
    const double rounding = 64.0 * EPSILON * scale;
    int32_t i;

    for (i = 0; i < perp_world_contact_count(s->world); i++) {
        perp_world_contact contact = scene_contact(s, i);
        double slip = hypot(contact.velocity[1], contact.velocity[2]);
        double friction = hypot(contact.impulse[1], contact.impulse[2]);
        double power =
            contact.impulse[1] * contact.velocity[1] + contact.impulse[2] * contact.velocity[2];

        assert_true(contact.impulse[0] >= 0.0);
        assert_true(contact.velocity[0] >= -rounding);
        scene_near(contact.impulse[0] * contact.velocity[0], 0.0, rounding * scale, "c u_n");
        assert_true(friction <= contact.friction * contact.impulse[0] + rounding);
        scene_near(power, -contact.friction * contact.impulse[0] * slip, rounding * scale,
                   "dissipation");
    }
}

/* Pushed in the wedge stops, which is the only solution. */
static void test_pushed_in(void **state)
{
    perp_body body;
    scene s;

    (void)state;
    body = open_wedge(&s, 0.3, -1.0, 0.0);
    scene_step(&s, 0.01);
    assert_true(scene_state(&s, body).velocity[0] == 0.0);
    assert_true(scene_state(&s, body).velocity[1] == 0.0);
    check_laws(&s, 1.0 / sin(HALF_ANGLE));
    scene_close(&s);
}

/* Pulled out it jams or comes free: both obey the laws. */
static void test_pulled_out(void **state)
{
    perp_body body;
    double vy;
    scene s;

    (void)state;
    body = open_wedge(&s, 0.3, 1.0, 0.0);
    scene_step(&s, 0.01);
    vy = scene_state(&s, body).velocity[1];
    assert_true(vy == 0.0 || vy == 1.0);
    assert_true(scene_state(&s, body).velocity[0] == 0.0);
    check_laws(&s, 1.0 / sin(HALF_ANGLE));
    scene_close(&s);
}

/* Held against its weight it stays for ever; with less friction than tan 10 degrees it falls, with
 * g (1 - mu / tan) if both walls press: N = m g / (2 (sin + mu cos)) would brake it. */
static void test_carries_its_weight(void **state)
{
    perp_body body;
    scene s;
    int k;

    (void)state;
    body = open_wedge(&s, 0.3, 0.0, GRAVITY);
    for (k = 0; k < 100; k++) {
        scene_step(&s, 0.01);
        assert_true(scene_state(&s, body).velocity[0] == 0.0);
        assert_true(scene_state(&s, body).velocity[1] == 0.0);
    }
    assert_true(scene_state(&s, body).position[1] == 0.0);
    check_laws(&s, 0.01 * GRAVITY / sin(HALF_ANGLE));
    scene_close(&s);
}

/* Legs at (+-1, +-0.5), W = 100 at (0.3, 0.1): the legs' forces share the load in a family, their
 * resultant is (100, 10, 30). */
static void test_table(void **state)
{
    const double weight = 100.0, x = 0.3, y = 0.1, h = 0.01;
    perp_body_settings settings = scene_settings();
    double force = 0.0, moment_x = 0.0, moment_y = 0.0;
    perp_body table;
    scene s;
    int i, k;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.mass = weight / GRAVITY;
    settings.position[0] = x;
    settings.position[1] = y;
    settings.position[2] = 1.0;
    table = scene_add(&s, &settings);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    for (i = 0; i < 4; i++)
        scene_point(&s, table, (i == 0 || i == 3 ? 1.0 : -1.0) - x, (i < 2 ? 0.5 : -0.5) - y, -1.0,
                    0.0, 0.0);
    for (k = 0; k < 10; k++) {
        scene_step(&s, h);
        assert_true(scene_rests(&s, table));
    }
    assert_int_equal(perp_world_contact_count(s.world), 4);
    for (i = 0; i < 4; i++) {
        perp_world_contact contact = scene_contact(&s, i);
        double sign = contact.body_b == table ? 1.0 : -1.0;
        double lift = sign * contact.normal[2] * contact.impulse[0] / h;

        assert_true(contact.impulse[0] >= 0.0);
        assert_true(contact.velocity[0] == 0.0);
        force += lift;
        moment_x += lift * contact.position[1];
        moment_y += lift * contact.position[0];
    }
    /* sums of four numbers up to 100, solved with a few units of rounding */
    scene_near(force, 100.0, 64.0 * EPSILON * weight, "force");
    scene_near(moment_x, 10.0, 64.0 * EPSILON * weight, "moment about x");
    scene_near(moment_y, 30.0, 64.0 * EPSILON * weight, "moment about y");
    scene_close(&s);
}

/* A thousand legs on the unit circle: the same resultant. */
static void test_many_legs(void **state)
{
    enum { legs = 1000 };
    const double weight = 100.0, x = 0.3, y = 0.1, h = 0.01;
    perp_body_settings settings = scene_settings();
    double force = 0.0, moment_x = 0.0, moment_y = 0.0;
    perp_body table;
    scene s;
    int i;

    (void)state;
    scene_open(&s, 0, 0.0, 0.0, -GRAVITY);
    settings.mass = weight / GRAVITY;
    settings.position[0] = x;
    settings.position[1] = y;
    settings.position[2] = 1.0;
    table = scene_add(&s, &settings);
    scene_plane(&s, s.ground, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    for (i = 0; i < legs; i++)
        scene_point(&s, table, cos(2.0 * PI * i / legs) - x, sin(2.0 * PI * i / legs) - y, -1.0,
                    0.0, 0.0);
    scene_step(&s, h);
    assert_true(scene_rests(&s, table));
    assert_int_equal(perp_world_contact_count(s.world), legs);
    for (i = 0; i < legs; i++) {
        perp_world_contact contact = scene_contact(&s, i);
        double sign = contact.body_b == table ? 1.0 : -1.0;
        double lift = sign * contact.normal[2] * contact.impulse[0] / h;

        assert_true(contact.impulse[0] >= 0.0);
        force += lift;
        moment_x += lift * contact.position[1];
        moment_y += lift * contact.position[0];
    }
    scene_near(force, 100.0, 64.0 * EPSILON * weight, "force");
    scene_near(moment_x, 10.0, 64.0 * EPSILON * weight, "moment about x");
    scene_near(moment_y, 30.0, 64.0 * EPSILON * weight, "moment about y");
    scene_close(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pushed_in),          cmocka_unit_test(test_pulled_out),
        cmocka_unit_test(test_carries_its_weight), cmocka_unit_test(test_table),
        cmocka_unit_test(test_many_legs),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
