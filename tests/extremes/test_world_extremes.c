/* The stepper at its extremes: a table of what holds, and where the result says that it does not.
 *
 *     build/tests/extremes/test_world_extremes table      prints it (make extremes)
 *
 * Each row runs a scene whose answer is known in closed form over a range of values and measures
 * the worst error. Up to `bound` it holds; beyond it is wrong, unless the result said that it was
 * (an outcome that is not good, or a refusal). The committed table, bench/results/extremes.txt, has
 * to have the same rows, verdicts and outcomes. PERP_EXTREMES_LONG=1 takes the hour's steps that
 * are skipped otherwise. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../world/scene.h"

enum { LEVELS = 4, MANY = 1000000 };

static unsigned said; /* bit k: some step of the row ended with outcome k */
static int refused;   /* and some call was refused as not finite */

static perp_world_settings settings_of(int32_t planar, int32_t accuracy, double g)
{
    perp_world_settings settings;

    perp_world_settings_init(&settings, sizeof settings, planar);
    settings.accuracy = accuracy;
    settings.friction = 0.5;
    settings.gravity[0] = settings.gravity[1] = settings.gravity[2] = 0.0;
    settings.gravity[planar ? 1 : 2] = -g;
    return settings;
}

static int good(void)
{
    return !refused && !(said & ~(1u << PERP_OUTCOME_SOLVED | 1u << PERP_OUTCOME_ROUNDING_LIMIT));
}

static void steps(scene *s, double h, int count)
{
    perp_step_result result;
    int k;

    perp_step_result_init(&result, sizeof result);
    for (k = 0; k < count && !refused; k++) {
        perp_status status = perp_world_step(s->world, &result, h);

        if (status == PERP_ERROR_NOT_FINITE)
            refused = 1;
        else if (status != PERP_OK)
            fail_msg("step: %s", perp_context_message(s->context));
        else
            said |= 1u << result.outcome;
    }
}

static double largest(const double *x, int count)
{
    double most = 0.0;
    int i;

    for (i = 0; i < count; i++)
        if (!(fabs(x[i]) <= most))
            most = fabs(x[i]);
    return most;
}

static double larger(double a, double b)
{
    return a >= b ? a : b; /* a NaN in b stays */
}

/* A box of a mass whose centre is `up` above the ground's height, at (x, x). */
static perp_body box_at(scene *s, int32_t planar, double side, double x, double up, double mass)
{
    const double half[3] = {side / 2, side / 2, side / 2};
    perp_body_settings settings = scene_defaults();
    perp_status status;
    perp_body body;

    settings.mass = mass;
    settings.position[0] = x;
    settings.position[1] = planar ? up : x;
    settings.position[2] = planar ? 0.0 : up;
    body = scene_add(s, &settings);
    status = perp_world_add_box(s->world, NULL, body, half, NULL);
    refused = refused || status == PERP_ERROR_NOT_FINITE;
    if (status != PERP_OK && !refused)
        fail_msg("box: %s", perp_context_message(s->context));
    return body;
}

static void floor_of(scene *s, int32_t planar, double height)
{
    scene_plane(s, s->ground, 0, planar, !planar, height, PERP_FRICTION_OF_WORLD, 0.0);
}

/* What bodies move by and their speeds, beside `size` and sqrt(g size), after as many steps. */
static double unrest(scene *s, const perp_body *bodies, int count, double size, double g, double h,
                     int number)
{
    perp_body_state before[20];
    double worst = 0.0;
    int i, k;

    for (k = 0; k < count; k++)
        before[k] = scene_state(s, bodies[k]);
    steps(s, h, number);
    for (k = 0; k < count; k++) {
        perp_body_state after = scene_state(s, bodies[k]);

        for (i = 0; i < 3; i++)
            after.position[i] -= before[k].position[i];
        worst = larger(worst, largest(after.position, 3) / size);
        worst = larger(worst, largest(after.velocity, 3) / sqrt(g * size));
        worst = larger(worst, largest(after.angular_velocity, 3) / sqrt(g / size));
    }
    return worst;
}

/* A stack of boxes on the ground, or on a static box around (x, x, x). */
typedef struct stack {
    int32_t planar, accuracy, wakeful;
    int count, number;
    double side, g, h, at;
} stack;

static double stack_moves(const stack *a)
{
    perp_world_settings settings = settings_of(a->planar, a->accuracy, a->g);
    perp_body bodies[20];
    double worst;
    scene s;
    int k;

    settings.wakeful = a->wakeful;
    scene_create(&s, &settings);
    floor_of(&s, a->planar, a->at);
    for (k = 0; k < a->count; k++)
        bodies[k] = box_at(&s, a->planar, a->side, a->at, a->at + a->side * (k + 0.5), 1.0);
    worst = unrest(&s, bodies, a->count, a->side * a->count, a->g, a->h, a->number);
    scene_close(&s);
    return worst;
}

/* The worst of all accuracies from a.accuracy on, in the plane and in space. */
static double stacks_move(stack a)
{
    double worst = 0.0;
    int32_t level;

    for (level = 2 * a.accuracy; level < 2 * LEVELS; level++) {
        a.accuracy = level / 2;
        a.planar = level % 2;
        worst = larger(worst, stack_moves(&a));
    }
    return worst;
}

/* A point or a box slides at speed v, (3, 4)/5 of it along the axes in space, to its stop after
 * v^2 / (2 mu g): what it is off by, beside that, and no velocity is left. Stopping within a step
 * costs a h^2 / 8 (docs/world.md). */
typedef struct slide {
    int32_t planar;
    double size, mu, g, v, h, at; /* size 0: a point */
} slide;

static double slide_off(const slide *a, double allowed)
{
    perp_world_settings settings = settings_of(a->planar, PERP_ACCURACY_STANDARD, a->g);
    double way = a->v * a->v / (2 * a->mu * a->g), x[2], off;
    int number = (int)ceil(a->v / (a->mu * a->g) / a->h) + 2;
    perp_body_state state;
    perp_body body;
    scene s;

    settings.friction = a->mu;
    scene_create(&s, &settings);
    floor_of(&s, a->planar, 0.0);
    body = box_at(&s, a->planar, a->size > 0 ? a->size : 1.0, a->at, a->size / 2, 1.0);
    if (a->size == 0.0) {
        perp_body_settings point = scene_settings();

        SCENE_OK(&s, perp_world_remove_body(s.world, body));
        point.position[0] = a->at;
        point.position[1] = a->planar ? 0.0 : a->at;
        body = scene_add(&s, &point);
        scene_point(&s, body, 0, 0, 0, PERP_FRICTION_OF_WORLD, 0.0);
    }
    state = scene_state(&s, body);
    state.velocity[0] = a->planar ? a->v : 0.6 * a->v;
    state.velocity[1] = a->planar ? 0.0 : 0.8 * a->v;
    SCENE_OK(&s, perp_world_set_body(s.world, &state, body));
    steps(&s, a->h, number);
    state = scene_state(&s, body);
    x[0] = state.position[0] - a->at;
    x[1] = a->planar ? 0.0 : state.position[1] - a->at;
    off = fabs(sqrt(x[0] * x[0] + x[1] * x[1]) - way);
    off = scene_rests(&s, body) ? off / (way + allowed * a->mu * a->g * a->h * a->h / 8) : 1.0;
    scene_close(&s);
    return off;
}

/* A point pushed by 1 - 1e-9 and by 1 + 1e-9 of what friction holds: at rest, and accelerated by
 * the difference. The error of that, or 1 where what has to rest moves. */
static double threshold_off(double mu, double g)
{
    double worst = 0.0;
    int k;

    for (k = 0; k < 2; k++) {
        perp_world_settings settings = settings_of(0, PERP_ACCURACY_EXACT, g);
        double push = g * mu * (k ? 1 + 1e-9 : 1 - 1e-9), h = 0.01 / sqrt(g), v;
        perp_body_settings point = scene_settings();
        perp_body_state state;
        perp_body body;
        scene s;

        settings.friction = mu;
        scene_create(&s, &settings);
        floor_of(&s, 0, 0.0);
        body = scene_add(&s, &point);
        scene_point(&s, body, 0, 0, 0, PERP_FRICTION_OF_WORLD, 0.0);
        scene_push(&s, body, 0.6 * push, 0.8 * push, 0.0);
        steps(&s, h, 10);
        state = scene_state(&s, body);
        v = sqrt(scene_dot(state.velocity, state.velocity));
        worst = larger(worst, k ? fabs(v / (1e-9 * mu * g * 10 * h) - 1) : !scene_rests(&s, body));
        scene_close(&s);
    }
    return worst;
}

/* Sizes: bits at 4^k. A heap of boxes, balls and capsules in space; lengths times 4^k, times 2^k
 * and the velocities so. Counts the numbers that are not those of k = 0 times a power of two. */

static void heap(double *states, int k)
{
    perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 9.81);
    perp_body bodies[9];
    scene s;
    int i;

    scene_create(&s, &settings);
    floor_of(&s, 0, 0.0);
    for (i = 0; i < 9; i++) {
        perp_body_settings body = scene_defaults();

        body.position[0] = ldexp(0.3 * (i % 3) + 0.07 * i, 2 * k);
        body.position[1] = ldexp(0.2 * (i % 2), 2 * k);
        body.position[2] = ldexp(0.4 + 0.35 * i, 2 * k);
        body.velocity[0] = ldexp(0.4 - 0.1 * i, k);
        body.angular_velocity[1] = ldexp(0.5 * i, -k);
        bodies[i] = scene_add(&s, &body);
        if (i % 3 == 0)
            scene_box(&s, bodies[i], ldexp(0.2, 2 * k), ldexp(0.15, 2 * k), ldexp(0.1, 2 * k), 0.5,
                      i == 3 ? 0.5 : 0.0);
        else if (i % 3 == 1)
            scene_sphere(&s, bodies[i], ldexp(0.15, 2 * k), 0.5, 0.0);
        else
            SCENE_OK(&s, perp_world_add_capsule(s.world, NULL, bodies[i], ldexp(0.1, 2 * k),
                                                ldexp(0.15, 2 * k), NULL));
    }
    steps(&s, ldexp(0.01, k), 150);
    for (i = 0; i < 9; i++, states += 13) {
        perp_body_state state = scene_state(&s, bodies[i]);
        int j;

        for (j = 0; j < 3; j++) {
            states[j] = ldexp(state.position[j], -2 * k);
            states[3 + j] = ldexp(state.velocity[j], -k);
            states[6 + j] = ldexp(state.angular_velocity[j], k);
        }
        memcpy(states + 9, state.orientation, sizeof state.orientation);
    }
    scene_close(&s);
}

static double bits_differ(double k)
{
    double one[117], scaled[117];
    int i, differ = 0;

    heap(one, 0);
    heap(scaled, (int)k);
    for (i = 0; i < 117; i++)
        differ += one[i] != scaled[i];
    return differ;
}

static double size_stack(double size)
{
    return stacks_move(
        (stack){.count = 5, .number = 300, .side = size, .g = 9.81, .h = 0.01 * sqrt(size)});
}

static double size_slide(double size)
{
    return slide_off(&(slide){.planar = 0,
                              .size = size,
                              .mu = 0.5,
                              .g = 9.81,
                              .v = 3 * sqrt(size),
                              .h = 0.01 * sqrt(size)},
                     1.0);
}

/* Steps */

static double step_stack(double h)
{
    return stacks_move((stack){.count = 5, .number = 300, .side = 0.3, .g = 9.81, .h = h});
}

static double step_slide(double h)
{
    slide a = {.size = 0, .mu = 0.5, .g = 9.81, .v = 1, .h = h};
    double way = a.v * a.v / (2 * a.mu * a.g), brake = a.mu * a.g * h * h / 8;

    /* what is off beside a h^2 / 8, rounding of as many sums left out */
    return slide_off(&a, 0.0) * way / (brake + way * 16 * DBL_EPSILON * (2 + 0.2 / h));
}

/* A ball with e = 1/2 from 1 m: its height after 1 s, on its second bounce. */
static double step_bounce(double h)
{
    perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 9.81);
    perp_body_settings body = scene_settings();
    double fall = sqrt(2 / 9.81), t = 1 - 2 * fall, off;
    perp_body ball;
    scene s;

    scene_create(&s, &settings);
    floor_of(&s, 0, 0.0);
    body.position[2] = 1.5;
    ball = scene_add(&s, &body);
    scene_sphere(&s, ball, 0.5, 0.0, 0.5);
    steps(&s, h, (int)lround(1 / h));
    off = fabs(scene_state(&s, ball).position[2] - 0.5 - (9.81 * fall / 4 * t - 9.81 / 2 * t * t));
    scene_close(&s);
    return off;
}

/* Friction */

static double friction_threshold(double mu)
{
    return threshold_off(mu, 9.81);
}

static double friction_slide(double mu)
{
    double v = sqrt(2 * mu * 9.81);

    return slide_off(&(slide){.size = 0, .mu = mu, .g = 9.81, .v = v, .h = v / (mu * 9.81) / 64.5},
                     1.0);
}

/* Without friction a box keeps its velocity to the last bit. */
static double slides_on(double v)
{
    perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 9.81);
    perp_body_state state;
    perp_body body;
    double off;
    scene s;

    settings.friction = 0.0;
    scene_create(&s, &settings);
    floor_of(&s, 0, 0.0);
    body = box_at(&s, 0, 1.0, 0.0, 0.5, 1.0);
    state = scene_state(&s, body);
    state.velocity[0] = v;
    SCENE_OK(&s, perp_world_set_body(s.world, &state, body));
    steps(&s, 0.01, 1000);
    state = scene_state(&s, body);
    off = fabs(state.velocity[0] / v - 1) + fabs(state.velocity[2] / v) +
          largest(state.angular_velocity, 3) / v + fabs(state.position[2] - 0.5);
    scene_close(&s);
    return off;
}

static double friction_none(double mu)
{
    (void)mu;
    return slides_on(3.0);
}

/* Masses */

/* Two boxes, 1 and R, and R and 1: still, and the ground carries both. Two bodies are solved to
 * `tol` at every accuracy. */
static double mass_load(double ratio)
{
    double worst = 0.0;
    int32_t order;

    for (order = 0; order < 2; order++) {
        perp_world_settings settings = settings_of(0, PERP_ACCURACY_EXACT, 9.81);
        double masses[2] = {order ? ratio : 1, order ? 1 : ratio}, carried = 0.0;
        perp_body bodies[2];
        int32_t k;
        scene s;

        scene_create(&s, &settings);
        floor_of(&s, 0, 0.0);
        for (k = 0; k < 2; k++)
            bodies[k] = box_at(&s, 0, 1.0, 0.0, 0.5 + k, masses[k]);
        worst = larger(worst, unrest(&s, bodies, 2, 2.0, 9.81, 0.01, 5));
        for (k = 0; k < perp_world_contact_count(s.world); k++) {
            perp_world_contact contact = scene_contact(&s, k);

            if (contact.body_a == s.ground || contact.body_b == s.ground)
                carried += contact.impulse[0];
        }
        worst = larger(worst, fabs(carried / (9.81 * 0.01 * (1 + ratio)) - 1));
        scene_close(&s);
    }
    return worst;
}

/* Ten boxes; every other one is heavy, or the last. */
static double tower_of(double ratio, int last)
{
    double worst = 0.0;
    int32_t level;
    int k;

    for (level = 0; level < LEVELS; level++) {
        perp_world_settings settings = settings_of(0, level, 9.81);
        perp_body bodies[10];
        scene s;

        scene_create(&s, &settings);
        floor_of(&s, 0, 0.0);
        for (k = 0; k < 10; k++)
            bodies[k] = box_at(&s, 0, 1.0, 0.0, 0.5 + k, (last ? k == 9 : k % 2) ? ratio : 1.0);
        worst = larger(worst, unrest(&s, bodies, 10, 10.0, 9.81, 0.01, 20));
        scene_close(&s);
    }
    return worst;
}

static double mass_tower(double ratio)
{
    return tower_of(ratio, 0);
}

static double mass_top(double ratio)
{
    return tower_of(ratio, 1);
}

/* A ball of mass R runs into one of mass 1, e = 1; each speed beside its own. */
static double mass_hit(double ratio)
{
    perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 0.0);
    double v[2] = {(ratio - 1) / (ratio + 1), 2 * ratio / (ratio + 1)}, worst = 0.0;
    perp_body balls[2];
    scene s;
    int k;

    scene_create(&s, &settings);
    for (k = 0; k < 2; k++) {
        perp_body_settings body = scene_defaults();

        body.mass = k ? 1.0 : ratio;
        body.position[0] = 1.3 * k;
        body.velocity[0] = 1.0 - k;
        balls[k] = scene_add(&s, &body);
        scene_sphere(&s, balls[k], 0.5, 0.0, 1.0);
    }
    steps(&s, 0.01, 100);
    for (k = 0; k < 2; k++)
        worst = larger(worst, fabs(scene_state(&s, balls[k]).velocity[0] / v[k] - 1));
    scene_close(&s);
    return worst;
}

/* Speeds */

/* A ball, or a box that spins, flies at a plate of a thousandth of its size; how far it gets
 * behind, or what velocity it has left. */
static double speed_plate(double v)
{
    double worst = 0.0;
    int k;

    for (k = 0; k < 2; k++) {
        perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 0.0);
        perp_body_settings body = scene_defaults();
        perp_shape_settings plate = scene_material(0.0, 0.0);
        const double half[3] = {0.0005, 50, 50};
        perp_body_state state;
        perp_body bullet;
        scene s;

        scene_create(&s, &settings);
        SCENE_OK(&s, perp_world_add_box(s.world, NULL, s.ground, half, &plate));
        body.position[0] = -0.77 - 0.003 * v;
        body.velocity[0] = v;
        body.angular_velocity[2] = k ? 3.0 : 0.0;
        bullet = scene_add(&s, &body);
        if (k)
            scene_box(&s, bullet, 0.5, 0.4, 0.3, 0.0, 0.0);
        else
            scene_sphere(&s, bullet, 0.5, 0.0, 0.0);
        steps(&s, 0.01, 60);
        state = scene_state(&s, bullet);
        worst = larger(worst, state.position[0] + (k ? 0.3 : 0.5));
        if (!k)
            worst = larger(worst, fabs(state.velocity[0]));
        scene_close(&s);
    }
    return worst;
}

/* Spin of a body that nothing touches: its energy and angular momentum. */
static double spin_off(double omega, double h, int number)
{
    perp_world_settings settings = settings_of(0, PERP_ACCURACY_STANDARD, 0.0);
    double before[3], after[3], kinetic[2], off;
    perp_body_settings body = scene_settings();
    scene s;

    scene_create(&s, &settings);
    body.inertia[4] = 1.5;
    body.inertia[8] = 2.0;
    body.angular_velocity[0] = 0.1 * omega;
    body.angular_velocity[1] = omega;
    body.angular_velocity[2] = 0.2 * omega;
    scene_add(&s, &body);
    SCENE_OK(&s, perp_world_momentum(s.world, NULL, before));
    SCENE_OK(&s, perp_world_energy(s.world, &kinetic[0], NULL));
    steps(&s, h, number);
    SCENE_OK(&s, perp_world_momentum(s.world, NULL, after));
    SCENE_OK(&s, perp_world_energy(s.world, &kinetic[1], NULL));
    off = fabs(sqrt(scene_dot(after, after) / scene_dot(before, before)) - 1);
    off = larger(off, fabs(kinetic[1] / kinetic[0] - 1));
    scene_close(&s);
    return off;
}

static double speed_spin(double omega)
{
    return spin_off(omega, 0.01, 1000);
}

/* Gravity */

static double gravity_stack(double g)
{
    return stacks_move((stack){.count = 5, .number = 300, .side = 0.3, .g = g, .h = 0.01});
}

static double gravity_slide(double g)
{
    return slide_off(&(slide){.size = 1, .mu = 0.5, .g = g, .v = sqrt(g), .h = 0.01 / sqrt(g)},
                     1.0);
}

static double gravity_threshold(double g)
{
    return threshold_off(0.5, g);
}

/* Places */

static double place_stack(double at)
{
    return stacks_move(
        (stack){.count = 5, .number = 300, .side = 0.3, .g = 9.81, .h = 0.01, .at = at});
}

static double place_slide(double at)
{
    return slide_off(&(slide){.size = 0.3, .mu = 0.5, .g = 9.81, .v = 3, .h = 0.01, .at = at}, 1.0);
}

/* Long runs */

static int whole(void)
{
    const char *text = getenv("PERP_EXTREMES_LONG");

    return text && *text && *text != '0';
}

static double long_stack(double number)
{
    return stack_moves(&(stack){.planar = 1,
                                .accuracy = PERP_ACCURACY_STANDARD,
                                .wakeful = 1,
                                .count = 3,
                                .number = (int)number,
                                .side = 0.3,
                                .g = 9.81,
                                .h = 0.01});
}

static double long_spin(double number)
{
    return spin_off(1.0, 0.01, (int)number);
}

/* A ball with e = 1: the loss of energy. */
static double long_bounce(double number)
{
    perp_world_settings settings = settings_of(1, PERP_ACCURACY_STANDARD, 9.81);
    perp_body_settings body = scene_settings();
    double kinetic, potential;
    scene s;

    scene_create(&s, &settings);
    floor_of(&s, 1, -0.5); /* the energy is that above the ground */
    body.position[1] = 1.0;
    scene_sphere(&s, scene_add(&s, &body), 0.5, 0.0, 1.0);
    steps(&s, 0.01, (int)number);
    SCENE_OK(&s, perp_world_energy(s.world, &kinetic, &potential));
    scene_close(&s);
    return fabs((kinetic + potential) / 9.81 - 1);
}

static double hour_stack(double number)
{
    stack a = {.count = 20, .side = 0.3, .g = 9.81, .h = 0.01, .number = (int)number};

    a.wakeful = whole();
    return stacks_move(a);
}

static double awake_stack(double number)
{
    return stacks_move((stack){.count = 20,
                               .side = 0.3,
                               .g = 9.81,
                               .h = 0.01,
                               .wakeful = 1,
                               .accuracy = PERP_ACCURACY_STANDARD,
                               .number = (int)number});
}

/* Beyond: a number, or a refusal; a good outcome has finite states. */
static double beyond_size(double size)
{
    double worst = size_stack(size);

    return refused || isfinite(worst) ? 0.0 : 1.0;
}

typedef struct row {
    const char *extreme, *scene, *promise;
    double (*measure)(double value);
    double bound;
    double values[8];
    const char *range;
} row;

/* clang-format off */
static const row rows[] = {
    {"sizes", "heap of 9, bits", "those of size 1", bits_differ, 0,
     {-15, -14, -7, -1, 1, 7, 14, 15}, "4^-15 .. 4^15"},
    {"sizes", "stack of 5", "moves by rounding", size_stack, 1e-15,
     {1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9}, "1e-9 .. 1e9 m"},
    {"sizes", "box slides to its stop", "v^2/(2 mu g)", size_slide, 1e-3,
     {1e-9, 1e-6, 1e-3, 1, 1e3, 1e6, 1e9}, "1e-9 .. 1e9 m"},
    {"steps", "stack of 5", "moves by rounding", step_stack, 1e-15,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"steps", "point slides to its stop", "off by a h^2/8", step_slide, 1,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"steps", "ball bounces, e = 1/2", "on its parabola", step_bounce, 1e-9,
     {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1}, "1e-6 .. 1 s"},
    {"friction", "box slides without", "velocity kept, bits", friction_none, 0,
     {1}, "0"},
    {"friction", "point pushed by 1 -+ 1e-9", "rests, moves", friction_threshold, 1e-5,
     {1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6}, "1e-6 .. 1e6"},
    {"friction", "point slides to its stop", "v^2/(2 mu g)", friction_slide, 1e-3,
     {1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6}, "1e-6 .. 1e6"},
    {"masses", "one box on another", "rest, load carried", mass_load, 1e-12,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "tower of 10, in turn", "rests", mass_tower, 0,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "tower of 10 under one", "rests", mass_top, 0,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"masses", "ball hits ball, e = 1", "closed form", mass_hit, 1e-12,
     {1e2, 1e4, 1e6, 1e8, 1e10, 1e12}, "1e2 .. 1e12"},
    {"speeds", "ball and box at thin plate", "stopped before it", speed_plate, 1e-8,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 sizes/s"},
    {"speeds", "box slides without friction", "velocity kept, bits", slides_on, 0,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 sizes/s"},
    {"speeds", "free spin", "energy, momentum kept", speed_spin, 1e-12,
     {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6}, "1 .. 1e6 rad/s"},
    {"gravity", "stack of 5", "moves by rounding", gravity_stack, 1e-15,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"gravity", "point pushed by 1 -+ 1e-9", "rests, moves", gravity_threshold, 1e-5,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"gravity", "box slides to its stop", "v^2/(2 mu g)", gravity_slide, 1e-3,
     {1e-12, 1e-9, 1e-6, 1e-3}, "1e-12 .. 1e-3"},
    {"places", "stack of 5", "moves by rounding", place_stack, 1e-15,
     {1e2, 1e4, 1e6, 1e8}, "1e2 .. 1e8 m"},
    {"places", "box slides to its stop", "v^2/(2 mu g)", place_slide, 1e-3,
     {1e2, 1e4, 1e6, 1e8}, "1e2 .. 1e8 m"},
    {"long", "stack of 3, nothing skipped", "moves by rounding", long_stack, 1e-15,
     {MANY}, "1e6 steps"},
    {"long", "free spin", "energy, momentum kept", long_spin, 1e-9,
     {MANY}, "1e6 steps"},
    {"long", "ball bounces, e = 1", "energy kept", long_bounce, 1e-3,
     {MANY}, "1e6 steps"},
    {"long", "stack of 20, nothing skipped", "moves by rounding", awake_stack, 1e-15,
     {1000}, "10 s"},
    {"long", "stack of 20", "moves by rounding", hour_stack, 1e-15,
     {360000}, "an hour"},
    {"beyond", "stack of 5", "no number is NaN", beyond_size, 0,
     {1e-300, 1e-200, 1e-100, 1e100, 1e200, 1e300}, "1e-300 .. 1e300 m"},
};
/* clang-format on */

enum { ROWS = sizeof rows / sizeof rows[0], WIDE = 240 };

static void outcomes_of(char *text, size_t size)
{
    size_t used = 0;
    unsigned k;

    text[0] = '\0';
    for (k = 0; k < 32; k++)
        if (said >> k & 1u)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "",
                                     perp_outcome_text((int32_t)k));
    if (refused)
        snprintf(text + used, size - used, "%srefused", used ? ", " : "");
}

/* One line; what follows the last '|' is measured and may differ from machine to machine. */
static const char *run_row(char *line, const row *r)
{
    double worst = 0.0;
    const char *verdict;
    char outcomes[100];
    int i;

    said = 0;
    refused = 0;
    for (i = 0; i < 8 && r->values[i] != 0.0; i++)
        worst = larger(worst, r->measure(r->values[i]));
    if (worst <= r->bound)
        verdict = "holds";
    else
        verdict = good() ? "WRONG" : "says so";
    outcomes_of(outcomes, sizeof outcomes);
    snprintf(line, WIDE, "%-8s  %-17s  %-28s  %-21s  %6.0e  %-8s  %s | %.1e", r->extreme, r->range,
             r->scene, r->promise, r->bound, verdict, outcomes, worst);
    return verdict;
}

static void test_row(void **state)
{
    const row *r = *state;
    char line[WIDE], kept[WIDE];
    FILE *file;
    int found = 0;

    if (!strcmp(run_row(line, r), "WRONG"))
        fail_msg("%s", line);
    *strrchr(line, '|') = '\0';
    file = fopen(PERP_TEST_TABLES "/extremes.txt", "r");
    assert_non_null(file);
    while (!found && fgets(kept, sizeof kept, file))
        found = !strncmp(kept, line, strlen(line));
    fclose(file);
    if (!found)
        fail_msg("bench/results/extremes.txt (make extremes) has not: %s", line);
}

static int print_table(void)
{
    int k, wrong = 0;

    printf(
        "The stepper at its extremes (make extremes; tests/extremes/test_world_extremes.c).\n\n"
        "Each row is a scene whose answer is known, run over a range of values: the worst error\n"
        "(behind the last |, of the machine that wrote this) beside what is promised. 'holds' is\n"
        "within the promise, 'says so' is wrong with an outcome that says it. Stacks: all\n"
        "accuracies, plane and space. Errors are relative.\n\n"
        "%-8s  %-17s  %-28s  %-21s  %6s  %-8s  %s\n",
        "", "values", "scene", "promise", "bound", "verdict", "outcomes | error");
    for (k = 0; k < ROWS; k++) {
        char line[WIDE];

        wrong += !strcmp(run_row(line, &rows[k]), "WRONG");
        printf("%s\n", line);
        fflush(stdout);
    }
    return wrong > 0;
}

int main(int argc, char **argv)
{
    struct CMUnitTest tests[ROWS];
    char names[ROWS][100];
    int k;

    if (argc > 1 && !strcmp(argv[1], "table"))
        return print_table();
    for (k = 0; k < ROWS; k++) {
        snprintf(names[k], sizeof names[k], "%s: %s", rows[k].extreme, rows[k].scene);
        tests[k] = (struct CMUnitTest){names[k], test_row, NULL, NULL, (void *)&rows[k]};
    }
    return cmocka_run_group_tests_name("world extremes", tests, NULL, NULL);
}
