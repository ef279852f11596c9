/* Small frictional contact problems handed to method `newton` by its inner interface, and the laws
 * of Signorini and Coulomb as a textbook has them. */
#ifndef PERP_TESTS_NEWTON_SCENE_H
#define PERP_TESTS_NEWTON_SCENE_H

#include "contact/method.h"
#include "gen.h"

#define NEWTON_ROWS 64 /* rows */

/* A problem with room for its solution. W is dense, column by column. */
typedef struct newton_scene {
    int32_t contacts, rows, size;
    int32_t starts[NEWTON_ROWS + 1], dims[NEWTON_ROWS];
    double mu[NEWTON_ROWS], trace[NEWTON_ROWS], q[NEWTON_ROWS], W[NEWTON_ROWS * NEWTON_ROWS];
    double r[NEWTON_ROWS], u[NEWTON_ROWS];
    int8_t modes[NEWTON_ROWS];
    int32_t first, last; /* attempts to make; 0, 0: all */
    int32_t warm;        /* from r */
    perp_outcome outcome;
    int64_t iterations;
} newton_scene;

/* W without its zeros as compressed columns. */
typedef struct newton_columns {
    int32_t starts[NEWTON_ROWS + 1], rows[NEWTON_ROWS * NEWTON_ROWS];
    double values[NEWTON_ROWS * NEWTON_ROWS];
    perp__matrix view;
} newton_columns;

double newton_entry(const newton_scene *s, int32_t i, int32_t j);

void newton_add_contact(newton_scene *s, int32_t dim, double mu);

/* After every change of W. */
void newton_set_traces(newton_scene *s);

/* W = B B' with B size by `rank` of random dyadic numbers: exactly symmetric and of that rank; q
 * for which a solution exists. */
void newton_random_delassus(newton_scene *s, gen_random *random, int32_t rank);

/* Up to `contacts`, of every kind, and up to two bilateral rows. */
void newton_random_scene(newton_scene *s, gen_random *random, int32_t contacts, double mu,
                         int32_t rank);

void newton_compress(const newton_scene *s, newton_columns *c);

perp__contact_problem newton_problem_of(perp_context *context, const newton_scene *s,
                                        const perp__matrix *W);

/* The attempts from s->first on until one solves. */
perp_status newton_run(const perp__contact_problem *p, newton_scene *s);

/* How far (r, u) are from the laws: products of impulse and velocity in the units of q^2 / trace,
 * the rest in those of q / sqrt(trace). */
double newton_violation(const newton_scene *s);

#endif
