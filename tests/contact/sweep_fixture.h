/* A frictional contact problem with its arrays, from piles or by hand, and one run of the method
 * sweep on it; the law of the answer, contact by contact. For test_sweep*.c. */
#ifndef PERP_TESTS_CONTACT_SWEEP_FIXTURE_H
#define PERP_TESTS_CONTACT_SWEEP_FIXTURE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include "bodies_load.h"
#include "contact/law.h"
#include "contact/method.h"
#include "piles.h"

#include "context.h"

enum { SEPARATE, STICK, SLIP };

/* A problem with its arrays, and one run of the method on it. */
typedef struct fixture {
    piles p;
    perp__bodies bodies;
    perp__contact_problem problem;
    perp__contact_iterate iterate;
    perp__matrix W;
    int32_t *starts, *W_starts, *W_rows;
    double *W_values, *trace, *q, *r, *u;
    int8_t *modes;
} fixture;

static inline void prepare(fixture *f, int32_t contacts, int32_t size)
{
    f->problem.context = context;
    f->problem.contacts = contacts;
    f->problem.rows = f->problem.size = size;
    f->problem.starts = f->starts;
    f->problem.tol = 1e-8;
    f->trace = gen_allocate((size_t)size, sizeof(double));
    f->q = gen_allocate((size_t)size, sizeof(double));
    f->r = gen_allocate((size_t)size, sizeof(double));
    f->u = gen_allocate((size_t)size, sizeof(double));
    f->modes = gen_allocate((size_t)contacts, 1);
    f->problem.trace = f->trace;
    f->problem.q = f->q;
    f->iterate.r = f->r;
    f->iterate.u = f->u;
    f->iterate.modes = f->modes;
}

static inline void begin(fixture *f, const piles_options *options)
{
    perp__matrix M, H;
    perp__bodies_input input;
    int32_t suits;
    int64_t entries;

    memset(f, 0, sizeof *f);
    piles_make(&f->p, options);
    f->starts = gen_allocate((size_t)f->p.contacts + 2, sizeof *f->starts);
    for (int32_t k = 0; k < f->p.contacts; k++)
        f->starts[k + 1] = f->starts[k] + f->p.dims[k];
    prepare(f, f->p.contacts, f->p.rows);
    assert_int_equal(perp__matrix_read(context, "M", &M, &f->p.M), PERP_OK);
    assert_int_equal(perp__matrix_read(context, "H", &H, &f->p.H), PERP_OK);
    memset(&input, 0, sizeof input);
    input.n = f->p.n;
    input.contacts = f->p.contacts;
    input.size = f->p.rows;
    input.starts = f->starts;
    input.M = &M;
    input.H = &H;
    memset(&f->bodies, 0, sizeof f->bodies);
    f->bodies.context = context;
    assert_int_equal(perp__bodies_setup(&f->bodies, &input, &suits), PERP_OK);
    assert_true(suits);
    bodies_load(&f->bodies, f->p.f, f->p.w, NULL, f->q);
    bodies_traces(&f->bodies, f->trace);
    entries = perp__bodies_delassus_entries(&f->bodies);
    f->W_starts = gen_allocate((size_t)f->p.rows + 1, sizeof *f->W_starts);
    f->W_rows = gen_allocate((size_t)entries, sizeof *f->W_rows);
    f->W_values = gen_allocate((size_t)entries, sizeof *f->W_values);
    perp__bodies_delassus(&f->bodies, f->W_starts, f->W_rows, f->W_values);
    f->W.rows = f->W.columns = f->p.rows;
    f->W.column_starts = f->W_starts;
    f->W.row_indices = f->W_rows;
    f->W.values = f->W_values;
    f->problem.dims = f->p.dims;
    f->problem.mu = f->p.mu;
    f->problem.bodies = &f->bodies;
}

static inline void end(fixture *f)
{
    piles_destroy(&f->p);
    perp__bodies_release(&f->bodies);
    free(f->starts);
    free(f->W_starts);
    free(f->W_rows);
    free(f->W_values);
    free(f->trace);
    free(f->q);
    free(f->r);
    free(f->u);
    free(f->modes);
}

static inline perp_outcome run(fixture *f)
{
    perp__arena arena;
    perp__contact_work *work = gen_allocate(1, perp__contact_sweep.work_size);
    double *omega = gen_allocate((size_t)f->problem.size, sizeof *omega), drive;

    perp__contact_omegas(&f->problem, NULL, 1, &drive, omega);
    f->problem.omega = omega;
    work->problem = &f->problem;
    memset(&arena, 0, sizeof arena);
    assert_int_equal(perp__arena_fit(&arena, context, perp__contact_sweep.layout, work), PERP_OK);
    assert_int_equal(perp__contact_sweep.solve(work, &f->iterate), PERP_OK);
    perp__arena_release(&arena);
    free(omega);
    free(work);
    return f->iterate.outcome;
}

/* W r + q from W's columns. */
static inline void velocities(const fixture *f, double *u)
{
    memcpy(u, f->q, (size_t)f->problem.size * sizeof *u);
    for (int32_t j = 0; j < f->problem.size; j++)
        for (int32_t k = f->W.column_starts[j]; k < f->W.column_starts[j + 1]; k++)
            u[f->W.row_indices[k]] += f->W.values[k] * f->r[j];
}

/* The law, contact by contact, in units of omega = max |q_k| / sqrt(t_k). */
static inline double law(const fixture *f)
{
    double *u = gen_allocate((size_t)f->problem.size, sizeof *u), omega = 0.0, worst = 0.0;

    velocities(f, u);
    for (int32_t k = 0; k < f->problem.contacts; k++) {
        double sum = 0.0;

        for (int32_t i = f->starts[k]; i < f->starts[k + 1]; i++)
            sum += f->q[i] * f->q[i];
        omega = fmax(omega, sqrt(sum / f->trace[k]));
    }
    for (int32_t k = 0; k < f->problem.contacts; k++) {
        const double t = f->trace[k], root = sqrt(t), mu = f->problem.mu[k];
        const double *r = f->r + f->starts[k], *v = u + f->starts[k];
        double friction = 0.0, length = 0.0, speed = 0.0, error;

        for (int32_t i = 1; i < f->problem.dims[k]; i++) {
            length += r[i] * r[i];
            speed += v[i] * v[i];
            friction += r[i] * v[i];
        }
        length = sqrt(length);
        speed = sqrt(speed);
        assert_true(r[0] >= 0.0 && length <= mu * r[0] * (1 + 1e-14));
        error = fabs(fmin(r[0] * root, v[0] / root));
        /* |r_t - P(r_t - u_t / t)| of the disc of radius mu r_n is at most these two */
        if (f->problem.dims[k] > 1)
            error = fmax(error, fmin(speed / root,
                                     (friction + mu * r[0] * speed) / (speed / root + 1e-300)));
        worst = fmax(worst, error / omega);
    }
    free(u);
    return worst;
}

static inline void start_cold(fixture *f)
{
    memset(f->r, 0, (size_t)f->problem.size * sizeof *f->r);
    f->iterate.warm = 0;
}

#endif
