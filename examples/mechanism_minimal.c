/* A bead on a wire, from functions of one's own: mass, force, and a wall that the wire leads into.
 *
 * The wire is the parabola y = x^2 / 2; the one coordinate is x. The bead weighs 1, slides on the
 * wire with dry friction of 0.2 N, and a wall stands at x = 0.4. Let go at x = -1 it swings against
 * the wall, and comes to rest where the wire is flat enough for friction to hold it. */
#include <perp/mechanism.h>
#include <perp/perp.h>

#include <math.h>
#include <stdio.h>

static const double g = 9.81, grip = 0.2, wall = 0.4;

/* Kinetic energy (1 + x^2) x'^2 / 2: the mass of x. */
static int32_t mass(double *M, const double *q, void *user)
{
    (void)user;
    M[0] = 1 + q[0] * q[0];
    return 0;
}

/* Weight along the wire, and -C(q, v) v: what the changing mass takes. */
static int32_t force(double *k, double t, const double *q, const double *v, void *user)
{
    (void)t, (void)user;
    k[0] = -g * q[0] - q[0] * v[0] * v[0];
    return 0;
}

/* The gap to the wall, and its gradient: a contact of dimension 1, without friction. */
static int32_t contacts(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    (void)drift, (void)mu, (void)t, (void)user;
    gap[0] = wall - q[0];
    H[0] = -1;
    return 0;
}

/* Dry friction of a given bound, along the wire: the slip is the bead's speed. */
static int32_t dry(double *bound, double *B, double *drift, double t, const double *q,
                   const double *v, void *user)
{
    (void)drift, (void)t, (void)v, (void)user;
    bound[0] = grip;
    B[0] = sqrt(1 + q[0] * q[0]);
    return 0;
}

/* Counts the impacts and remembers when the bead moved last. */
typedef struct record {
    double moved;
    int hits;
} record;

static int32_t watch(const perp_mechanism_view *view, void *user)
{
    record *seen = user;

    seen->hits += view->impulse[0] > 0.05; /* more than a step's weight against the wall */
    if (view->v[0] != 0.0)
        seen->moved = view->t;
    return 0;
}

int main(void)
{
    const double place[] = {-1.0}, rest[] = {0.0}, restitution[] = {0.5};
    const perp_mechanism_start start = {sizeof start, 0.0, 0.001, place, rest};
    perp_context *context = NULL;
    perp_mechanism *bead = NULL;
    perp_mechanism_model model;
    perp_mechanism_run_result result;
    record seen = {0};
    double q[1], v[1];
    perp_status status = perp_context_create(&context, NULL);

    perp_mechanism_model_init(&model, sizeof model);
    model.velocities = 1;
    model.contacts = 1, model.dim = 1, model.dry = 1;
    model.restitution = restitution;
    model.mass = mass, model.force = force, model.contact_rows = contacts, model.dry_rows = dry;
    perp_struct_init(&result, sizeof result);
    if (!status)
        status = perp_mechanism_create(context, &bead, NULL, &model);
    if (!status)
        status = perp_mechanism_run(bead, q, v, &result, &start, 60.0, watch, &seen);
    if (status)
        fprintf(stderr, "%s\n", context ? perp_context_message(context) : "no context");
    else
        printf("%s: %d hits, at rest from %.1f s on: x = %.4f, where friction holds up to %.4f; v "
               "= %g\n",
               perp_outcome_text(result.outcome), seen.hits, seen.moved, q[0], grip / g, v[0]);
    perp_mechanism_destroy(bead);
    perp_context_destroy(context);
    return status != PERP_OK;
}
