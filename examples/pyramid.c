/* A pyramid of 28 boxes at four accuracies: at rest it moves by 0 at each; then a ball of 20 kg
 * hits it at 30 m/s, and the residual tells what the budget left. pyramid.py draws the picture. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { ROWS = 7, BOXES = ROWS * (ROWS + 1) / 2 };

static perp_status build(perp_world *world)
{
    const double up[] = {0, 1, 0}, half[] = {0.5, 0.5, 0};
    perp_status status = perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, NULL);

    for (int row = 0; row < ROWS; row++)
        for (int k = 0; k < ROWS - row && status == PERP_OK; k++) {
            perp_body_settings body;
            perp_body box = 0;

            perp_body_settings_init(&body, sizeof body);
            body.mass = 1;
            body.position[0] = 1.05 * (k - (ROWS - row - 1) / 2.0);
            body.position[1] = 0.5 + row;
            status = perp_world_add_body(world, &box, &body);
            if (status == PERP_OK)
                status = perp_world_add_box(world, NULL, box, half, NULL);
        }
    return status;
}

static perp_status add_ball(perp_world *world)
{
    perp_body_settings body;
    perp_body ball = 0;
    perp_status status;

    perp_body_settings_init(&body, sizeof body);
    body.mass = 20;
    body.position[0] = -6;
    body.position[1] = 2.3;
    body.velocity[0] = 30;
    status = perp_world_add_body(world, &ball, &body);
    return status == PERP_OK ? perp_world_add_sphere(world, NULL, ball, 0.5, NULL) : status;
}

/* Steps; the largest residual, and the largest velocity at the end. */
static perp_status run(perp_world *world, double *residual, double *fastest, int steps)
{
    perp_step_result result;
    perp_world_states states;
    perp_status status = PERP_OK;

    *residual = *fastest = 0;
    perp_struct_init(&result, sizeof result);
    for (int step = 0; step < steps && status == PERP_OK; step++) {
        status = perp_world_step(world, &result, 0.01);
        *residual = fmax(*residual, result.residual);
    }
    perp_struct_init(&states, sizeof states);
    if (status == PERP_OK)
        status = perp_world_get_states(world, &states);
    for (int k = 0; k < states.slots && status == PERP_OK; k++) {
        const double *v = (const double *)(const void *)((const char *)states.velocity +
                                                         (size_t)k * states.twist_stride);

        *fastest = fmax(*fastest, hypot(v[0], v[1]));
    }
    return status;
}

int main(void)
{
    static const char *const names[] = {"fast", "standard", "accurate", "exact"};
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, NULL);

    for (int level = PERP_ACCURACY_FAST; level <= PERP_ACCURACY_EXACT && status == PERP_OK;
         level++) {
        double residual, fastest, resting, unused;
        perp_world *world = NULL;
        perp_world_settings settings;

        perp_world_settings_init(&settings, sizeof settings, 1);
        settings.friction = 0.5;
        settings.accuracy = level;
        status = perp_world_create(context, &world, &settings);
        if (status == PERP_OK)
            status = build(world);
        if (status == PERP_OK)
            status = run(world, &unused, &resting, 100);
        if (status == PERP_OK)
            status = add_ball(world);
        if (status == PERP_OK)
            status = run(world, &residual, &fastest, 50);
        if (status == PERP_OK)
            printf("%-8s at rest: velocity %g; after the hit: %.0f m/s, residual %.0e\n",
                   names[level], resting, fastest, residual);
        perp_world_destroy(world);
    }
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : perp_status_text(status));
    perp_context_destroy(context);
    return status != PERP_OK;
}
