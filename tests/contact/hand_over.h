/* Contact problems as another simulator hands them over: random dynamics in general coordinates,
 * all arguments of one call, and the law in other words than the library's. */
#ifndef PERP_TESTS_HAND_OVER_H
#define PERP_TESTS_HAND_OVER_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <perp/perp.h>

#include "gen.h"

enum { HAND_CONTACTS = 12, HAND_SIZE = 40, HAND_N = 30 };

typedef struct hand_over {
    int32_t n, contacts, rows, joints, size;
    int32_t dims[HAND_CONTACTS], starts[HAND_CONTACTS + 1];
    double mu[HAND_CONTACTS];
    double M[HAND_N * HAND_N], H[HAND_SIZE * HAND_N], G[HAND_SIZE * HAND_N]; /* column-major */
    double f[HAND_N], w[HAND_SIZE], b[HAND_SIZE];
    perp_matrix M_view, H_view, G_view;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_contact_settings settings;
    perp_contact_result result;
    double v[HAND_N], r[HAND_SIZE], u[HAND_SIZE], ray[HAND_SIZE];
    int32_t modes[HAND_CONTACTS];
} hand_over;

static inline void hand_views(hand_over *p)
{
    assert_int_equal(perp_struct_init(&p->M_view, sizeof p->M_view), PERP_OK);
    assert_int_equal(perp_struct_init(&p->H_view, sizeof p->H_view), PERP_OK);
    assert_int_equal(perp_struct_init(&p->G_view, sizeof p->G_view), PERP_OK);
    assert_int_equal(
        perp_matrix_dense(&p->M_view, PERP_STORAGE_COLUMN_MAJOR, p->n, p->n, p->M, p->n), PERP_OK);
    assert_int_equal(
        perp_matrix_dense(&p->H_view, PERP_STORAGE_COLUMN_MAJOR, p->rows, p->n, p->H, p->rows),
        PERP_OK);
    assert_int_equal(perp_matrix_dense(&p->G_view, PERP_STORAGE_COLUMN_MAJOR, p->joints, p->n, p->G,
                                       p->joints > 0 ? p->joints : 1),
                     PERP_OK);
    assert_int_equal(perp_contact_laws_init(&p->laws, sizeof p->laws), PERP_OK);
    p->laws.contacts = p->contacts;
    p->laws.dims = p->dims;
    p->laws.mu = p->mu;
    assert_int_equal(perp_struct_init(&p->dynamics, sizeof p->dynamics), PERP_OK);
    p->dynamics.n = p->n;
    p->dynamics.M = &p->M_view;
    p->dynamics.H = &p->H_view;
    p->dynamics.G = p->joints > 0 ? &p->G_view : NULL;
    assert_int_equal(perp_contact_settings_init(&p->settings, sizeof p->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&p->result, sizeof p->result), PERP_OK);
}

/* M = A A' / n + 1 / 2; with n > rows the contacts are independent. dim 0: mixed. */
static inline void hand_make(hand_over *p, uint64_t seed, int32_t n, int32_t contacts, int32_t dim,
                             int32_t joints, double mu_max)
{
    gen_random random;
    double A[HAND_N * HAND_N];
    int32_t i, j, k;

    memset(p, 0, sizeof *p);
    gen_seed(&random, seed);
    p->n = n;
    p->contacts = contacts;
    p->joints = joints;
    for (k = 0; k < contacts; k++) {
        p->dims[k] = dim > 0 ? dim : 1 + gen_integer(&random, 3);
        p->mu[k] = gen_integer(&random, 6) ? gen_uniform(&random, 0, mu_max) : 0.0;
        p->starts[k + 1] = p->starts[k] + p->dims[k];
    }
    p->rows = p->starts[contacts];
    p->size = p->rows + joints;
    for (i = 0; i < n * n; i++)
        A[i] = gen_normal(&random);
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            p->M[i + j * n] = i == j ? 0.5 : 0.0;
            for (k = 0; k < n; k++)
                p->M[i + j * n] += A[i + k * n] * A[j + k * n] / n;
        }
    for (i = 0; i < p->rows * n; i++)
        p->H[i] = gen_normal(&random);
    for (i = 0; i < joints * n; i++)
        p->G[i] = gen_normal(&random);
    for (i = 0; i < n; i++)
        p->f[i] = gen_normal(&random);
    for (k = 0; k < contacts; k++) /* open by a gap, or touching: never penetrating */
        p->w[p->starts[k]] = gen_integer(&random, 2) ? 0.0 : gen_uniform(&random, 0, 1);
    hand_views(p);
}

static inline perp_status hand_solve(hand_over *p, perp_context *context, const double *r0)
{
    return perp_contact_solve(context, ANSWER(p->v, p->r, p->u, p->modes, p->ray), &p->result,
                              &p->settings, DYNAMICS(&p->laws, &p->dynamics, p->f, p->w, p->b), r0);
}

/* The largest violation of dynamics, Signorini and Coulomb, in the problem's own units. */
static inline double hand_violation(const hand_over *p)
{
    double worst = 0.0;
    int32_t i, j, k;

    for (i = 0; i < p->n; i++) { /* M v = f + H'r + G's */
        double sum = -p->f[i];

        for (j = 0; j < p->n; j++)
            sum += p->M[i + j * p->n] * p->v[j];
        for (k = 0; k < p->rows; k++)
            sum -= p->H[k + i * p->rows] * p->r[k];
        for (k = 0; k < p->joints; k++)
            sum -= p->G[k + i * p->joints] * p->r[p->rows + k];
        worst = fmax(worst, fabs(sum));
    }
    for (k = 0; k < p->size; k++) { /* u = H v + w, 0 = G v + b */
        double sum = k < p->rows ? p->w[k] - p->u[k] : p->b[k - p->rows];

        for (j = 0; j < p->n; j++)
            sum +=
                p->v[j] * (k < p->rows ? p->H[k + j * p->rows] : p->G[k - p->rows + j * p->joints]);
        worst = fmax(worst, fabs(sum));
    }
    for (k = 0; k < p->contacts; k++) {
        const double *r = p->r + p->starts[k], *u = p->u + p->starts[k];
        const double pressure = p->dims[k] == 3   ? hypot(r[1], r[2])
                                : p->dims[k] == 2 ? fabs(r[1])
                                                  : 0.0;
        const double speed = p->dims[k] == 3   ? hypot(u[1], u[2])
                             : p->dims[k] == 2 ? fabs(u[1])
                                               : 0.0;
        double power = 0.0; /* friction takes the most that it can */

        for (i = 1; i < p->dims[k]; i++)
            power += r[i] * u[i];
        worst = fmax(worst, fmax(-r[0], -u[0]));
        worst = fmax(worst, fmin(r[0], u[0]));
        worst = fmax(worst, pressure - p->mu[k] * r[0]);
        worst = fmax(worst, fabs(power + p->mu[k] * r[0] * speed));
    }
    return worst;
}

#endif
