/* When shapes meet on their way, against distances at sampled times that need no separating axis.
 */
#include <stdio.h>

#include "suite.h"

#include "collide_scene.h"
#include "world/collide/collision.h"

enum { SAMPLES = 40, MANY_SAMPLES = 200 };

typedef struct encounter {
    perp__geometry shapes[2];
    perp__placed placed[2];
    perp__moving moving[2];
} encounter;

static void random_encounter(uint64_t *state, int planar, int spheres, double turn, encounter *e)
{
    for (int side = 0; side < 2; side++) {
        perp__moving *m = &e->moving[side];
        perp__geometry *shape = &e->shapes[side];
        perp__placed *at = &e->placed[side];
        double angle = scene_uniform(state, -3.0, 3.0);
        *shape = side < spheres
                     ? scene_sphere(scene_uniform(state, 0.1, 1.0))
                     : scene_box(scene_uniform(state, 0.1, 1.0), scene_uniform(state, 0.1, 1.0),
                                 planar ? 0.0 : scene_uniform(state, 0.1, 1.0));
        *at = scene_place(shape, 0.0, 0.0, 0.0);
        if (planar)
            scene_planar_rotation(at->rotation, angle);
        else
            scene_random_rotation(state, at->rotation);
        m->reach = 0.0;
        for (int k = 0; k < 3; k++) {
            int flat = planar && k == 2;
            at->position[k] = flat ? 0.0 : scene_uniform(state, -2.0, 2.0);
            m->displacement[k] = flat ? 0.0 : scene_uniform(state, -3.0, 3.0);
            m->turn[k] = planar && k != 2 ? 0.0 : scene_uniform(state, -turn, turn);
            m->centre[k] = at->position[k];
            m->reach += shape->half_extents[k] + shape->radius;
        }
        m->start = at;
    }
    for (int k = 0; k < 3; k++) /* about towards each other */
        e->moving[1].displacement[k] =
            e->moving[0].displacement[k] +
            scene_uniform(state, 0.5, 1.5) * (e->placed[0].position[k] - e->placed[1].position[k]);
}

/* Distance at time t; of a ball from a box inside of which its centre lies, the depth. */
static double distance(const encounter *e, int planar, double t)
{
    perp__placed at[2];
    for (int side = 0; side < 2; side++)
        perp__moved(&e->moving[side], t, &at[side]);
    if (e->shapes[0].kind == PERP__BOX)
        return scene_box_distance(&at[0], &at[1], planar);
    if (e->shapes[1].kind == PERP__BOX)
        return scene_point_box(&at[1], planar, at[0].position) - e->shapes[0].radius;
    double square = 0.0;
    for (int k = 0; k < 3; k++)
        square += (at[1].position[k] - at[0].position[k]) * (at[1].position[k] - at[0].position[k]);
    return sqrt(square) - e->shapes[0].radius - e->shapes[1].radius;
}

/* How deep boxes are in each other along a direction, either way, or deeper: the least so far. */
static double shallower(const perp__placed *at, const double *normal, double least)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        double n[3] = {sign * normal[0], sign * normal[1], sign * normal[2]};
        least = fmin(least, scene_overlap(&at[0], &at[1], n));
    }
    return least;
}

/* How deep boxes are in each other at time t: along their axes and the products of their edges. */
static double depth(const encounter *e, int planar, double t)
{
    double least = INFINITY, axes[2][3][3];
    perp__placed at[2];
    for (int side = 0; side < 2; side++)
        perp__moved(&e->moving[side], t, &at[side]);
    if (e->shapes[0].kind != PERP__BOX)
        return fmax(-distance(e, planar, t), 0.0);
    for (int side = 0; side < 2; side++)
        for (int j = 0; j < (planar ? 2 : 3); j++) {
            for (int k = 0; k < 3; k++)
                axes[side][j][k] = at[side].rotation[3 * k + j];
            least = shallower(at, axes[side][j], least);
        }
    for (int i = 0; i < 3 && !planar; i++)
        for (int j = 0; j < 3; j++) {
            const double *u = axes[0][i], *v = axes[1][j];
            double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                           u[0] * v[1] - u[1] * v[0]};
            double length = sqrt(scene_dot(n, n));
            for (int k = 0; k < 3; k++)
                n[k] /= length;
            if (length > 1e-6)
                least = shallower(at, n, least);
        }
    return fmax(least, 0.0);
}

/* Between two looks a body turns by an eighth of a radian, and a point at distance r from its
 * centre leaves the chord of its arc by r / 8^3 at most: two boxes of size 1.8 may graze each other
 * unseen by twice that. Without turning nothing is lost but rounding. */
static void check(uint64_t *state, int planar, int spheres, double turn, int *met)
{
    const perp__touch_tolerance near = {1e-9, 1e-12, 1e-13};
    const double unseen = turn > 0.0 ? 2.0 * 1.8 / 512.0 : 1e-12;
    perp__collision collision;
    encounter e;
    do
        random_encounter(state, planar, spheres, turn, &e);
    while (!(distance(&e, planar, 0.0) > 0.05));
    double until = 1.0;
    if (perp__find_collision(&e.moving[0], &e.moving[1], planar, &near, &collision) > 0) {
        until = collision.time;
        ++*met;
        assert_true(until >= 0.0 && until <= 1.0);
        /* a chord of a ball's way in the frame of a box that turns is off its arc by 1e-3 of the
         * smaller's size, or of 160 chords at most: a turn of 6 and a way of 12 */
        double close = spheres == 1 && turn > 0.0 ? 3e-3 : 1e-9;
        double at = distance(&e, planar, until);
        if (!(fabs(at) <= close) || !(depth(&e, planar, until) <= close))
            fail_msg("planar %d spheres %d: %g apart, %g deep at the collision, t = %g", planar,
                     spheres, at, depth(&e, planar, until), until);
    }
    for (int i = 0; i < SAMPLES; i++) {
        double t = until * (i + 0.5) / SAMPLES;
        if (distance(&e, planar, t) <= 0.0 && !(depth(&e, planar, t) <= unseen))
            fail_msg("planar %d spheres %d turn %g: %g deep at t = %g, before %g", planar, spheres,
                     turn, depth(&e, planar, t), t, until);
    }
}

static void meetings_are_the_first_contacts(void **context)
{
    (void)context;
    static const double turns[] = {0.0, 0.3, 2.0};
    uint64_t state = 41;
    for (int planar = 0; planar < 2; planar++)
        for (int spheres = 0; spheres <= 2; spheres++)
            for (int i = 0; i < 3; i++) {
                int met = 0;
                for (int round = 0; round < 120; round++)
                    check(&state, planar, spheres, turns[i], &met);
                assert_true(met > 30 && met < 120);
            }
}

/* In a step of many turns the looks may run out, as 4 of these 4,000 times, where all 4 overlap.
 * What is not known to stay apart then is not said to. A stride is up to 138 / 160 radians here: so
 * boxes may graze unseen by more than those above, but none do at these samples. */
static void what_many_turns_leave_unknown_is_said(void **context)
{
    (void)context;
    static const double turns[] = {12.0, 20.0, 40.0};
    const perp__touch_tolerance near = {1e-9, 1e-12, 1e-13};
    uint64_t state = 44;
    int unknown = 0;
    for (int round = 0; round < 4000; round++) {
        const int planar = round % 2, spheres = round / 2 % 2;
        const double turn = turns[round / 4 % 3];
        perp__collision collision;
        encounter e;
        do
            random_encounter(&state, planar, spheres, turn, &e);
        while (!(distance(&e, planar, 0.0) > 0.05));
        const int32_t word =
            perp__find_collision(&e.moving[0], &e.moving[1], planar, &near, &collision);
        unknown += word < 0;
        for (int i = 0; i < MANY_SAMPLES && word == 0; i++) {
            const double t = (i + 0.5) / MANY_SAMPLES;
            if (distance(&e, planar, t) <= 0.0 && !(depth(&e, planar, t) <= 2.0 * 1.8 / 512.0))
                fail_msg("round %d: said to stay apart, %g deep at t = %g", round,
                         depth(&e, planar, t), t);
        }
    }
    assert_true(unknown > 0);
}

/* Height of corner (x, -0.1) of a box that turns from 1e-3 to -2e-4 rad, above the face y = 0.1. */
static double height(const encounter *e, double x, double t)
{
    const double angle = 1e-3 + t * e->moving[1].turn[2];
    return e->placed[1].position[1] + t * e->moving[1].displacement[1] + x * sin(angle) -
           0.1 * cos(angle) - 0.1;
}

/* A box turns about its left corner, just above a face, until its right one comes down on that:
 * along the face's normal the boxes come no nearer for most of the way. The time by bisection. */
static void one_corner_stays(void **context)
{
    (void)context;
    const perp__touch_tolerance near = {1e-9, 1e-12, 1e-13};
    const double gap = 1e-7, tilt = 1e-3, turn = -1.2e-3;
    for (int planar = 0; planar < 2; planar++) {
        perp__collision collision;
        encounter e;
        double open = 0.0, closed = 1.0;
        memset(&e, 0, sizeof e);
        e.shapes[0] = scene_box(1.0, 0.1, planar ? 0.0 : 1.0);
        e.shapes[1] = scene_box(0.1, 0.1, planar ? 0.0 : 0.1);
        e.placed[0] = scene_place(&e.shapes[0], 0.0, 0.0, 0.0);
        e.placed[1] = scene_place(&e.shapes[1], 0.0, 0.0, 0.0);
        scene_planar_rotation(e.placed[1].rotation, tilt);
        e.placed[1].position[1] = 0.1 + gap + 0.1 * cos(tilt) + 0.1 * sin(tilt);
        for (int side = 0; side < 2; side++) {
            e.moving[side].start = &e.placed[side];
            e.moving[side].reach = side == 0 ? 1.5 : 0.2;
            memcpy(e.moving[side].centre, e.placed[side].position, 3 * sizeof(double));
        }
        e.moving[1].turn[2] = turn;
        e.moving[1].displacement[1] =
            0.1 * (sin(tilt + turn) + cos(tilt + turn) - sin(tilt) - cos(tilt));
        assert_true(fabs(height(&e, -0.1, 1.0) - gap) <= 1e-15); /* the left corner is back */
        assert_true(height(&e, 0.1, 0.0) > 0.0 && height(&e, 0.1, 1.0) < 0.0);
        for (int k = 0; k < 60; k++) {
            const double t = 0.5 * (open + closed);
            *(height(&e, 0.1, t) > 0.0 ? &open : &closed) = t;
        }
        assert_true(perp__find_collision(&e.moving[0], &e.moving[1], planar, &near, &collision) ==
                    1);
        /* near.rounding, and 20 halvings of the way at worst */
        assert_true(fabs(collision.time - closed) <= 1e-6);
    }
}

/* Points of a collision along its axis: on both surfaces, with the normal from A to B. */
static void points_of_meetings(void **context)
{
    (void)context;
    const perp__touch_tolerance near = {1e-9, 1e-12, 1e-13};
    uint64_t state = 42;
    int met = 0;
    for (int round = 0; round < 1500; round++) {
        int planar = round % 2;
        perp__collision collision;
        perp__point points[PERP__MAX_POINTS];
        perp__placed at[2];
        encounter e;
        random_encounter(&state, planar, 0, round % 3 ? 0.5 : 0.0, &e);
        if (!(scene_box_distance(&e.placed[0], &e.placed[1], planar) > 0.05) ||
            perp__find_collision(&e.moving[0], &e.moving[1], planar, &near, &collision) <= 0)
            continue;
        met++;
        for (int side = 0; side < 2; side++)
            perp__moved(&e.moving[side], collision.time, &at[side]);
        int32_t count = perp__collide_along(&at[0], &at[1], planar, collision.axis, points);
        double least = INFINITY;
        assert_true(count > 0);
        for (int32_t q = 0; q < count; q++) {
            double swapped = 0.0;
            for (int k = 0; k < 3; k++)
                swapped += points[q].normal[k] * points[0].normal[k];
            assert_true(swapped > 1.0 - 1e-12);
            least = fmin(least, points[q].gap);
            if (!(fabs(points[q].gap) <= 1e-9))
                continue;
            /* the deepest points are where the boxes touch */
            for (int side = 0; side < 2; side++)
                assert_true(fabs(scene_point_box(&at[side], planar, points[q].position)) <= 1e-7);
        }
        assert_true(fabs(least) <= 1e-9);
        /* an edge within 1e-3 of a face gives way to it: that much of a size of 3.5 */
        assert_true(fabs(scene_overlap(&at[0], &at[1], points[0].normal)) <= 3.5e-3);
    }
    assert_true(met > 500);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meetings_are_the_first_contacts),
        cmocka_unit_test(what_many_turns_leave_unknown_is_said),
        cmocka_unit_test(one_corner_stays),
        cmocka_unit_test(points_of_meetings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
