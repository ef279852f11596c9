/* The judge of velocities and impulses: a ball of mass 1 on the floor, friction 1/2, with numbers
 * by hand in the place of those of a step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "world/scene.h"
#include "world/world.h"

#define H 0.01

typedef struct fall {
    scene s;
    const perp__island *island;
    perp__motion *ball;
    perp__world_contact *contact;
} fall;

/* After a step in which it slides with 1 m/s less friction, g h / 2. */
static void open_fall(fall *f)
{
    perp_body_settings settings = scene_settings();
    perp_body ball;

    scene_open(&f->s, 0, 0.0, 0.0, -GRAVITY);
    scene_plane(&f->s, f->s.ground, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0);
    settings.position[2] = 1.0;
    settings.velocity[0] = 1.0;
    ball = scene_add(&f->s, &settings);
    scene_sphere(&f->s, ball, 1.0, 0.5, 0.0);
    scene_step(&f->s, H);
    assert_int_equal(perp__build_islands(f->s.world, &f->s.world->contacts), PERP_OK);
    assert_int_equal(f->s.world->island_count, 1);
    f->island = &f->s.world->islands[0];
    assert_int_equal(f->island->contacts, 1);
    f->ball = perp__island_motion(f->s.world, f->island, 0);
    f->contact = perp__island_contact(f->s.world, &f->s.world->contacts, f->island, 0);
}

/* The ball goes with the velocity u along the contact's axes, and does not turn. */
static void move(const fall *f, double *twist, const double *u)
{
    int i, axis;

    memset(twist, 0, 6 * sizeof *twist);
    for (axis = 0; axis < 3; axis++)
        for (i = 0; i < 3; i++)
            twist[i] += u[axis] * f->contact->axes[axis][i];
}

/* Impulses (n, t, t) of a contact of friction 1/2 with velocities u: 0 for what obeys the laws, and
 * what does not is not small, for its terms are of order 1. */
static void test_laws(void **state)
{
    static const struct {
        double r[3], u[3];
        int obeys;
    } cases[] = {
        {{1, 0, 0}, {0, 0, 0}, 1},         /* rests */
        {{0, 0, 0}, {0.25, 0.25, 0.5}, 1}, /* leaves */
        {{1, -0.5, 0}, {0, 0.25, 0}, 1},   /* slips */
        {{1, 0.25, 0}, {0, 0, 0}, 1},      /* sticks */
        {{-1, 0, 0}, {0, 0, 0}, 0},        /* pulls */
        {{1, 0, 0}, {0.25, 0, 0}, 0},      /* presses and leaves */
        {{0, 0, 0}, {-0.25, 0, 0}, 0},     /* sinks */
        {{1, 0, 0}, {-0.25, 0, 0}, 0},     /* though it presses */
        {{1, 0.625, 0}, {0, 0, 0}, 0},     /* more friction than there is */
        {{1, -0.25, 0}, {0, 0.25, 0}, 0},  /* slips with less than there is, */
        {{1, 0.5, 0}, {0, 0.25, 0}, 0},    /* with it, not against it, */
        {{1, 0, -0.5}, {0, 0.25, 0}, 0},   /* and across */
        {{NAN, 0, 0}, {0, 0, 0}, 0},       {{1, 0, 0}, {NAN, 0, 0}, 0},
    };
    size_t k;
    fall f;

    (void)state;
    open_fall(&f);
    for (k = 0; k < sizeof cases / sizeof *cases; k++) {
        double own;

        memcpy(f.contact->impulse, cases[k].r, sizeof cases[k].r);
        move(&f, f.ball->after, cases[k].u);
        move(&f, f.ball->solved, cases[k].u);
        own = perp__own_residual(f.s.world, f.island, PERP__TWIST_AFTER);
        if (cases[k].obeys ? !(own <= 8.0 * EPSILON) : own <= 0.01)
            fail_msg("case %d: %g", (int)k, own);
    }
    scene_close(&f.s);
}

/* Velocities that are not those of the impulses. */
static void test_momentum(void **state)
{
    static const double rest[3] = {0, 0, 0}, leaves[3] = {0.25, 0, 0};
    fall f;

    (void)state;
    open_fall(&f);
    memcpy(f.contact->impulse, rest, sizeof rest);
    move(&f, f.ball->after, leaves);
    move(&f, f.ball->solved, rest);
    assert_true(perp__own_residual(f.s.world, f.island, PERP__TWIST_AFTER) > 0.01);
    scene_close(&f.s);
}

/* Exact velocities are taken where they are an answer. They are not where the contact is said to
 * stick though it slips; nor where its impulse is half of what holds it, and the velocities which
 * that leads to are none: then those of the impulses stand. */
static void test_what_holds(void **state)
{
    const double weight = GRAVITY * H;
    perp__evidence evidence = {0.0, 0.0, INFINITY, 1};
    fall f;

    (void)state;
    open_fall(&f);
    assert_true(f.contact->slip > 0.0);
    perp__exact_velocities(f.s.world, f.island, PERP__TWIST_AFTER, &evidence);
    assert_true(f.ball->after[2] == 0.0); /* held */
    scene_near(f.ball->after[0], 1.0 - 0.5 * weight, 8.0 * EPSILON, "slips");
    f.contact->slip = 0.0;
    perp__exact_velocities(f.s.world, f.island, PERP__TWIST_AFTER, &evidence);
    scene_near(f.ball->after[0], 1.0 - 0.5 * weight, 8.0 * EPSILON, "slips all the same");
    f.contact->slip = 1.0;
    f.contact->impulse[0] = 0.5 * weight;
    f.contact->impulse[1] = f.contact->impulse[2] = 0.0;
    perp__exact_velocities(f.s.world, f.island, PERP__TWIST_AFTER, &evidence);
    scene_near(f.ball->after[2], -0.5 * weight, 8.0 * EPSILON, "sinks");
    scene_close(&f.s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),
        cmocka_unit_test(test_momentum),
        cmocka_unit_test(test_what_holds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
