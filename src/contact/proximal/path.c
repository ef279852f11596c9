/* Where Newton's steps fail: the path of solutions of F(v, rho) = 0 from a centre (newton.c), by
 * its arc length, which turns back in rho where it has to. It is piecewise smooth, and goes forth
 * where det dF/dv is positive and back where it is negative (Garcia & Zangwill, "Pathways to
 * Solutions", 1981): Lemke's path without the corners being counted. Tangents cost two solves,
 *
 *   A v' = -J'P'(u + J v) rho',   A = I + J' (rho P') J,
 *
 * and arc length is that of P(z), the impulses: what separates does not count. */
#include <math.h>
#include <string.h>

#include "contact/proximal/proximal.h"

#define FIRST_LENGTH 0.25 /* of the way from the centre */
#define LEAST_LENGTH 1e-4 /* of the first */
#define SHARE 0.3         /* of the way from the centre, for a relative change of rho */
#define NEARER 0.05       /* the residual, beside the centre's, that ends the path */
#define MOST_RHO 1e14
#define WAY_BACK 1e-2 /* to where it came from: nothing is there */

enum { CORRECTIONS = 6, FEW = 2 };

/* A place on the path, with the direction in which it goes on. v is s->v, v' is s->ahead; a step
 * (dv, drho) has length normal'dv + gamma drho. */
typedef struct place {
    double rho, rho_ahead, gamma;
} place;

/* out := P' in, or transposed; K is rho P'. */
static void bend_rows(const perp__proximal *s, const perp__proximal_part *part, double rho,
                      int32_t transposed, const double *in, double *out)
{
    const int32_t row = transposed ? s->side : 1, column = transposed ? 1 : s->side;

    for (int32_t k = part->constraint; k < part->last_constraint; k++) {
        const int32_t at = s->starts[k], d = s->starts[k + 1] - at;
        const double *K = perp__proximal_slope(s, k);
        double sum[PERP__ROWS_MOST] = {0.0};

        for (int32_t i = 0; i < d; i++)
            for (int32_t j = 0; j < d; j++)
                sum[i] += K[row * i + column * j] / rho * in[at + j];
        for (int32_t i = 0; i < d; i++)
            out[at + i] = sum[i];
    }
}

/* bend := A^-1 J'P'(u + J v), of the last evaluation and factors; spare := u + J v. */
static void find_bend(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    for (int32_t i = part->row; i < part->last_row; i++)
        s->spare[i] = (s->x[i] - s->z[i]) / rho;
    bend_rows(s, part, rho, 0, s->spare, s->start);
    perp__proximal_push(s, part, s->start, s->across);
    perp__proximal_solve(s, part, rho, s->across, s->bend);
}

/* The direction at the last evaluation, whose factors are at hand. Returns 0 at a dead end. */
static int32_t look_ahead(perp__proximal *s, const perp__proximal_part *part, place *at)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;
    const int32_t row = part->row, rows = part->last_row - row;
    double scale, distance = 0.0;

    for (int32_t i = row; i < part->last_row; i++)
        distance += (s->y[i] - s->x[i]) * (s->y[i] - s->x[i]);
    distance *= SHARE * SHARE / (at->rho * at->rho);
    find_bend(s, part, at->rho);
    perp__proximal_move(s, part, s->bend, NULL, s->start);
    for (int32_t i = part->row; i < part->last_row; i++)
        s->start[i] = at->rho * s->start[i] - s->spare[i];
    bend_rows(s, part, at->rho, 0, s->start, s->pull);
    scale = sqrt(perp__dot(s->pull + row, s->pull + row, rows) + distance);
    if (!(scale > 0.0 && scale < INFINITY))
        return 0;
    scale = (s->fronts.is_negative ? -1.0 : 1.0) / scale;
    for (int32_t i = part->row; i < part->last_row; i++)
        s->pull[i] *= scale;
    bend_rows(s, part, at->rho, 1, s->pull, s->start);
    at->gamma = distance * scale - perp__dot(s->start + row, s->spare + row, rows);
    at->rho_ahead = scale;
    perp__proximal_push(s, part, s->start, s->normal);
    if (s->by_rows) { /* J is W, and as good as symmetric */
        perp__proximal_move(s, part, s->normal, NULL, s->start);
        perp__proximal_push(s, part, s->start, s->normal);
    }
    for (int32_t i = begin; i < end; i++) {
        s->normal[i] *= -at->rho;
        s->ahead[i] = -scale * s->bend[i];
    }
    return 1;
}

static int32_t factor_at(perp__proximal *s, const perp__proximal_part *part, double rho)
{
    perp__proximal_slopes(s, part, rho);
    s->factorisations++;
    return perp__proximal_factor(s, part);
}

/* From `length` ahead back to the path, across the direction: image := v, *rho. Returns how many
 * corrections that took, -1 where it fails. */
static int32_t correct(perp__proximal *s, const perp__proximal_part *part, const place *at,
                       double length, double enough, double *rho)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;
    double size, last = INFINITY;

    *rho = at->rho + length * at->rho_ahead;
    for (int32_t i = begin; i < end; i++)
        s->image[i] = s->v[i] + length * s->ahead[i];
    for (int32_t k = 0; k <= CORRECTIONS; k++) {
        double off, along, step;

        if (!(*rho > 0.0))
            return -1;
        size = perp__proximal_evaluate(s, part, *rho, s->image);
        if (size < enough)
            return k;
        if (k == CORRECTIONS || !(size < 3.0 * last) || s->factorisations >= s->limit ||
            !factor_at(s, part, *rho))
            return -1;
        last = size;
        perp__proximal_solve(s, part, *rho, s->rhs, s->step);
        find_bend(s, part, *rho);
        off = at->gamma * (*rho - at->rho - length * at->rho_ahead);
        along = at->gamma;
        for (int32_t i = begin; i < end; i++) {
            off += s->normal[i] * (s->image[i] - s->v[i] - length * s->ahead[i] - s->step[i]);
            along -= s->normal[i] * s->bend[i];
        }
        step = -off / along;
        *rho += step;
        for (int32_t i = begin; i < end; i++)
            s->image[i] -= s->step[i] + step * s->bend[i];
    }
    return -1;
}

/* A step along the path: length is shortened until it succeeds, and made what the next should be.
 * Returns 0 where that is too short. */
static int32_t advance(perp__proximal *s, const perp__proximal_part *part, place *at,
                       double *length, double least, int64_t last)
{
    const int32_t begin = part->block * s->width, end = part->last_block * s->width;
    const double enough = perp__proximal_enough(s, part);
    int32_t taken = -1;
    double rho = at->rho;

    perp__proximal_evaluate(s, part, at->rho, s->v);
    if (!factor_at(s, part, at->rho) || !look_ahead(s, part, at))
        return 0;
    while (taken < 0 && *length > least && s->factorisations < last) {
        taken = correct(s, part, at, *length, enough, &rho);
        *length *= taken < 0 ? 0.25 : taken <= FEW ? 2.0 : taken <= FEW + 2 ? 1.2 : 0.6;
    }
    if (taken < 0)
        return 0;
    at->rho = rho;
    memcpy(s->v + begin, s->image + begin, (size_t)(end - begin) * sizeof *s->v);
    return 1;
}

int32_t perp__proximal_follow(perp__proximal *s, const perp__proximal_part *part, double *rho,
                              int32_t most)
{
    const double start = *rho;
    const int64_t last = s->factorisations + most < s->limit ? s->factorisations + most : s->limit;
    place at = {*rho, 0.0, 0.0};
    double length = 0.0, least;

    for (int32_t i = part->row; i < part->last_row; i++)
        length += (s->y[i] - s->x[i]) * (s->y[i] - s->x[i]);
    length = FIRST_LENGTH * sqrt(length);
    least = LEAST_LENGTH * length;
    while (s->factorisations < last && at.rho < MOST_RHO && at.rho > WAY_BACK * start) {
        double found;

        if (!advance(s, part, &at, &length, least, last))
            return 0;
        memcpy(s->start + part->row, s->y + part->row,
               (size_t)(part->last_row - part->row) * sizeof *s->y);
        found = perp__proximal_judge(s, part, s->start, s->spare);
        if (found < NEARER * s->residual || found < s->tol) {
            *rho = at.rho;
            return 1;
        }
    }
    return 0;
}
