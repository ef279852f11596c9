/* Bodies at the start of a step: where they are turned, how hard they are to move, and the
 * velocities that forces alone would give them. */
#include "world/step.h"

void perp__rotation_of(const perp_world *world, const perp__state *state, double *R)
{
    double c, s;

    if (!world->settings.planar) {
        perp__quaternion_matrix(R, state->orientation);
        return;
    }
    c = cos(state->angle);
    s = sin(state->angle);
    memset(R, 0, 9 * sizeof *R);
    R[0] = R[4] = c;
    R[1] = -s;
    R[3] = s;
    R[8] = 1.0;
}

void perp__place_shape(const perp__shape *shape, const double *position, const double *R,
                       bool turned, perp__placed *placed)
{
    double offset[3];

    placed->geometry = &shape->geometry;
    placed->radius = shape->geometry.kind == PERP__PLANE ? INFINITY : shape->radius;
    perp__apply3(offset, R, shape->offset);
    perp__along3(placed->position, position, 1.0, offset);
    if (turned)
        perp__multiply3(placed->rotation, R, shape->rotation);
}

void perp__place_body(perp_world *world, const perp__state *states, int32_t body, bool turned)
{
    double *R = world->step.motions[body].rotation;

    world->step.motions[body].placed = world->step.coasting + (states == world->step.next);
    if (turned)
        perp__rotation_of(world, &states[body], R);
    for (int32_t i = world->bodies.all[body].first_shape; i >= 0;
         i = world->shapes.all[i].next_of_body)
        perp__place_shape(&world->shapes.all[i], states[body].position, R, turned,
                          &world->step.placed[i]);
}

void perp__place(perp_world *world, const perp__state *states)
{
    for (int32_t i = 0; i < world->sleep.awake_count; i++) {
        perp__place_body(world, states, world->sleep.awake[i], 1);
        world->step.motions[world->sleep.awake[i]].placed = 0;
    }
}

/* One Newton step on
 *   f(w+) = I (w+ - w) + h m x (I m) - h torque,   m = (w+ + w)/2,
 *   f'    = I + h/2 ([m]x I - [I m]x).
 * Returns the size of the change relative to w+, or -1 where f' is singular. */
static double newton_step(const double *I, double h, const double *w, const double *torque,
                          double *w_next)
{
    double m[3], Im[3], cross[3], f[3], change[3], difference[3], jacobian[9];
    double inverse[3][3], determinant;

    for (int32_t i = 0; i < 3; i++) {
        m[i] = 0.5 * (w_next[i] + w[i]);
        difference[i] = w_next[i] - w[i];
    }
    perp__apply3(Im, I, m);
    perp__cross(cross, m, Im);
    perp__apply3(f, I, difference);
    for (int32_t i = 0; i < 3; i++)
        f[i] += h * (cross[i] - torque[i]);
    for (int32_t j = 0; j < 3; j++) {
        const double column[3] = {I[j], I[3 + j], I[6 + j]};
        const double unit[3] = {j == 0, j == 1, j == 2};
        double turned[3], crossed[3];

        perp__cross(turned, m, column);
        perp__cross(crossed, Im, unit);
        for (int32_t i = 0; i < 3; i++)
            jacobian[3 * i + j] = I[3 * i + j] + 0.5 * h * (turned[i] - crossed[i]);
    }
    /* Cramer's rule */
    perp__cross(inverse[0], jacobian + 3, jacobian + 6);
    perp__cross(inverse[1], jacobian + 6, jacobian);
    perp__cross(inverse[2], jacobian, jacobian + 3);
    determinant = perp__dot3(jacobian, inverse[0]);
    if (determinant == 0.0)
        return -1.0;
    for (int32_t i = 0; i < 3; i++)
        change[i] =
            (inverse[0][i] * f[0] + inverse[1][i] * f[1] + inverse[2][i] * f[2]) / determinant;
    perp__subtract3(w_next, w_next, change);
    return perp__length3(change) / (perp__length3(w_next) + perp__length3(w));
}

/* Implicit midpoint rule for I w' = -w x I w + torque. Torque-free it conserves w'I w and |I w|,
 * being quadratic. Where Newton's method does not settle (far more than a radian a step) the
 * gyroscopic term is left out: the velocity stays bounded. */
void perp__euler_step(const perp__body *body, double h, const double *w, const double *torque,
                      double *w_next)
{
    double change[3], size = -1.0, previous = INFINITY;

    perp__apply3(change, body->inverse_inertia, torque);
    perp__along3(w_next, w, h, change);
    if (body->spherical || (perp__is_zero3(w) && perp__is_zero3(torque)))
        return;
    for (int32_t k = 0; k < DBL_MANT_DIG; k++) { /* what halves comes to rounding */
        size = newton_step(body->inertia, h, w, torque, w_next);
        if (!(size > 0.0) || (size <= PERP__SUM_ROUNDING && size >= 0.5 * previous))
            break; /* singular, not a number, or down to rounding */
        previous = size;
    }
    if (!(size >= 0.0 && size <= PERP__SUM_ROUNDING))
        perp__along3(w_next, w, h, change);
}

/* v_f = v + h (gravity + force / m); of a ball also w_f. */
void perp__push_freely(const perp_world *world, int32_t i, double h, double *free)
{
    const perp__body *body = &world->bodies.all[i];
    const perp__state *state = &world->bodies.states[i];
    double change[3] = {0.0, 0.0, 0.0};

    for (int32_t k = 0; k < 3; k++)
        free[k] = state->velocity[k] +
                  h * (world->settings.gravity[k] + body->inverse_mass * state->force[k]);
    if (!body->spherical)
        return;
    if (!perp__is_zero3(state->torque))
        perp__apply3(change, body->inverse_inertia, state->torque);
    perp__copy3(free + 3, state->angular_velocity);
    perp__add3(free + 3, h, change);
}

void perp__keep_placed(perp_world *world, int32_t body)
{
    if (world->step.motions[body].placed != world->step.coasting)
        perp__place_body(world, world->bodies.states, body, 1);
}

bool perp__start_motion(perp_world *world, int32_t body, double h)
{
    const perp__state *state = &world->bodies.states[body];
    perp__motion *motion = &world->step.motions[body];
    perp__role *role = &world->step.roles[body];
    double w[3], w_next[3], torque[3];

    perp__keep_placed(world, body);
    for (int32_t k = 0; k < 3; k++) {
        motion->start[k] = motion->free[k] = state->velocity[k];
        motion->start[3 + k] = motion->free[3 + k] = state->angular_velocity[k];
    }
    role->dynamic = (int8_t)perp__is_dynamic(world, body);
    if (role->dynamic)
        perp__push_freely(world, body, h, motion->free);
    if (role->dynamic && !world->bodies.all[body].spherical) {
        /* w_f from Euler's equations with the frame frozen */
        perp__apply_transposed3(w, motion->rotation, state->angular_velocity);
        perp__apply_transposed3(torque, motion->rotation, state->torque);
        perp__euler_step(&world->bodies.all[body], h, w, torque, w_next);
        perp__apply3(motion->free + 3, motion->rotation, w_next);
    }
    for (int32_t k = 0; k < 6; k++) {
        const double free = motion->free[k];

        motion->after[k] = free;
        motion->moving[k] = motion->tried[k] = 0.5 * (motion->start[k] + free);
        motion->trial[k] = motion->last[k] = motion->start[k];
    }
    motion->enclosed = world->step.moved[body] = 1; /* in the first round */
    motion->spare = INFINITY;
    motion->room = 0.0;
    role->island = -1;
    role->touched = role->jointed = role->swept = role->far = role->put = 0;
    memset(motion->shift, 0, sizeof motion->shift); /* of what stays where it is, too */
    motion->unspent = 0.0;
    memset(&motion->verdict, 0, sizeof motion->verdict);
    return perp__is_finite3(motion->free) && perp__is_finite3(motion->free + 3);
}
