/* Small frictional contact problems handed to method `proximal` by its inner interface, and the
 * laws of Signorini and Coulomb as a textbook has them. */
#ifndef PERP_TESTS_PROXIMAL_SCENE_H
#define PERP_TESTS_PROXIMAL_SCENE_H

#include "contact/method.h"
#include "gen.h"

#define PROXIMAL_ROWS 64 /* rows */

/* A problem with room for its solution. W is dense, column by column. */
typedef struct proximal_scene {
    int32_t contacts, rows, size;
    int32_t starts[PROXIMAL_ROWS + 1], dims[PROXIMAL_ROWS], constraint_of[PROXIMAL_ROWS];
    double mu[PROXIMAL_ROWS], trace[PROXIMAL_ROWS], q[PROXIMAL_ROWS],
        W[PROXIMAL_ROWS * PROXIMAL_ROWS];
    double r[PROXIMAL_ROWS], u[PROXIMAL_ROWS];
    int8_t modes[PROXIMAL_ROWS];
    int32_t first, last; /* attempts to make; 0, 0: all */
    int32_t warm;        /* from r */
    perp_outcome outcome;
    int64_t iterations;
} proximal_scene;

/* W without its zeros as compressed columns. */
typedef struct proximal_columns {
    int32_t starts[PROXIMAL_ROWS + 1], rows[PROXIMAL_ROWS * PROXIMAL_ROWS];
    double values[PROXIMAL_ROWS * PROXIMAL_ROWS];
    perp__matrix view;
} proximal_columns;

double proximal_entry(const proximal_scene *s, int32_t i, int32_t j);

void proximal_add_contact(proximal_scene *s, int32_t dim, double mu);

/* After every change of W. */
void proximal_set_traces(proximal_scene *s);

/* W = B B' with B size by `rank` of random dyadic numbers: exactly symmetric and of that rank; q
 * for which a solution exists. */
void proximal_random_delassus(proximal_scene *s, gen_random *random, int32_t rank);

/* Up to `contacts`, of every kind, and up to two bilateral rows. */
void proximal_random_scene(proximal_scene *s, gen_random *random, int32_t contacts, double mu,
                           int32_t rank);

void proximal_compress(const proximal_scene *s, proximal_columns *c);

perp__contact_problem proximal_problem_of(perp_context *context, const proximal_scene *s,
                                          const perp__matrix *W);

/* The attempts from s->first on until one solves. */
perp_status proximal_run(const perp__contact_problem *p, proximal_scene *s);

/* How far (r, u) are from the laws: products of impulse and velocity in the units of q^2 / trace,
 * the rest in those of q / sqrt(trace). */
double proximal_violation(const proximal_scene *s);

#endif
