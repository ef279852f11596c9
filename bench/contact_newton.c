/* Second-order frictional contact (method proximal) on piles with redundant contacts: columns,
 * towers and walls of boxes that touch in 4 points, and balls, mu = 0.5, handed over with M and H.
 *
 * cold: from no impulses; warm: from the solution before every force changed by up to 1e-3. Median
 * of 3 solves, the set-up not counted; iter. is what the result counts. tol is 1e-8, the residual
 * the tested one that was reached. Goals: 60 us a contact cold, 15 us warm.
 *
 * Below, problems drawn at random from the same classes with mass ratios up to 1e8, mu up to 1000,
 * impacts, gaps, and the heavy on the light: how many end as `solved` or at the rounding limit, by
 * proximal alone and by auto, within 2 s each. Some of these may have no solution. */
#include "measure.h"

#include "../tests/piles.h"

enum { REPEATS = 3, DRAWS = 60 };

typedef struct task {
    piles scene;
    perp_contact_solver *solver;
    double *f, *r, *r0;
    perp_contact_result result;
} task;

static void begin(task *t, perp_context *context, const piles_options *options, int32_t method,
                  double limit)
{
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_contact_settings settings;

    piles_make(&t->scene, options);
    require(perp_contact_laws_init(&laws, sizeof laws) == PERP_OK &&
                perp_struct_init(&dynamics, sizeof dynamics) == PERP_OK &&
                perp_contact_settings_init(&settings, sizeof settings) == PERP_OK &&
                perp_struct_init(&t->result, sizeof t->result) == PERP_OK,
            "structs");
    laws.contacts = t->scene.contacts;
    laws.dims = t->scene.dims;
    laws.mu = t->scene.mu;
    dynamics.n = t->scene.n;
    dynamics.M = &t->scene.M;
    dynamics.H = &t->scene.H;
    settings.method = method;
    settings.time_limit = limit;
    require(perp_contact_solver_create(context, &t->solver, &settings) == PERP_OK, "create");
    require(perp_contact_solver_setup_dynamics(t->solver, &laws, &dynamics) == PERP_OK, "setup");
    t->f = require_memory((size_t)t->scene.n * sizeof(double));
    t->r = require_memory((size_t)t->scene.rows * sizeof(double));
    t->r0 = require_memory((size_t)t->scene.rows * sizeof(double));
}

static void end(task *t)
{
    perp_contact_solver_destroy(t->solver);
    free(t->f);
    free(t->r);
    free(t->r0);
    piles_destroy(&t->scene);
}

/* Seconds of one solve. */
static double solve(task *t, const double *f, const double *r0)
{
    const perp_contact_answer answer = {.struct_size = sizeof answer, .r = t->r};
    double start = seconds_now();

    require(perp_contact_solver_solve_dynamics(t->solver, &answer, &t->result, f, t->scene.w, NULL,
                                               r0) == PERP_OK,
            "solve");
    return seconds_now() - start;
}

static void print_part(const task *t, double *seconds)
{
    printf(" %5d %8.1f %9.1e %-15s", (int)t->result.iterations,
           1e6 * median(seconds, REPEATS) / t->scene.contacts, t->result.residual,
           perp_outcome_text(t->result.outcome));
}

static void measure(perp_context *context, int class, int contacts, int motion)
{
    piles_options options = piles_defaults();
    double seconds[REPEATS];
    task t;

    options.class = class;
    options.contacts = contacts;
    options.motion = motion;
    options.seed = 7;
    begin(&t, context, &options, PERP_CONTACT_METHOD_PROXIMAL, 2.0);
    for (int k = 0; k < REPEATS; k++)
        seconds[k] = solve(&t, t.scene.f, NULL);
    printf("%-7s %-5s %6d %6d", piles_class_text(class), motion == PILES_REST ? "rest" : "push",
           t.scene.contacts, t.scene.bodies);
    print_part(&t, seconds);
    memcpy(t.r0, t.r, (size_t)t.scene.rows * sizeof(double));
    for (int32_t i = 0; i < t.scene.n; i++)
        t.f[i] = t.scene.f[i] * (1.0 + 1e-3 * sin(i));
    for (int k = 0; k < REPEATS; k++)
        seconds[k] = solve(&t, t.f, t.r0);
    print_part(&t, seconds);
    printf("\n");
    fflush(stdout);
    end(&t);
}

static void draw(perp_context *context, int32_t method, const char *name)
{
    int solved = 0, precise = 0;
    double total = 0.0;

    for (int k = 0; k < DRAWS; k++) {
        piles_options options = piles_draw(UINT64_C(900000) + (uint64_t)k, 60);
        task t;

        begin(&t, context, &options, method, 2.0);
        total += solve(&t, t.scene.f, NULL) / t.scene.contacts;
        solved += t.result.outcome == PERP_OUTCOME_SOLVED ||
                  t.result.outcome == PERP_OUTCOME_ROUNDING_LIMIT;
        precise += t.result.outcome == PERP_OUTCOME_ROUNDING_LIMIT || t.result.residual <= 1e-12;
        end(&t);
    }
    printf(
        "%-8s solved %d of %d, to 1e-12 or the rounding limit %d, %.0f us a contact on average\n",
        name, solved, DRAWS, precise, 1e6 * total / DRAWS);
    fflush(stdout);
}

int main(void)
{
    static const int sizes[] = {50, 200, 1000};
    perp_context *context;
    double gflops, gbytes;

    require(perp_context_create(&context, NULL) == PERP_OK, "context");
    print_machine_speed(&gflops, &gbytes);
    printf("\n%27s %-40s %s\n", "", " cold", "warm");
    printf("%-7s %-5s %6s %6s %5s %8s %9s %-15s %5s %8s %9s %s\n", "scene", "", "conts", "bodies",
           "iter.", "us/cont", "residual", "outcome", "iter.", "us/cont", "residual", "outcome");
    for (int motion = PILES_REST; motion <= PILES_PUSH; motion++)
        for (int class = PILES_COLUMN; class <= PILES_BALLS; class ++)
            for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
                measure(context, class, sizes[k], motion);
    printf("\n");
    draw(context, PERP_CONTACT_METHOD_PROXIMAL, "proximal");
    draw(context, PERP_CONTACT_METHOD_AUTO, "auto");
    perp_context_destroy(context);
    return 0;
}
