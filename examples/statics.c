/* A box of 2 x 1 between two fixed fingers with friction 0.5. The fingers hold it against every
 * force and every moment (force closure) as long as the line from one to the other lies within both
 * friction cones: one may be 1 higher than the other. Beyond that the box comes loose, and the
 * virtual velocity says how. statics.py asks the same, and more, in Python. */
#include <perp/perp.h>

#include <stdio.h>

enum { FINGERS = 2, N = 3 }; /* velocities: along x, along y, turn */

/* Rows of H: the velocity of the box along a finger's normal, and along the tangent. */
static void add_finger(double (*rows)[N], double x, double y, double normal)
{
    const double normal_row[N] = {normal, 0, -y * normal},
                 tangent_row[N] = {0, -normal, -x * normal};

    for (int k = 0; k < N; k++) {
        rows[0][k] = normal_row[k];
        rows[1][k] = tangent_row[k];
    }
}

/* Asks with N + 1 loads, of which every load is a sum with factors >= 0. */
static perp_status hold(perp_context *context, double height)
{
    const double mu[FINGERS] = {0.5, 0.5}, loads[N + 1][N] = {{1}, {0, 1}, {0, 0, 1}, {-1, -1, -1}};
    double H[2 * FINGERS][N], v[N];
    perp_status status = PERP_OK;
    perp_statics_problem problem;
    perp_statics_result result;
    perp_contact_laws laws;
    perp_matrix view;

    add_finger(&H[0], -1, -height / 2, 1);
    add_finger(&H[2], 1, height / 2, -1);
    perp_struct_init(&view, sizeof view);
    perp_matrix_dense(&view, PERP_STORAGE_ROW_MAJOR, 2 * FINGERS, N, H[0], N);
    perp_contact_laws_init(&laws, sizeof laws);
    laws.contacts = FINGERS;
    laws.dim = 2;
    laws.mu = mu;
    perp_struct_init(&problem, sizeof problem);
    problem.n = N;
    problem.laws = &laws;
    problem.H = &view;
    perp_struct_init(&result, sizeof result);
    for (int k = 0; k <= N && status == PERP_OK; k++) {
        problem.f = loads[k];
        status = perp_contact_statics(context, NULL, v, &result, &problem, NULL);
        if (status == PERP_OK && result.verdict != PERP_STATICS_STANDS)
            break;
    }
    if (status == PERP_OK && result.verdict == PERP_STATICS_STANDS)
        printf("one finger %.2f higher: holds every load\n", height);
    else if (status == PERP_OK)
        printf("one finger %.2f higher: %s, comes loose by (%.3f, %.3f) and turns by %.3f\n",
               height, perp_statics_verdict_text(result.verdict), v[0], v[1], v[2]);
    return status;
}

int main(void)
{
    const double heights[] = {0, 0.99, 1.01};
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, NULL);

    for (int k = 0; k < 3 && status == PERP_OK; k++)
        status = hold(context, heights[k]);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : "no context");
    perp_context_destroy(context);
    return status != PERP_OK;
}
