/* A brick slides down a ramp of 10 degrees, slows down by friction, and stops.
 *
 * Coulomb's law takes m g (mu cos - sin) off its momentum every second, so it stops after
 * v0 / (g (mu cos - sin)) seconds, and then its velocity is 0, not almost 0. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

static const double slope = 10 * 3.14159265358979323846 / 180, mu = 0.3, v0 = 2, h = 0.001;

/* The ramp falls towards +x; the brick lies on it. */
static perp_status build(perp_world *world, perp_body *brick)
{
    const double normal[] = {sin(slope), cos(slope), 0}, half_extents[] = {0.2, 0.1, 0};
    perp_body_settings body;
    perp_shape_settings shape;
    perp_status status;

    perp_body_settings_init(&body, sizeof body);
    body.mass = 1;
    body.inertia[8] = body.mass * (0.4 * 0.4 + 0.2 * 0.2) / 12;
    body.angle = -slope;
    body.position[0] = half_extents[1] * normal[0];
    body.position[1] = half_extents[1] * normal[1];
    body.velocity[0] = v0 * cos(slope);
    body.velocity[1] = -v0 * sin(slope);
    perp_shape_settings_init(&shape, sizeof shape);
    shape.friction = mu;

    status = perp_world_add_plane(world, NULL, perp_world_ground(world), normal, 0, &shape);
    if (status == PERP_OK)
        status = perp_world_add_body(world, brick, &body);
    if (status == PERP_OK)
        status = perp_world_add_box(world, NULL, *brick, half_extents, &shape);
    return status;
}

/* Steps for three seconds and prints when and where the brick stopped. */
static perp_status run(perp_world *world, perp_body brick)
{
    const double stop = v0 / (9.81 * (mu * cos(slope) - sin(slope)));
    perp_body_state start, state;
    perp_status status;
    int steps, stopped = 0;

    perp_body_state_init(&start, sizeof start);
    perp_body_state_init(&state, sizeof state);
    status = perp_world_get_body(world, &start, brick);
    for (steps = 1; steps <= 3000 && status == PERP_OK; steps++) {
        status = perp_world_step(world, NULL, h);
        if (status == PERP_OK)
            status = perp_world_get_body(world, &state, brick);
        if (state.velocity[0] != 0 || state.velocity[1] != 0 || state.angular_velocity[2] != 0)
            stopped = 0;
        else if (stopped == 0)
            stopped = steps;
    }
    if (status != PERP_OK)
        return status;
    printf("stopped after %.3f s and %.4f m, by the formula after %.3f s and %.4f m\n", h * stopped,
           hypot(state.position[0] - start.position[0], state.position[1] - start.position[1]),
           stop, v0 * stop / 2);
    printf("velocity after 3 s: (%g, %g)\n", state.velocity[0], state.velocity[1]);
    return PERP_OK;
}

int main(void)
{
    perp_context *context = NULL;
    perp_world *world = NULL;
    perp_world_settings settings;
    perp_body brick;
    perp_status status = perp_context_create(&context, NULL);

    if (status != PERP_OK) {
        fprintf(stderr, "%s\n", perp_status_text(status));
        return 1;
    }
    perp_world_settings_init(&settings, sizeof settings, 1);
    status = perp_world_create(context, &world, &settings);
    if (status == PERP_OK)
        status = build(world, &brick);
    if (status == PERP_OK)
        status = run(world, brick);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", perp_context_message(context));
    perp_world_destroy(world);
    perp_context_destroy(context);
    return status != PERP_OK;
}
