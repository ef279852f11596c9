#include "extreme_scenes.h"

#include <math.h>

#include "suite.h"

#include "check.h"
#include "world/scene.h"

enum { LEVELS = 4 };

struct extreme_said extreme_said;

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

static void steps(scene *s, double h, int count)
{
    perp_step_result result;
    int k;

    perp_struct_init(&result, sizeof result);
    for (k = 0; k < count && !extreme_said.refused; k++) {
        perp_status status = perp_world_step(s->world, &result, h);

        if (status == PERP_ERROR_NOT_FINITE)
            extreme_said.refused = 1;
        else if (status != PERP_OK)
            fail_msg("step: %s", perp_context_message(s->context));
        else
            extreme_said.outcomes |= 1u << result.outcome;
    }
}

static double largest(const double *x, int count)
{
    double most = 0.0;
    int i;

    for (i = 0; i < count; i++)
        check_raise(&most, fabs(x[i]));
    return most;
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
    extreme_said.refused = extreme_said.refused || status == PERP_ERROR_NOT_FINITE;
    if (status != PERP_OK && !extreme_said.refused)
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
        check_raise(&worst, largest(after.position, 3) / size);
        check_raise(&worst, largest(after.velocity, 3) / sqrt(g * size));
        check_raise(&worst, largest(after.angular_velocity, 3) / sqrt(g / size));
    }
    return worst;
}

double extreme_stack_moves(const extreme_stack *a)
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

double extreme_stacks_move(extreme_stack a)
{
    double worst = 0.0;
    int32_t level;

    for (level = 2 * a.accuracy; level < 2 * LEVELS; level++) {
        a.accuracy = level / 2;
        a.planar = level % 2;
        check_raise(&worst, extreme_stack_moves(&a));
    }
    return worst;
}

double extreme_slide_off(const extreme_slide *a, double allowed)
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

double extreme_threshold_off(double mu, double g)
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
        check_raise(&worst, k ? fabs(v / (1e-9 * mu * g * 10 * h) - 1) : !scene_rests(&s, body));
        scene_close(&s);
    }
    return worst;
}

/* The states of the heap at 4^k, by powers of two back to k = 0. */
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

double extreme_bits_differ(double k)
{
    double one[117], scaled[117];
    int i, differ = 0;

    heap(one, 0);
    heap(scaled, (int)k);
    for (i = 0; i < 117; i++)
        differ += one[i] != scaled[i];
    return differ;
}

double extreme_bounce_off(double h)
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

double extreme_slides_on(double v)
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

double extreme_load_off(double ratio)
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
        check_raise(&worst, unrest(&s, bodies, 2, 2.0, 9.81, 0.01, 5));
        for (k = 0; k < perp_world_contact_count(s.world); k++) {
            perp_world_contact contact = scene_contact(&s, k);

            if (contact.body_a == s.ground || contact.body_b == s.ground)
                carried += contact.impulse[0];
        }
        check_raise(&worst, fabs(carried / (9.81 * 0.01 * (1 + ratio)) - 1));
        scene_close(&s);
    }
    return worst;
}

double extreme_tower_moves(double ratio, int last)
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
        check_raise(&worst, unrest(&s, bodies, 10, 10.0, 9.81, 0.01, 20));
        scene_close(&s);
    }
    return worst;
}

double extreme_hit_off(double ratio)
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
        check_raise(&worst, fabs(scene_state(&s, balls[k]).velocity[0] / v[k] - 1));
    scene_close(&s);
    return worst;
}

double extreme_plate_passed(double v)
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
        check_raise(&worst, state.position[0] + (k ? 0.3 : 0.5));
        if (!k)
            check_raise(&worst, fabs(state.velocity[0]));
        scene_close(&s);
    }
    return worst;
}

double extreme_spin_off(double omega, double h, int number)
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
    check_raise(&off, fabs(kinetic[1] / kinetic[0] - 1));
    scene_close(&s);
    return off;
}

double extreme_energy_lost(double number)
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
