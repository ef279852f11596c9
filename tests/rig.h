/* A mechanism made of tables: constant M, k and rows, gaps and constraints linear in q and t. Its
 * callbacks can be told to fail, to write a wrong number, or to do something on the side. */
#ifndef PERP_TESTS_RIG_H
#define PERP_TESTS_RIG_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <perp/perp.h>

enum { RIG_N = 6, RIG_ROWS = 16 };

/* Arrays that a callback writes, in the order of the callbacks. */
enum rig_array {
    RIG_NOTHING,
    RIG_M,
    RIG_K,
    RIG_GAP,
    RIG_H,
    RIG_DRIFT,
    RIG_MU,
    RIG_C,
    RIG_G,
    RIG_C_DRIFT,
    RIG_BOUND,
    RIG_B,
    RIG_B_DRIFT,
    RIG_RATE,
    RIG_Q
};

enum rig_callback {
    RIG_NONE,
    RIG_MASS,
    RIG_FORCE,
    RIG_CONTACTS,
    RIG_BILATERAL,
    RIG_DRY,
    RIG_KINEMATICS,
    RIG_NORMALISE
};

typedef struct rig {
    perp_context *context;
    perp_mechanism *mechanism;
    perp_mechanism_model model;
    perp_mechanism_settings settings;
    perp_mechanism_step step;
    double M[RIG_N * RIG_N], k[RIG_N];
    double gap[RIG_ROWS], H[RIG_ROWS * RIG_N], drift[RIG_ROWS];
    double c[RIG_ROWS], G[RIG_ROWS * RIG_N], c_drift[RIG_ROWS];
    double bound[RIG_ROWS], B[RIG_ROWS * RIG_N], b_drift[RIG_ROWS];
    double mu[RIG_ROWS], mu_static[RIG_ROWS], stribeck[RIG_ROWS], restitution[RIG_ROWS];
    double q[RIG_N], v[RIG_N], impulse[RIG_ROWS], velocity[RIG_ROWS], ray[RIG_ROWS];
    int32_t modes[RIG_ROWS], dims[RIG_ROWS];
    /* what goes wrong */
    int32_t array, entry; /* this entry of this array becomes `value` */
    double value;
    int32_t callback, answer;                    /* this callback returns `answer` */
    void (*inside)(void *rig, int32_t callback); /* called in every callback, or NULL */
    int32_t calls[8];                            /* by callback */
} rig;

/* n velocities, contacts of dimension `dim`, identity mass, no gravity, everything 0. */
void rig_make(rig *r, int32_t n, int32_t contacts, int32_t dim);
/* A sliding contact in 3 dimensions (gap = q[2]), one in 2 that is far (gap = 1 + q[1]), one
 * bilateral row (c = q[3]), dry friction on v[4], and all callbacks. */
void rig_make_everything(rig *r);
/* A context of its own with a handle. */
void rig_open(rig *r);
void rig_close(rig *r);
/* One step from r->q, r->v to themselves; must be PERP_OK. Returns the outcome. */
int32_t rig_advance(rig *r, double h);
/* The same without requiring anything: for refusals. */
perp_status rig_try(rig *r, double h);
/* 1/2 v'Mv. */
double rig_energy(const rig *r, const double *v);

/* Within `tolerance`, relative to numbers of size 1 or to the expected one. */
void rig_near(double value, double expected, double tolerance, const char *what);
/* 0.0, and not -0.0. */
void rig_zero(double value, const char *what);
void rig_says(const rig *r, const char *text);

#endif
