/* Rigid bodies: what a step costs, and what is lost when accuracy is turned down.
 *
 * stack: boxes of 1 m on top of each other, at rest; steps of 5 ms, 200 of them or as many as one
 * second of computing allows. Exact: nothing moves. 'creep' is the largest speed of a body at the
 * end, 'sinking' what the top box lost.
 * slide: a box starts at 3 m/s, mu = 0.5. Exact: it stops after v^2 / (2 mu g), in a straight line.
 * 'distance' is the relative error of that if it starts half-way between two edges of a polyhedral
 * cone, 'heading' the angle in degrees between start and stop if it starts a quarter of the way;
 * the exact cone (0 edges) is given the way between the edges of eight. */
#include "measure.h"

typedef struct setting {
    int32_t accuracy, cone;
} setting;

static const double pi = 3.14159265358979323846, g = 9.81;

static perp_world *create(perp_context *context, const setting *chosen)
{
    const double up[] = {0, 0, 1};
    perp_world *world = NULL;
    perp_world_settings settings;
    perp_shape_settings shape;
    perp_world_settings_init(&settings, sizeof settings, 0);
    settings.accuracy = chosen->accuracy;
    settings.cone = chosen->cone;
    perp_shape_settings_init(&shape, sizeof shape);
    shape.friction = 0.5;
    require(perp_world_create(context, &world, &settings) == PERP_OK &&
                perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, &shape) ==
                    PERP_OK,
            perp_context_message(context));
    return world;
}

static perp_body add_box(perp_context *context, perp_world *world, double height, double speed,
                         double heading)
{
    const double half[] = {0.5, 0.5, 0.5};
    perp_body body = 0;
    perp_body_settings settings;
    perp_shape_settings shape;
    perp_body_settings_init(&settings, sizeof settings);
    settings.position[2] = height;
    settings.velocity[0] = speed * cos(heading);
    settings.velocity[1] = speed * sin(heading);
    settings.mass = 1;
    perp_shape_settings_init(&shape, sizeof shape);
    shape.friction = 0.5;
    require(perp_world_add_body(world, &body, &settings) == PERP_OK &&
                perp_world_add_box(world, NULL, body, half, &shape) == PERP_OK,
            perp_context_message(context));
    return body;
}

/* Steps the world, for about `seconds_allowed` at the most; returns steps a second, the largest
 * residual and the iterations of a step. */
static double run(perp_context *context, perp_world *world, double h, int steps,
                  double seconds_allowed, double *residual, double *iterations)
{
    perp_step_result result;
    double start = seconds_now(), seconds = 0;
    int64_t all = 0;
    int done = 0;
    *residual = 0;
    perp_step_result_init(&result, sizeof result);
    while (done < steps && (seconds < seconds_allowed || done < 5)) {
        require(perp_world_step(world, &result, h) == PERP_OK, perp_context_message(context));
        *residual = fmax(*residual, result.residual);
        all += result.iterations;
        done++;
        seconds = seconds_now() - start;
    }
    *iterations = (double)all / done;
    return done / seconds;
}

static void read_body(perp_world *world, perp_body_state *state, perp_body body)
{
    perp_body_state_init(state, sizeof *state);
    require(perp_world_get_body(world, state, body) == PERP_OK, "body lost");
}

static void print_setting(const setting *chosen)
{
    static const char *const words[] = {"fast", "standard", "accurate", "exact"};
    printf(" %-8s %5d", words[chosen->accuracy], (int)chosen->cone);
}

static void measure_stack(perp_context *context, int boxes, const setting *chosen)
{
    enum { MOST = 20 };
    perp_body body[MOST];
    perp_body_state state;
    double residual, iterations, creep = 0;
    perp_world *world = create(context, chosen);
    for (int k = 0; k < boxes; k++)
        body[k] = add_box(context, world, 0.5 + k, 0, 0);
    double speed = run(context, world, 0.005, 200, 1, &residual, &iterations);
    for (int k = 0; k < boxes; k++) {
        read_body(world, &state, body[k]);
        for (int c = 0; c < 3; c++)
            creep = fmax(creep, fmax(fabs(state.velocity[c]), fabs(state.angular_velocity[c])));
    }
    printf("%6d", boxes);
    print_setting(chosen);
    printf(" %10.1f %10.1f %9.1e %9.1e %9.1e\n", speed, iterations, residual, creep,
           boxes - 0.5 - state.position[2]);
    fflush(stdout);
    perp_world_destroy(world);
}

/* Slides a box until it has stopped; returns its state. */
static perp_body_state slide(perp_context *context, double h, double heading, const setting *chosen,
                             double *speed, double *residual, double *iterations)
{
    perp_body_state state;
    perp_world *world = create(context, chosen);
    perp_body body = add_box(context, world, 0.5, 3, heading);
    *speed = run(context, world, h, (int)(1 / h), INFINITY, residual, iterations);
    read_body(world, &state, body);
    require(state.velocity[0] == 0 && state.velocity[1] == 0, "the box did not stop");
    perp_world_destroy(world);
    return state;
}

static void measure_slide(perp_context *context, double h, const setting *chosen)
{
    const double edge = 2 * pi / (chosen->cone > 0 ? chosen->cone : 8),
                 exact = 3 * 3 / (2 * 0.5 * g);
    double speed, residual, iterations;
    perp_body_state half = slide(context, h, 0.5 * edge, chosen, &speed, &residual, &iterations);
    double distance = hypot(half.position[0], half.position[1]) / exact - 1;
    perp_body_state quarter =
        slide(context, h, 0.25 * edge, chosen, &speed, &residual, &iterations);
    double angle = atan2(quarter.position[1], quarter.position[0]) - 0.25 * edge;
    printf("%6g", h);
    print_setting(chosen);
    printf(" %10.1f %10.1f %9.1e %9.1e %9.1e\n", speed, iterations, residual, distance,
           angle * 180 / pi);
    fflush(stdout);
}

int main(void)
{
    static const int stacks[] = {1, 5, 10, 20};
    static const setting settings[] = {
        {PERP_ACCURACY_FAST, 0},  {PERP_ACCURACY_STANDARD, 0}, {PERP_ACCURACY_ACCURATE, 0},
        {PERP_ACCURACY_EXACT, 0}, {PERP_ACCURACY_EXACT, 8},
    };
    static const double steps[] = {1e-2, 1e-3};
    static const int32_t cones[] = {0, 4, 8, 16, 32, 64};
    double gflops, gbytes;
    perp_context *context = NULL;
    require(perp_context_create(&context, NULL) == PERP_OK, "no context");
    print_machine_speed(&gflops, &gbytes);
    printf("\nstack\n%6s %-8s %5s %10s %10s %9s %9s %9s\n", "boxes", "accuracy", "edges", "steps/s",
           "iter./step", "residual", "creep", "sinking");
    for (size_t b = 0; b < sizeof stacks / sizeof *stacks; b++)
        for (size_t k = 0; k < sizeof settings / sizeof *settings; k++)
            measure_stack(context, stacks[b], &settings[k]);
    printf("\nslide\n%6s %-8s %5s %10s %10s %9s %9s %9s\n", "step", "accuracy", "edges", "steps/s",
           "iter./step", "residual", "distance", "heading");
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++)
        for (size_t k = 0; k < sizeof cones / sizeof *cones; k++)
            measure_slide(context, steps[s], &(setting){PERP_ACCURACY_EXACT, cones[k]});
    perp_context_destroy(context);
    return 0;
}
