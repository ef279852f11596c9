/* Contacts of rigid bodies, the common case in one piece of memory: at most 3 rows on at most 2
 * blocks of 6 unknowns, tangents turned to where the local problem is diagonal. A row that a
 * frictionless or planar contact lacks is zero, and so are the unknowns that a planar body lacks
 * and the piece of a contact with the ground. */
#include <math.h>
#include <string.h>

#include "contact/law.h"
#include "contact/sweep/local_step.h"
#include "contact/sweep/sweep.h"
#include "linalg/lanes/lanes.h"
#include "linalg/lanes/multiversion.h"

enum { WIDTH = PERP__PACKED_WIDTH, ROW = PERP__PACKED_ROW };

int32_t perp__sweep_packs(const perp__sweep_work *work, int32_t k)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const int32_t first = problem->starts[k], dim = problem->dims[k];

    return perp__contact_two_sided(problem, k) == 0 && problem->starts[k + 1] - first == dim &&
           b->piece_starts[k + 1] - b->piece_starts[k] <= 2 &&
           (dim < 3 || b->compliance[first + 1] == b->compliance[first + 2]);
}

static void pack_row(double *row, int32_t which, double factor, const double *piece, int32_t width)
{
    for (int32_t j = 0; j < width; j++)
        row[perp__packed_place(which, j)] += factor * piece[j];
}

void perp__sweep_pack(perp__sweep_work *work, int32_t k, perp__packed_contact *c)
{
    const perp__contact_problem *problem = work->common.problem;
    const perp__bodies *b = problem->bodies;
    const perp__local *local = &work->local[k];
    const int32_t first = problem->starts[k], dim = problem->dims[k];
    const int64_t start = b->piece_starts[k];
    const double turn[2][2] = {{local->turn[0], local->turn[1]}, {-local->turn[1], local->turn[0]}};

    memset(c, 0, sizeof *c);
    c->blocks[0] = c->blocks[1] = b->blocks;
    for (int64_t piece = start; piece < b->piece_starts[k + 1]; piece++) {
        const double *p = b->values + b->piece_values[piece];
        const int32_t which = (int32_t)(piece - start);

        c->blocks[which] = b->piece_blocks[piece];
        pack_row(c->P, which, 1.0, p, b->width);
        for (int32_t i = 1; i < dim; i++)
            for (int32_t j = 1; j < dim; j++)
                pack_row(c->P + i * ROW, which, turn[i - 1][j - 1], p + j * b->width, b->width);
    }
    for (int32_t i = 0; i < dim; i++) {
        c->q[i] = problem->q[first + i];
        c->compliance[i > 0] = b->compliance[first + i];
    }
    if (dim == 3) {
        c->q[1] = turn[0][0] * problem->q[first + 1] + turn[0][1] * problem->q[first + 2];
        c->q[2] = turn[1][0] * problem->q[first + 1] + turn[1][1] * problem->q[first + 2];
    }
    c->local = *local;
    if (dim < 3) /* the rows that are missing stick at 0 */
        c->local.s[1] = c->local.inverse_s[1] = 1.0;
    if (dim < 2)
        c->local.s[0] = c->local.inverse_s[0] = 1.0;
    c->weight = work->weights[k] * work->weights[k];
}

#define SUM_LANES(v) ((((v)[0] + (v)[2]) + ((v)[1] + (v)[3])))

/* u := P (first, second) + q + compliance x */
PERP__KERNEL static void find_velocity(const perp__packed_contact *c, const double *first,
                                       const double *second, const double *x, double *u)
{
    const perp__lanes a = PERP__CONST_LANES_AT(first), b = PERP__CONST_LANES_AT(second);
    const perp__lanes ends = {first[4], first[5], second[4], second[5]};
    const double *P = c->P;

    for (int32_t i = 0; i < 3; i++, P += ROW) {
        const perp__lanes sum = PERP__CONST_LANES_AT(P) * a + PERP__CONST_LANES_AT(P + 4) * b +
                                PERP__CONST_LANES_AT(P + 8) * ends;

        u[i] = SUM_LANES(sum) + (c->q[i] + c->compliance[i > 0] * x[i]);
    }
}

/* (first, second) += P'd */
PERP__KERNEL static void push(const perp__packed_contact *c, const double *d, double *first,
                              double *second)
{
    perp__lanes a = PERP__LANES_AT(first), b = PERP__LANES_AT(second);
    perp__lanes ends = {first[4], first[5], second[4], second[5]};

    for (int32_t i = 2; i >= 0; i--) { /* the normal last: its step is known last */
        const perp__lanes step = PERP__SAME_LANES(d[i]);
        const double *P = c->P + i * ROW;

        a += PERP__CONST_LANES_AT(P) * step;
        b += PERP__CONST_LANES_AT(P + 4) * step;
        ends += PERP__CONST_LANES_AT(P + 8) * step;
    }
    PERP__LANES_AT(first) = a;
    PERP__LANES_AT(second) = b;
    first[4] = ends[0];
    first[5] = ends[1];
    second[4] = ends[2];
    second[5] = ends[3];
}

PERP__MULTIVERSION_SHARED(perp__sweep_packed,
                          (perp__sweep_work * work, int32_t from, int32_t to, double *most),
                          (work, from, to, most))
{
    double worst = *most;

    for (int32_t k = from; k < to; k++) {
        perp__packed_contact *c = &work->packed[k];
        const int32_t dim = work->rows[k + 1] - work->rows[k];
        double *first = work->y + (size_t)c->blocks[0] * WIDTH;
        double *second = work->y + (size_t)c->blocks[1] * WIDTH, *r = work->r + work->rows[k];
        double x[3] = {r[0], dim > 1 ? r[1] : 0.0, dim > 2 ? r[2] : 0.0}, u[3], d[3], change;

        find_velocity(c, first, second, x, u);
        memcpy(d, x, sizeof d);
        work->modes[k] =
            (int8_t)(dim == 2 ? perp__step_2(&c->local, u, x) : perp__step_3(&c->local, u, x));
        for (int32_t i = 0; i < 3; i++)
            d[i] = x[i] - d[i];
        change = d[0] * d[0] + (d[1] * d[1] + d[2] * d[2]);
        if (change != 0.0) {
            for (int32_t i = 0; i < dim; i++)
                r[i] = x[i];
            push(c, d, first, second);
        }
        change *= c->weight;
        if (!(change <= worst))
            worst = isnan(worst) ? worst : change;
    }
    *most = worst;
}

/* to := from with the tangents of packed contacts turned into their frames (1) or back (-1) */
static void turn(const perp__sweep_work *work, int32_t which, const double *from, double *to)
{
    memcpy(to, from, (size_t)work->size * sizeof *to);
    for (int32_t k = 0; work->packed && k < work->common.problem->contacts; k++) {
        const double *turn = work->local[k].turn;
        const int32_t first = work->rows[k];

        if (!work->packs[k] || work->rows[k + 1] - first < 3)
            continue;
        to[first + 1] = turn[0] * from[first + 1] + which * (turn[1] * from[first + 2]);
        to[first + 2] = turn[0] * from[first + 2] - which * (turn[1] * from[first + 1]);
    }
}

void perp__sweep_import(perp__sweep_work *work, const double *x)
{
    turn(work, 1, x, work->r);
}

/* Slips near the edge of their cones may be outside of them by a hair. */
void perp__sweep_export(perp__sweep_work *work, const double *r)
{
    turn(work, -1, r, work->x);
    for (int32_t k = 0; k < work->common.problem->contacts; k++)
        perp__contact_clip(work->common.problem, k, work->x);
}
