/* A peg in a hole (Whitney): a planar peg of half-width `radius` in a hole of half-width `hole`,
 * both sides parallel. Its two lower corners touch the walls, the hole's two rims its sides. At
 * depth l, pushed by F_z into the hole, F_x across and a moment M about the middle of the tip, it
 * slides in where (F_x / F_z, M / (r F_z)) is inside of
 *
 *   M / (r F_z) = +-lambda - mu (1 + lambda) F_x / F_z   (touches at two opposite points),
 *   |F_x / F_z| = 1 / mu                                  (along one wall),   lambda = l / (2 r
 * mu),
 *
 * and jams outside, with a clearance too small to count. Where l <= 2 mu r the line through two
 * opposite points is inside both cones of friction: the peg can wedge, and jam under any load. */
#include "machines.h"

#include <math.h>

static int32_t peg_mass(double *M, const double *q, void *user)
{
    const machine_peg *peg = &((const machine *)user)->data.peg;

    (void)q;
    M[0] = M[4] = peg->mass;
    M[8] = peg->inertia;
    return 0;
}

static int32_t peg_force(double *k, double t, const double *q, const double *v, void *user)
{
    const machine_peg *peg = &((const machine *)user)->data.peg;
    int32_t i;

    (void)t;
    (void)q;
    (void)v;
    for (i = 0; i < 3; i++)
        k[i] = peg->load[i];
    return 0;
}

/* Point k: left corner, right corner, left rim, right rim. */
static void write_point(double *gap, double *rows, const machine_peg *peg, int32_t point,
                        const double *q)
{
    const double c = cos(q[2]), s = sin(q[2]),
                 side = point % 2 == 0 ? 1 : -1; /* the left wall pushes to the right */
    const double corner[2] = {-side * peg->radius * c, -side * peg->radius * s},
                 rim[2] = {-side * peg->hole - q[0], -q[1]}, wall[2] = {side, 0}, up[2] = {0, 1},
                 across[2] = {side * c, side * s}, axis[2] = {-s, c};

    if (point < 2) {
        *gap = peg->hole + side * (q[0] + corner[0]);
        machine_row(rows, wall, corner);
        machine_row(rows + 3, up, corner);
    } else {
        *gap = -peg->radius - (rim[0] * across[0] + rim[1] * across[1]);
        machine_row(rows, across, rim);
        machine_row(rows + 3, axis, rim);
    }
}

static int32_t peg_rows(double *gap, double *H, double *drift, double *mu, double t,
                        const double *q, void *user)
{
    const machine *m = user;
    int32_t k;

    (void)drift;
    (void)mu;
    (void)t;
    for (k = 0; k < m->model.contacts; k++)
        write_point(&gap[k], &H[6 * k], &m->data.peg, m->data.peg.points[k], q);
    return 0;
}

/* In the middle of a hole that is wider by 1/1000. parameter: depth. */
void machine_make_peg(machine *m, double parameter)
{
    machine_peg *peg = &m->data.peg;
    const double mu = 0.2, depth = parameter;
    const char *source = "Whitney's diagram";
    int32_t k;

    m->model.velocities = 3;
    m->model.contacts = 4;
    m->model.mass = peg_mass;
    m->model.force = peg_force;
    m->model.contact_rows = peg_rows;
    peg->mass = 1;
    peg->inertia = 1e-4;
    peg->radius = 0.01;
    peg->hole = 0.01001;
    peg->load[1] = -1;
    for (k = 0; k < 4; k++) {
        peg->points[k] = k;
        m->mu[k] = mu;
    }
    m->q[1] = -depth;
    m->end = 0.01;
    machine_refer(m, MACHINE_OTHER, 0, depth / (2 * peg->radius * mu), "lambda", source);
    machine_refer(m, MACHINE_OTHER, 0, 2 * mu * peg->radius, "wedges to depth", source);
}

void machine_touch_peg(machine *m, int32_t one, int32_t other)
{
    m->data.peg.hole = m->data.peg.radius;
    m->data.peg.points[0] = one;
    m->data.peg.points[1] = other;
    m->model.contacts = 2;
}
