/* A mechanism made of tables: constant M, k and rows, gaps and constraints linear in q and t. Its
 * callbacks can be told to fail, to write a wrong number, or to do something on the side. */
#ifndef PERP_TESTS_TABLED_H
#define PERP_TESTS_TABLED_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

#include <perp/mechanism.h>
#include <perp/perp.h>

enum { TABLED_N = 6, TABLED_ROWS = 16 };

/* Arrays that a callback writes, in the order of the callbacks. */
enum tabled_array {
    TABLED_NOTHING,
    TABLED_M,
    TABLED_K,
    TABLED_GAP,
    TABLED_H,
    TABLED_DRIFT,
    TABLED_MU,
    TABLED_C,
    TABLED_G,
    TABLED_C_DRIFT,
    TABLED_BOUND,
    TABLED_B,
    TABLED_B_DRIFT,
    TABLED_RATE,
    TABLED_Q
};

enum tabled_callback {
    TABLED_NONE,
    TABLED_MASS,
    TABLED_FORCE,
    TABLED_CONTACTS,
    TABLED_BILATERAL,
    TABLED_DRY,
    TABLED_KINEMATICS,
    TABLED_NORMALISE
};

typedef struct tabled {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
    double M[TABLED_N * TABLED_N], k[TABLED_N];
    double gap[TABLED_ROWS], H[TABLED_ROWS * TABLED_N], drift[TABLED_ROWS];
    double c[TABLED_ROWS], G[TABLED_ROWS * TABLED_N], c_drift[TABLED_ROWS];
    double bound[TABLED_ROWS], B[TABLED_ROWS * TABLED_N], b_drift[TABLED_ROWS];
    double mu[TABLED_ROWS], mu_static[TABLED_ROWS], stribeck[TABLED_ROWS], restitution[TABLED_ROWS];
    double q[TABLED_N], v[TABLED_N], impulse[TABLED_ROWS], velocity[TABLED_ROWS], ray[TABLED_ROWS];
    int32_t modes[TABLED_ROWS], dims[TABLED_ROWS];
    /* what goes wrong */
    int32_t array, entry; /* this entry of this array becomes `value` */
    double value;
    int32_t callback, answer;                       /* this callback returns `answer` */
    void (*inside)(void *tabled, int32_t callback); /* called in every callback, or NULL */
    int32_t calls[8];                               /* by callback */
} tabled;

/* n velocities, contacts of dimension `dim`, identity mass, no gravity, everything 0. */
void tabled_make(tabled *r, int32_t n, int32_t contacts, int32_t dim);
/* A sliding contact in 3 dimensions (gap = q[2]), one in 2 that is far (gap = 1 + q[1]), one
 * bilateral row (c = q[3]), dry friction on v[4], and all callbacks. */
void tabled_make_everything(tabled *r);
/* A context of its own with a handle. */
void tabled_open(tabled *r);
void tabled_close(tabled *r);
/* One step from r->q, r->v to themselves; must be PERP_OK. Returns the outcome. */
int32_t tabled_advance(tabled *r, double h);
/* The same without requiring anything: for refusals. */
perp_status tabled_try(tabled *r, double h);
/* 1/2 v'Mv. */
double tabled_energy(const tabled *r, const double *v);

/* Within `tolerance`, relative to numbers of size 1 or to the expected one. */
void tabled_near(double value, double expected, double tolerance, const char *what);
/* 0.0, and not -0.0. */
void tabled_zero(double value, const char *what);
void tabled_says(const tabled *r, const char *text);

#endif
