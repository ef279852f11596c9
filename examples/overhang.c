/* Bricks that lean out over the edge of a table: the k-th from the top may reach out over the next
 * by 1/(2k) of its length. With 0.99 of each of these the stack stands, and its velocity is 0;
 * with 1.01 it falls. overhang.py does the same in Python. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { BRICKS = 10 };

/* Bricks of 1 x 0.25 m, the lowest first, on a table that ends at x = 0 at height 0. */
static perp_status build(perp_world *world, perp_body *bricks, double share)
{
    const double table[] = {5, 0.5, 0}, half[] = {0.5, 0.125, 0};
    perp_shape_settings shape;
    perp_status status;
    double edge = share / (2.0 * BRICKS);

    perp_shape_settings_init(&shape, sizeof shape);
    shape.offset[0] = -5;
    shape.offset[1] = -0.5;
    status = perp_world_add_box(world, NULL, perp_world_ground(world), table, &shape);
    for (int k = BRICKS; k > 0 && status == PERP_OK; k--) {
        perp_body_settings body;
        perp_body *brick = &bricks[BRICKS - k];

        perp_body_settings_init(&body, sizeof body);
        body.mass = 1;
        body.position[0] = edge - 0.5;
        body.position[1] = 0.25 * (BRICKS - k) + 0.125;
        status = perp_world_add_body(world, brick, &body);
        if (status == PERP_OK)
            status = perp_world_add_box(world, NULL, *brick, half, NULL);
        edge += k > 1 ? share / (2.0 * (k - 1)) : 0;
    }
    return status;
}

/* Steps for two seconds; prints what the top brick did. */
static perp_status run(perp_world *world, perp_body top, double share)
{
    perp_body_state start, state;
    perp_status status;

    perp_body_state_init(&start, sizeof start);
    perp_body_state_init(&state, sizeof state);
    status = perp_world_get_body(world, &start, top);
    for (int step = 0; step < 200 && status == PERP_OK; step++)
        status = perp_world_step(world, NULL, 0.01);
    if (status == PERP_OK)
        status = perp_world_get_body(world, &state, top);
    if (status == PERP_OK)
        printf("%.2f of the overhang: the top brick moved by (%.3g, %.3g), velocity (%.3g, %.3g)\n",
               share, state.position[0] - start.position[0], state.position[1] - start.position[1],
               fabs(state.velocity[0]), fabs(state.velocity[1]));
    return status;
}

int main(void)
{
    const double shares[] = {0.99, 1.01};
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, NULL);

    if (status != PERP_OK) {
        fprintf(stderr, "%s\n", perp_status_text(status));
        return 1;
    }
    for (int k = 0; k < 2 && status == PERP_OK; k++) {
        perp_world *world = NULL;
        perp_world_settings settings;
        perp_body bricks[BRICKS];

        perp_world_settings_init(&settings, sizeof settings, 1);
        settings.friction = 0.5;
        status = perp_world_create(context, &world, &settings);
        if (status == PERP_OK)
            status = build(world, bricks, shares[k]);
        if (status == PERP_OK)
            status = run(world, bricks[BRICKS - 1], shares[k]);
        if (status != PERP_OK)
            fprintf(stderr, "%s\n", perp_context_message(context));
        perp_world_destroy(world);
    }
    perp_context_destroy(context);
    return status != PERP_OK;
}
