/* A ball of 0.1 kg goes at 300 m/s into a stack of eight boxes of 2 kg. A step of 5 ms is 1.5 m of
 * its way: it meets the box that it would have passed six times. bullet.py does the same in Python.
 */
#include <perp/perp.h>

#include <stdio.h>

enum { BOXES = 8, HIT = 3 };

static perp_status build(perp_world *world, perp_body *bodies)
{
    const double up[] = {0, 1, 0}, half[] = {0.125, 0.125, 0};
    perp_status status = perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, NULL);

    for (int k = 0; k <= BOXES && status == PERP_OK; k++) {
        perp_body_settings body;

        perp_body_settings_init(&body, sizeof body);
        body.mass = k < BOXES ? 2 : 0.1;
        body.position[0] = k < BOXES ? 0 : -1;
        body.position[1] = k < BOXES ? 0.125 + 0.25 * k : 0.89;
        body.velocity[0] = k < BOXES ? 0 : 300;
        status = perp_world_add_body(world, &bodies[k], &body);
        if (status == PERP_OK)
            status = k < BOXES ? perp_world_add_box(world, NULL, bodies[k], half, NULL)
                               : perp_world_add_sphere(world, NULL, bodies[k], 0.015, NULL);
    }
    return status;
}

static perp_status run(perp_world *world, const perp_body *bodies)
{
    perp_body_state ball, box;
    perp_status status = PERP_OK;

    perp_body_state_init(&ball, sizeof ball);
    perp_body_state_init(&box, sizeof box);
    for (int step = 1; step <= 3 && status == PERP_OK; step++) {
        double momentum[3];

        status = perp_world_step(world, NULL, 5e-3);
        if (status == PERP_OK)
            status = perp_world_get_body(world, &ball, bodies[BOXES]);
        if (status == PERP_OK)
            status = perp_world_get_body(world, &box, bodies[HIT]);
        if (status == PERP_OK)
            status = perp_world_momentum(world, momentum, NULL);
        if (status == PERP_OK)
            printf("step %d: ball %.2f m/s, the box that it hits %.2f m/s, together %.2f kg m/s\n",
                   step, ball.velocity[0], box.velocity[0], momentum[0]);
    }
    return status;
}

int main(void)
{
    perp_context *context = NULL;
    perp_world *world = NULL;
    perp_world_settings settings;
    perp_body bodies[BOXES + 1];
    perp_status status = perp_context_create(&context, NULL);

    perp_world_settings_init(&settings, sizeof settings, 1);
    settings.friction = 0.4;
    if (status == PERP_OK)
        status = perp_world_create(context, &world, &settings);
    if (status == PERP_OK)
        status = build(world, bodies);
    if (status == PERP_OK)
        status = run(world, bodies);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : perp_status_text(status));
    perp_world_destroy(world);
    perp_context_destroy(context);
    return status != PERP_OK;
}
