/* What a call goes through: every function of libperp and libperp-mechanism that it enters, when it
 * does so for the first time, with its depth. scripts/walk builds the libraries for that, runs this
 * and names the functions; docs/architecture.md follows the walks.
 *
 *   walk lcp|box|pile|rest|theta
 */
#define _GNU_SOURCE
#include <dlfcn.h>

#include <perp/mechanism.h>

#include "measure.h"

enum { MOST = 4096, SIZE = 20, ROWS = 7 };

void __cyg_profile_func_enter(void *function, void *caller);
void __cyg_profile_func_exit(void *function, void *caller);

static void *known[MOST];
static int count, depth, follows;

__attribute__((no_instrument_function)) void __cyg_profile_func_enter(void *function, void *caller)
{
    Dl_info info;

    (void)caller;
    depth += follows;
    if (!follows || count == MOST)
        return;
    for (int i = 0; i < count; i++)
        if (known[i] == function)
            return;
    known[count++] = function;
    follows = 0;
    if (dladdr(function, &info))
        printf("%d %s %#lx\n", depth, info.dli_fname,
               (unsigned long)((char *)function - (char *)info.dli_fbase));
    follows = 1;
}

__attribute__((no_instrument_function)) void __cyg_profile_func_exit(void *function, void *caller)
{
    (void)function, (void)caller;
    depth -= follows;
}

/* A positive definite M, half of whose variables are positive. */
static void walk_lcp(perp_context *context)
{
    double M[SIZE * SIZE], q[SIZE], z[SIZE], w[SIZE];
    perp_lcp_result result;
    perp_matrix view;
    const perp_lcp_problem problem = {.struct_size = sizeof problem, .M = &view, .q = q};
    perp_status status;

    for (int i = 0; i < SIZE; i++) {
        q[i] = i % 2 ? 1.0 : -1.0;
        for (int j = 0; j < SIZE; j++)
            M[SIZE * i + j] = 1.0 / (1 + abs(i - j)) + (i == j);
    }
    perp_struct_init(&view, sizeof view);
    perp_struct_init(&result, sizeof result);
    require(!perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, SIZE, SIZE, M, SIZE), "view");
    follows = 1;
    status = perp_lcp_solve(context, z, w, NULL, &result, NULL, &problem, NULL);
    follows = 0;
    require(!status, perp_context_message(context));
}

static void add_box(perp_world *world, double x, double y, double speed)
{
    const double half[] = {0.5, 0.5, 0.5};
    perp_body_settings body;
    perp_body box = 0;

    perp_body_settings_init(&body, sizeof body);
    body.mass = 1;
    body.inertia[0] = body.inertia[4] = body.inertia[8] = 1.0 / 6;
    body.position[0] = x, body.position[2] = y;
    body.velocity[0] = speed;
    require(!perp_world_add_body(world, &box, &body) &&
                !perp_world_add_box(world, NULL, box, half, NULL),
            "box");
}

/* The third step: what is warm is so. */
static void walk_world(perp_context *context, int rows, double speed)
{
    const double up[] = {0, 0, 1};
    perp_world *world = NULL;
    perp_step_result result;

    perp_struct_init(&result, sizeof result);
    require(!perp_world_create(context, &world, NULL), perp_context_message(context));
    require(!perp_world_add_plane(world, NULL, perp_world_ground(world), up, 0, NULL), "plane");
    for (int row = 0; row < rows; row++)
        for (int k = 0; k < rows - row; k++)
            add_box(world, 1.05 * (k - (rows - row - 1) / 2.0), 0.5 + row, speed);
    for (int step = 0; step < 3; step++) {
        perp_status status;

        follows = step == 2;
        status = perp_world_step(world, &result, 0.01);
        follows = 0;
        require(!status, perp_context_message(context));
    }
    perp_world_destroy(world);
}

static int32_t mass(double *M, const double *q, void *user)
{
    (void)q, (void)user;
    M[0] = M[3] = 1;
    M[1] = M[2] = 0;
    return 0;
}

static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t, (void)q, (void)v, (void)user;
    k[0] = 0, k[1] = -9.81;
    return 0;
}

/* A point over a floor: the normal row and one of friction. */
static int32_t contacts(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    (void)drift, (void)t, (void)user;
    gap[0] = q[1];
    H[0] = 0, H[1] = 1, H[2] = 1, H[3] = 0;
    mu[0] = 0.5;
    return 0;
}

static void walk_theta(perp_context *context)
{
    double q[] = {0, 0}, v[] = {1, 0};
    perp_mechanism *point = NULL;
    perp_mechanism_model model;
    perp_mechanism_run_result result;
    const perp_mechanism_start start = {sizeof start, 0, 0.01, q, v};
    perp_status status;

    perp_mechanism_model_init(&model, sizeof model);
    perp_struct_init(&result, sizeof result);
    model.velocities = 2;
    model.contacts = 1, model.dim = 2;
    model.mass = mass, model.force = force, model.contact_rows = contacts;
    require(!perp_mechanism_create(context, &point, NULL, &model), perp_context_message(context));
    follows = 1;
    status = perp_mechanism_run(point, q, v, &result, &start, 0.01, NULL, NULL);
    follows = 0;
    require(!status, perp_context_message(context));
    perp_mechanism_destroy(point);
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    perp_context *context = NULL;

    require(!perp_context_create(&context, NULL), "no context");
    if (!strcmp(name, "lcp"))
        walk_lcp(context);
    else if (!strcmp(name, "box"))
        walk_world(context, 1, 2.0);
    else if (!strcmp(name, "pile"))
        walk_world(context, ROWS, 2.0);
    else if (!strcmp(name, "rest"))
        walk_world(context, ROWS, 0.0);
    else if (!strcmp(name, "theta"))
        walk_theta(context);
    else
        require(0, "walk lcp|box|pile|rest|theta");
    perp_context_destroy(context);
    return 0;
}
