/* Accelerations of mechanisms made of tables: constant M, k and rows, everything touches. */
#ifndef PERP_TESTS_MECHANISM_FOUND_H
#define PERP_TESTS_MECHANISM_FOUND_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

enum { TABLE_N = 30, TABLE_ROWS = 48 };

typedef struct table {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_summary summary;
    perp_mechanism_found found;
    double M[TABLE_N * TABLE_N], k[TABLE_N];
    double gap[TABLE_ROWS], H[TABLE_ROWS * TABLE_N], drift[TABLE_ROWS];
    double G[TABLE_ROWS * TABLE_N], B[TABLE_ROWS * TABLE_N], bound[TABLE_ROWS];
    double mu[TABLE_ROWS], mu_static[TABLE_ROWS], stribeck[TABLE_ROWS];
    double t, q[TABLE_N], v[TABLE_N];
} table;

static inline int32_t table_mass(double *M, const double *q, void *user)
{
    const table *s = user;
    const size_t n = (size_t)s->model.velocities;

    (void)q;
    memcpy(M, s->M, n * n * sizeof *M);
    return 0;
}

static inline int32_t table_force(double *k, double t, const double *q, const double *v, void *user)
{
    const table *s = user;

    (void)t;
    (void)q;
    (void)v;
    memcpy(k, s->k, (size_t)s->model.velocities * sizeof *k);
    return 0;
}

static inline int32_t table_contacts(double *gap, double *H, double *drift, double *mu, double t,
                                     const double *q, void *user)
{
    const table *s = user;
    const size_t rows = (size_t)(s->model.contacts * s->model.dim);

    (void)t;
    (void)q;
    (void)mu;
    memcpy(gap, s->gap, (size_t)s->model.contacts * sizeof *gap);
    memcpy(H, s->H, rows * (size_t)s->model.velocities * sizeof *H);
    memcpy(drift, s->drift, rows * sizeof *drift);
    return 0;
}

static inline int32_t table_bilateral(double *c, double *G, double *drift, double t,
                                      const double *q, void *user)
{
    const table *s = user;

    (void)c;
    (void)drift;
    (void)t;
    (void)q;
    memcpy(G, s->G, (size_t)(s->model.bilateral * s->model.velocities) * sizeof *G);
    return 0;
}

static inline int32_t table_dry(double *bound, double *B, double *drift, double t, const double *q,
                                const double *v, void *user)
{
    const table *s = user;

    (void)drift;
    (void)t;
    (void)q;
    (void)v;
    memcpy(bound, s->bound, (size_t)s->model.dry * sizeof *bound);
    memcpy(B, s->B, (size_t)(s->model.dry * s->model.dry_dim * s->model.velocities) * sizeof *B);
    return 0;
}

static inline void table_make(table *s, int32_t n, int32_t contacts, int32_t dim)
{
    int32_t i;

    assert_true(n <= TABLE_N && contacts * dim <= TABLE_ROWS);
    memset(s, 0, sizeof *s);
    assert_int_equal(perp_mechanism_model_init(&s->model, sizeof s->model), PERP_OK);
    assert_int_equal(perp_mechanism_settings_init(&s->settings, sizeof s->settings), PERP_OK);
    assert_int_equal(perp_struct_init(&s->summary, sizeof s->summary), PERP_OK);
    assert_int_equal(perp_struct_init(&s->found, sizeof s->found), PERP_OK);
    s->model.velocities = n;
    s->model.contacts = contacts;
    s->model.dim = dim;
    s->model.mu = s->mu;
    s->model.mass = table_mass;
    s->model.force = table_force;
    s->model.contact_rows = table_contacts;
    s->model.bilateral_rows = table_bilateral;
    s->model.dry_rows = table_dry;
    s->model.user = s;
    for (i = 0; i < n; i++)
        s->M[i * (n + 1)] = 1.0;
}

static inline void table_row(double *rows, int32_t n, int32_t row, const double *values)
{
    memcpy(rows + row * n, values, (size_t)n * sizeof *rows);
}

/* Asks; the handle stays. */
static inline void table_open(table *s)
{
    assert_int_equal(perp_context_create(&s->context, NULL), PERP_OK);
    if (perp_mechanism_create(s->context, &s->mechanism, &s->settings, &s->model) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
}

static inline int32_t table_ask(table *s)
{
    if (perp_mechanism_accelerations(s->mechanism, &s->summary, s->t, s->q, s->v) != PERP_OK)
        fail_msg("%s", perp_context_message(s->context));
    return s->summary.count;
}

static inline const perp_mechanism_found *table_get(table *s, int32_t index)
{
    assert_int_equal(perp_mechanism_get_acceleration(s->mechanism, &s->found, index), PERP_OK);
    return &s->found;
}

static inline void table_close(table *s)
{
    perp_mechanism_destroy(s->mechanism);
    perp_context_destroy(s->context);
}

/* Within `tolerance`, relative to numbers of size 1 or to the expected one. */
static inline void table_near(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance * fmax(1.0, fabs(expected))))
        fail_msg("%s is %.17g, expected %.17g", what, value, expected);
}

#endif
