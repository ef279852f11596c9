/* A simulator with bodies and collision detection of its own hands its contacts over to perp.
 *
 * Five equal balls: four on the floor that touch, one on top in the middle. The top ball pushes the
 * others apart at 45 degrees; friction at floor and ball can hold that if mu >= tan(45/2 degrees) =
 * 0.4142, at every contact. So the pyramid stands for ever with mu = 0.42 and falls with mu = 0.4.
 *
 * The calls to perp: context, init of four structs, solver (create), and in every step the views of
 * M and H, setup and solve. */
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { BALLS = 5, N = 6 * BALLS, MOST = 12 * BALLS };

static const double radius = 0.1, mass = 1.0, g = 9.81, h = 0.005, near = 1e-3;

/* ---- the simulator --------------------------------------------------------------------------- */

typedef struct ball {
    double position[3];
} ball;

typedef struct simulator {
    ball balls[BALLS];
    double v[N]; /* velocity and angular velocity, ball by ball */
    int32_t contacts;
    double mu[MOST], r[3 * MOST], w[3 * MOST];
    double H[3 * MOST * N]; /* row-major: one row of normal and two of tangents a contact */
} simulator;

static void build(simulator *s)
{
    int32_t i;

    memset(s, 0, sizeof *s);
    for (i = 0; i < 4; i++) {
        s->balls[i].position[0] = i & 1 ? radius : -radius;
        s->balls[i].position[1] = i & 2 ? radius : -radius;
        s->balls[i].position[2] = radius;
    }
    s->balls[4].position[2] = radius + sqrt(2.0) * radius;
}

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* A row of H: the velocity along `axis` at `arm` from the centre of ball b. */
static void add_row(simulator *s, int32_t row, int32_t b, double sign, const double axis[3],
                    const double arm[3])
{
    double moment[3];
    int32_t k;

    cross(arm, axis, moment);
    for (k = 0; k < 3; k++) {
        s->H[row * N + 6 * b + k] = sign * axis[k];
        s->H[row * N + 6 * b + 3 + k] = sign * moment[k];
    }
}

/* A contact that pushes ball b along the normal, and a (-1: the floor) the other way. */
static void add_contact(simulator *s, int32_t a, int32_t b, const double normal[3], double gap,
                        double mu)
{
    const int32_t row = 3 * s->contacts;
    const double helper[3] = {normal[2], normal[0], normal[1]};
    double axes[3][3], arm_a[3], arm_b[3], length;
    int32_t i, k;

    memcpy(axes[0], normal, sizeof axes[0]);
    cross(normal, helper, axes[1]);
    length = sqrt(axes[1][0] * axes[1][0] + axes[1][1] * axes[1][1] + axes[1][2] * axes[1][2]);
    for (k = 0; k < 3; k++) {
        axes[1][k] /= length;
        arm_a[k] = radius * normal[k];
        arm_b[k] = -radius * normal[k];
    }
    cross(normal, axes[1], axes[2]);
    memset(&s->H[row * N], 0, 3 * N * sizeof(double));
    for (i = 0; i < 3; i++) {
        add_row(s, row + i, b, 1.0, axes[i], arm_b);
        if (a >= 0)
            add_row(s, row + i, a, -1.0, axes[i], arm_a);
        s->w[row + i] = 0.0;
    }
    s->w[row] = fmax(gap, 0.0) / h; /* may close what is open, no more */
    s->mu[s->contacts++] = mu;
}

static void collide(simulator *s, double mu)
{
    const double up[3] = {0, 0, 1};
    int32_t a, b, k;

    s->contacts = 0;
    for (b = 0; b < BALLS; b++) {
        if (s->balls[b].position[2] - radius < near)
            add_contact(s, -1, b, up, s->balls[b].position[2] - radius, mu);
        for (a = 0; a < b; a++) {
            double normal[3], distance = 0.0;

            for (k = 0; k < 3; k++) {
                normal[k] = s->balls[b].position[k] - s->balls[a].position[k];
                distance += normal[k] * normal[k];
            }
            distance = sqrt(distance);
            for (k = 0; k < 3; k++)
                normal[k] /= distance;
            if (distance - 2 * radius < near)
                add_contact(s, a, b, normal, distance - 2 * radius, mu);
        }
    }
}

/* ---- the hand-over --------------------------------------------------------------------------- */

/* Sets up and solves the contacts of one step: velocities s->v become those after the step. */
static perp_status solve_contacts(perp_contact_solver *solver, simulator *s,
                                  perp_contact_result *result)
{
    static double masses[N];
    static int32_t starts[N + 1], rows[N];
    const perp_contact_answer answer = {.struct_size = sizeof answer, .v = s->v, .r = s->r};
    perp_contact_dynamics dynamics;
    perp_contact_laws laws;
    perp_matrix M, H;
    perp_status status;
    double f[N];
    int32_t i;

    for (i = 0; i < N; i++) { /* a diagonal M, in compressed columns; f = M v + h forces */
        starts[i] = rows[i] = i;
        masses[i] = i % 6 < 3 ? mass : 0.4 * mass * radius * radius;
        f[i] = masses[i] * s->v[i] - (i % 6 == 2 ? h * mass * g : 0.0);
    }
    starts[N] = N;
    perp_struct_init(&M, sizeof M);
    perp_matrix_csc(&M, N, N, starts, rows, masses);
    perp_struct_init(&H, sizeof H);
    perp_matrix_dense(&H, PERP_STORAGE_ROW_MAJOR, 3 * s->contacts, N, s->H, N);
    perp_struct_init(&dynamics, sizeof dynamics);
    dynamics.n = N;
    dynamics.M = &M;
    dynamics.H = &H;
    perp_contact_laws_init(&laws, sizeof laws);
    laws.contacts = s->contacts;
    laws.mu = s->mu;
    status = perp_contact_solver_setup_dynamics(solver, &laws, &dynamics);
    if (status == PERP_OK)
        status = perp_contact_solver_solve_dynamics(solver, &answer, result, f, s->w, NULL, NULL);
    return status;
}

static perp_status run(perp_context *context, double mu)
{
    perp_contact_solver *solver = NULL;
    perp_contact_settings settings;
    perp_contact_result result;
    simulator *s = malloc(sizeof *s);
    double worst = 0.0;
    perp_status status;
    int32_t step, b, k;

    if (!s)
        return PERP_ERROR_MEMORY;
    build(s);
    perp_struct_init(&result, sizeof result);
    perp_contact_settings_init(&settings, sizeof settings);
    settings.tol = 1e-10;
    status = perp_contact_solver_create(context, &solver, &settings);
    for (step = 0; step < 400 && status == PERP_OK; step++) {
        collide(s, mu);
        status = solve_contacts(solver, s, &result);
        if (status != PERP_OK)
            break;
        if (result.outcome != PERP_OUTCOME_SOLVED && result.outcome != PERP_OUTCOME_ROUNDING_LIMIT)
            printf("step %d: %s\n", (int)step, perp_outcome_text(result.outcome));
        worst = fmax(worst, result.residual);
        for (b = 0; b < BALLS; b++)
            for (k = 0; k < 3; k++)
                s->balls[b].position[k] += h * s->v[6 * b + k];
    }
    if (status == PERP_OK)
        printf("mu = %.2f: after %g s the top ball is %s, at height %.3f; largest residual %.0e\n",
               mu, 400 * h, s->balls[4].position[2] > 2.4 * radius ? "up" : "down",
               s->balls[4].position[2], worst);
    perp_contact_solver_destroy(solver);
    free(s);
    return status;
}

int main(void)
{
    perp_context *context = NULL;
    perp_status status = perp_context_create(&context, NULL);

    if (status == PERP_OK)
        status = run(context, 0.42);
    if (status == PERP_OK)
        status = run(context, 0.40);
    if (status != PERP_OK)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : "no context");
    perp_context_destroy(context);
    return status != PERP_OK;
}
