/* A wall of bricks stands with velocity 0; then bricks of its lowest course are taken out, until it
 * comes down. wall.py does the same in Python. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

enum { COURSES = 6, MOST = COURSES * 6 };

/* A running bond: each second course begins and ends with half a brick. Returns how many. */
static int build(perp_world *world, perp_body *bricks, double *heights)
{
    const double up[] = {0, 1, 0}, length = 0.25, height = 0.125;
    int count = 0;

    if (perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, NULL) != PERP_OK)
        return 0;
    for (int course = 0; course < COURSES; course++) {
        int odd = course % 2;
        double x = 0;

        for (int k = 0; k < 5 + odd; k++, count++) {
            double l = odd && (k == 0 || k == 5) ? length / 2 : length;
            const double half[] = {l / 2 - 5e-4, height / 2, 0};
            perp_shape_settings shape;
            perp_body_settings body;

            perp_shape_settings_init(&shape, sizeof shape);
            perp_body_settings_init(&body, sizeof body);
            shape.density = 1800 * 0.12; /* kg / m^2 */
            body.position[0] = x + l / 2;
            body.position[1] = heights[count] = height * (course + 0.5);
            if (perp_world_add_body(world, &bricks[count], &body) != PERP_OK ||
                perp_world_add_box(world, NULL, bricks[count], half, &shape) != PERP_OK)
                return 0;
            x += l;
        }
    }
    return count;
}

/* Steps for 1.5 s; says how many of the bricks above the lowest course lie lower than they did. */
static perp_status run(perp_world *world, const perp_body *bricks, const double *heights, int count,
                       int out)
{
    perp_status status = PERP_OK;
    double fastest = 0;
    int fell = 0;

    for (int step = 0; step < 150 && status == PERP_OK; step++)
        status = perp_world_step(world, NULL, 0.01);
    for (int k = 5; k < count && status == PERP_OK; k++) {
        perp_body_state state;

        perp_body_state_init(&state, sizeof state);
        status = perp_world_get_body(world, &state, bricks[k]);
        fell += state.position[1] < heights[k] - 0.0625;
        fastest = fmax(fastest, hypot(state.velocity[0], state.velocity[1]));
    }
    if (status == PERP_OK)
        printf("%d out: %d bricks above fell, largest velocity %g\n", out, fell, fastest);
    return status;
}

int main(void)
{
    perp_context *context = NULL;
    perp_world *world = NULL;
    perp_world_settings settings;
    perp_body bricks[MOST];
    double heights[MOST];
    perp_status status = perp_context_create(&context, NULL);
    int count;

    perp_world_settings_init(&settings, sizeof settings, 1);
    settings.friction = 0.6;
    settings.accuracy = PERP_ACCURACY_EXACT;
    if (status == PERP_OK)
        status = perp_world_create(context, &world, &settings);
    count = status == PERP_OK ? build(world, bricks, heights) : 0;
    for (int out = 0; out <= 3 && count && status == PERP_OK; out++) {
        if (out)
            status = perp_world_remove_body(world, bricks[3 - out]);
        if (status == PERP_OK)
            status = run(world, bricks, heights, count, out);
    }
    if (status != PERP_OK || !count)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : perp_status_text(status));
    perp_world_destroy(world);
    perp_context_destroy(context);
    return status != PERP_OK || !count;
}
