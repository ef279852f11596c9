/* Problems with contacts that hold both ways, calls with them, and their laws. */
#ifndef TESTS_TWO_SIDED_H
#define TESTS_TWO_SIDED_H

#include <stdint.h>

#include <perp/perp.h>

enum { MOST = 20, UNITS = 8 };

/* Rows: contacts of dims[k], then those with bounds, then equations. */
typedef struct both_problem {
    int32_t contacts, bounded, bilateral, rows, size, n;
    int32_t dims[UNITS], two_sided[UNITS];
    double mu[UNITS], lower[MOST], upper[MOST];
    double W[MOST * MOST], q[MOST];                          /* row-major */
    double M[MOST * MOST], H[MOST * MOST], f[MOST], w[MOST]; /* the same problem */
} both_problem;

typedef struct both_answer {
    double v[MOST], r[MOST], u[MOST], ray[MOST];
    int32_t modes[MOST];
    perp_contact_result result;
} both_answer;

/* What a call takes. */
typedef struct both_rig {
    perp_contact_settings settings;
    perp_contact_laws laws;
    perp_contact_dynamics dynamics;
    perp_matrix M, H, G;
} both_rig;

extern perp_context *both_context;
extern uint64_t both_seed;

/* Makes both_context, and destroys it: for groups of tests. */
int both_make(void **state);
int both_destroy(void **state);

/* Between -1 and 1. */
double both_draw(void);

/* x := A^-1 x by elimination with pivoting; 0 where A is singular. */
int both_eliminate(int n, double *A, double *x);

/* One more contact; dim: all its rows. */
void both_add(both_problem *p, int32_t two_sided, int32_t dim, double mu);

/* Data of size 1 for n velocities, more than there are rows, so that W is regular. blocks: M falls
 * into blocks of three. */
void both_fill(both_problem *p, int32_t bounded, int32_t bilateral, int blocks);
/* The same for sizes and bounds that are there: M, with eigenvalues of `least` or more, H, f, w. */
void both_fill_data(both_problem *p, double least, int blocks);

/* M and H of a drawer between two guides, `guide` apart: velocities x, y, theta of the mass centre,
 * which is `offset` off the line of the pull and of the guides. */
void both_drawer(both_problem *p, double mass, double inertia, double offset, double guide,
                 double mu);

/* Friction of the contacts that hold both ways pushes on their normals: what makes answers many. */
void both_skew(both_problem *p, double by);

/* W = H M^-1 H', q = H M^-1 f + w; matrices row by row, MOST wide. */
void both_reduce(int n, int size, const double *M, const double *H, const double *f,
                 const double *w, double *W, double *q);
void both_form(both_problem *p);

void both_by_delassus(const both_problem *p, int32_t method, const double *r0, both_answer *a);
void both_set(both_problem *p, int32_t method, int callback, both_rig *g, both_answer *a);
perp_status both_call(both_problem *p, int32_t method, int callback, const double *r0,
                      both_answer *a);
void both_by_dynamics(both_problem *p, int32_t method, int callback, const double *r0,
                      both_answer *a);

int both_is_good(const both_answer *a);
void both_require_solved(const both_answer *a, uint64_t which);

double both_velocity(const both_problem *p, const double *r, int row);

/* The laws of any contact, recomputed: u = W r + q; u_N = 0 to the last bit, friction within its
 * disc (1e-15: three roundings) and against the motion, to what tol 1e-10 leaves of numbers of
 * size 1. */
void both_require_laws(const both_problem *p, const both_answer *a);

#endif
