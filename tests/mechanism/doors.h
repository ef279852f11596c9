/* Machines that contacts which hold both ways describe as well as load-dependent friction does. */
#ifndef PERP_TESTS_MECHANISM_DOORS_H
#define PERP_TESTS_MECHANISM_DOORS_H

#include "found.h"

/* ---- load-dependent friction as a mechanism ----------------------------------------------------
 *
 * A x + b + mu |C x + d| sgn v = tau. A row N = C x + d is what a mass m_i that is carried along,
 * y_i = C_i q / m_i, with the force -d_i on it, asks of its guide: m_i y_i'' = N_i - d_i. The
 * others feel -C_i'N_i / m_i, which C'C / m less inertia and the force C'd / m make up for. */

typedef struct load_case {
    int32_t n;
    double A[9], C[9], b[3], d[3], mu[3], mu_static[3], tau[3], sign[3];
} load_case;

static inline void fill_dimensions(table *s, const int32_t *two_sided)
{
    s->model.two_sided = two_sided;
    s->model.mu_static = s->mu_static;
}

static inline void pose_load(table *s, const load_case *c)
{
    static const int32_t ones[3] = {1, 1, 1};
    const int32_t n = c->n;
    int32_t i, j, k;

    table_make(s, 2 * n, n, 2);
    fill_dimensions(s, ones);
    memset(s->M, 0, sizeof s->M);
    for (i = 0; i < n; i++) {
        const double mass = 64.0; /* large enough for A to stay positive definite */

        s->M[(n + i) * (2 * n + 1)] = mass;
        s->k[i] += c->tau[i] - c->b[i];
        s->k[n + i] = -c->d[i];
        for (j = 0; j < n; j++) {
            s->M[i * 2 * n + j] += c->A[n * i + j];
            s->k[j] += c->C[n * i + j] * c->d[i] / mass;
            s->H[2 * i * 2 * n + j] = -c->C[n * i + j] / mass;
            for (k = 0; k < n; k++)
                s->M[j * 2 * n + k] -= c->C[n * i + j] * c->C[n * i + k] / mass;
        }
        s->H[2 * i * 2 * n + n + i] = 1.0;
        s->H[(2 * i + 1) * 2 * n + i] = 1.0;
        s->v[i] = c->sign[i];
        s->mu[i] = c->mu[i];
        s->mu_static[i] = c->mu_static[i];
    }
}

static inline perp_load_friction *open_load(perp_context *context, const load_case *c)
{
    perp_load_friction *friction;
    perp_load_system system;
    perp_matrix A, C;

    A = matrix_rows(c->A, c->n, c->n);
    C = matrix_rows(c->C, c->n, c->n);
    assert_int_equal(perp_load_system_init(&system, sizeof system), PERP_OK);
    system.n = c->n;
    system.A = &A;
    system.C = &C;
    system.b = c->b;
    system.d = c->d;
    system.mu = c->mu;
    system.mu_static = c->mu_static;
    assert_int_equal(perp_load_friction_create(context, &friction, NULL, &system), PERP_OK);
    return friction;
}

/* The answer with this x among those of the mechanism, or NULL. */
static inline const perp_mechanism_found *find(table *s, int32_t n, const double *x)
{
    int32_t k, i;

    for (k = 0; k < s->summary.count; k++) {
        const perp_mechanism_found *found = table_get(s, k);

        for (i = 0; i < n; i++) /* the masses' condition is below 1e3, that of patterns below 1e4 */
            if (!(fabs(found->acceleration[i] - x[i]) <= 1e-8 * fmax(1.0, fabs(x[i]))))
                break;
        if (i == n)
            return found;
    }
    return NULL;
}

/* ---- the drawer ---------------------------------------------------------------------------- */

typedef struct drawer_case {
    double mass, offset, guide, mu, force;
} drawer_case;

/* Planar body (x, y, angle), its mass centre `offset` beside the line of the pull and of two pins
 * in guides, `guide` apart: N_1 = -N_2 = m h x'' / L. */
static inline void pose_drawer(table *s, const drawer_case *c, int way)
{
    static const int32_t ones[2] = {1, 1};
    const double rows[4][3] = {
        {0, 1, c->guide / 2}, {1, 0, c->offset}, {0, 1, -c->guide / 2}, {1, 0, c->offset}};
    int i;

    table_make(s, 3, 2, 2);
    fill_dimensions(s, ones);
    s->M[0] = s->M[4] = c->mass;
    s->M[8] = 0.7; /* it does not turn */
    s->k[0] = c->force;
    s->k[2] = c->force * c->offset;
    for (i = 0; i < 4; i++)
        table_row(s->H, 3, i, rows[i]);
    s->mu[0] = s->mu[1] = s->mu_static[0] = s->mu_static[1] = c->mu;
    s->v[0] = way;
}

/* ---- the lead screw ------------------------------------------------------------------------ */

/* q = (angle, nut), N along (-r sin, cos), slip along (r cos, sin). */
static inline void pose_screw(table *s, double torque, double way)
{
    static const int32_t one = 1;
    const double lead = 3.14159265358979323846 / 36, r = 0.01, m = 50;

    table_make(s, 2, 1, 2);
    fill_dimensions(s, &one);
    s->M[0] = 2e-5;
    s->M[3] = m;
    s->k[0] = torque;
    s->k[1] = -100;
    s->H[0] = -r * sin(lead);
    s->H[1] = cos(lead);
    s->H[2] = r * cos(lead);
    s->H[3] = sin(lead);
    s->mu[0] = s->mu_static[0] = 0.2;
    s->v[0] = way;
    s->v[1] = way * r * tan(lead);
}

#endif
