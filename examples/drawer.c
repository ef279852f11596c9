/* A drawer that sticks. Its mass centre is off the line of the pull by h, and the moment m x'' h
 * presses its corners against a guide of length L with a force of m |x''| h / L each:
 *
 *   m x'' + mu |N| sgn x' = F,   N = 2 m h x'' / L.
 *
 * The branches have the inertias m (1 +- 2 mu h / L): beyond h = L / (2 mu) one of them is
 * negative, and a force has two accelerations or none. */
#include <perp/mechanism.h>
#include <perp/perp.h>

#include <stdio.h>

static const double m = 2, L = 0.3, mu = 0.4;

/* Prints what a force does to the moving drawer; returns a status. */
static perp_status tell(perp_load_friction *drawer, double force)
{
    const double moving = 1;
    perp_load_summary summary;
    perp_load_found found;
    perp_status status;
    int32_t k;

    perp_struct_init(&summary, sizeof summary);
    perp_struct_init(&found, sizeof found);
    status = perp_load_friction_solve(drawer, &summary, &force, &moving);
    if (status != PERP_OK)
        return status;
    printf("  force %+g N: %d acceleration%s\n", force, (int)summary.count,
           summary.count == 1 ? "" : "s");
    for (k = 0; k < summary.count && status == PERP_OK; k++) {
        status = perp_load_friction_get(drawer, &found, k);
        if (status == PERP_OK)
            printf("    %+.6f m/s2, inertia %+.6f kg, %s\n", found.acceleration[0],
                   force / found.acceleration[0], found.stable ? "stable" : "unstable");
    }
    return status;
}

/* Prints the outcome of a step of 1 ms with a force against the motion. */
static perp_status step(perp_load_friction *drawer)
{
    const double force = -1;
    perp_load_step result;
    double velocity = 1;
    perp_status status;

    perp_struct_init(&result, sizeof result);
    status =
        perp_load_friction_step(drawer, &velocity, NULL, &result, &force, &velocity, NULL, 1e-3);
    if (status == PERP_OK)
        printf("  pushed back with 1 N for 1 ms, from 1 m/s: %g m/s%s\n", velocity,
               result.jam ? " (jams)" : "");
    return status;
}

static perp_status drawer_with_offset(perp_context *context, double offset)
{
    const double arm = 2 * m * offset / L;
    perp_load_friction *drawer;
    perp_load_uniqueness unique;
    perp_load_system system;
    perp_matrix inertia, load;
    perp_status status;

    perp_struct_init(&inertia, sizeof inertia);
    perp_struct_init(&load, sizeof load);
    perp_matrix_dense(&inertia, PERP_STORAGE_ROW_MAJOR, 1, 1, &m, 1);
    perp_matrix_dense(&load, PERP_STORAGE_ROW_MAJOR, 1, 1, &arm, 1);
    perp_load_system_init(&system, sizeof system);
    perp_struct_init(&unique, sizeof unique);
    system.n = 1;
    system.A = &inertia;
    system.C = &load;
    system.mu = &mu;
    status = perp_load_friction_create(context, &drawer, NULL, &system);
    if (status != PERP_OK)
        return status;
    status = perp_load_friction_uniqueness(drawer, &unique, NULL);
    if (status == PERP_OK) {
        printf("offset %g m (critical: %.6f m)\n", offset, unique.margin * offset);
        status = tell(drawer, 1);
    }
    if (status == PERP_OK)
        status = tell(drawer, -1);
    if (status == PERP_OK)
        status = step(drawer);
    perp_load_friction_destroy(drawer);
    return status;
}

int main(void)
{
    perp_context *context;
    perp_status status = perp_context_create(&context, NULL);

    if (status == PERP_OK)
        status = drawer_with_offset(context, 0.2);
    if (status == PERP_OK)
        status = drawer_with_offset(context, 0.5);
    if (status != PERP_OK)
        fprintf(stderr, "drawer: %s\n", perp_status_text(status));
    else
        perp_context_destroy(context);
    return status != PERP_OK;
}
