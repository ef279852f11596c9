/* A row of dominoes: the first is tipped over, each falls against the next, and in the end all lie
 * still. dominoes.py does the same in Python, and times the wave. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { COUNT = 20 };

static perp_status build(perp_world *world, perp_body *dominoes)
{
    const double up[] = {0, 1, 0}, half[] = {0.004, 0.024, 0};
    perp_status status = perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, NULL);

    for (int k = 0; k < COUNT && status == PERP_OK; k++) {
        perp_body_settings body;

        perp_body_settings_init(&body, sizeof body);
        body.mass = 0.01;
        body.position[0] = 0.02 * k;
        body.position[1] = half[1];
        if (k == 0) { /* 5 rad/s about its lower right edge */
            body.angular_velocity[2] = -5;
            body.velocity[0] = 5 * half[1];
            body.velocity[1] = 5 * half[0];
        }
        status = perp_world_add_body(world, &dominoes[k], &body);
        if (status == PERP_OK)
            status = perp_world_add_box(world, NULL, dominoes[k], half, NULL);
    }
    return status;
}

static perp_status run(perp_world *world, const perp_body *dominoes)
{
    perp_status status = PERP_OK;
    double fastest = 0;
    int fell = 0;

    for (int step = 0; step < 2000 && status == PERP_OK; step++)
        status = perp_world_step(world, NULL, 1e-3);
    for (int k = 0; k < COUNT && status == PERP_OK; k++) {
        perp_body_state state;

        perp_body_state_init(&state, sizeof state);
        status = perp_world_get_body(world, &state, dominoes[k]);
        fell += state.angle < -0.25;
        fastest = fmax(fastest, hypot(state.velocity[0], state.velocity[1]));
    }
    if (status == PERP_OK)
        printf("%d of %d fell; largest velocity at the end: %g m/s\n", fell, COUNT, fastest);
    return status;
}

int main(void)
{
    perp_context *context = NULL;
    perp_world *world = NULL;
    perp_world_settings settings;
    perp_body dominoes[COUNT];
    perp_status status = perp_context_create(&context, NULL);

    perp_world_settings_init(&settings, sizeof settings, 1);
    settings.friction = 0.3;
    if (status == PERP_OK)
        status = perp_world_create(context, &world, &settings);
    if (status == PERP_OK)
        status = build(world, dominoes);
    if (status == PERP_OK)
        status = run(world, dominoes);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : perp_status_text(status));
    perp_world_destroy(world);
    perp_context_destroy(context);
    return status != PERP_OK;
}
