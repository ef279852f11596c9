#include "contact/coloured/joint_block.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "base/rounding.h"
#include "contact/tuning.h"
#include "linalg/lanes/multiversion.h"
#include "linalg/matrix.h"

static void lay_out_rows(perp__arena *arena, void *object)
{
    perp__joint_block *b = object;
    const size_t rows = (size_t)b->most_rows;

    PERP__INTEGERS(arena, 2 * rows, &b->body);
    b->lane = perp__arena_take(arena, rows, sizeof *b->lane);
    PERP__DOUBLES(arena, rows, &b->scale, &b->w, &b->r, &b->last, &b->error);
    b->x = perp__arena_take(arena, PERP__NODE * rows, sizeof *b->x);
    b->P = perp__arena_take(arena, 16 * rows, sizeof *b->P);
}

void perp__coloured_row(const perp__rigid_problem *problem, const perp__rigid_rows *g, int32_t side,
                        int32_t i, double P[6], double *w)
{
    const int32_t width = problem->width, body = g->body[side];
    const bool moves = perp__rigid_moves(problem, body);
    const double *J = g->rows[side][i], *C = problem->factors + (moves ? width * width * body : 0);

    memset(P, 0, 6 * sizeof *P);
    for (int32_t k = 0; k < width && body >= problem->bodies; k++)
        *w += J[k] * problem->free[width * body + k];
    for (int32_t j = 0; j < 3 && moves && width == 6; j++) {
        P[j] = J[j] * C[0];
        P[3 + j] = J[3] * C[21 + j] + J[4] * C[27 + j] + J[5] * C[33 + j];
    }
    for (int32_t j = 0; j < 3 && moves && width == 3; j++)
        for (int32_t k = 0; k < 3; k++)
            P[j] += J[k] * C[3 * k + j];
}

/* Rows of one pair of bodies are a node: where its lanes are; of unit length, but for those of
 * which impulses move nothing. */
static void form_nodes(perp__joint_block *b)
{
    perp__joint_factor *f = &b->factor;

    for (int32_t n = 0; n < b->rows; n++) {
        const int32_t node = b->lane[n] / PERP__NODE, l = b->lane[n] % PERP__NODE;
        const double *P = b->P + 16 * n;
        const double square = perp__dot(P, P, 16);

        b->scale[n] = !(square < INFINITY) ? NAN : square > 0.0 ? 1.0 / sqrt(square) : 0.0;
        if (l == 0)
            memset(f->P[node], 0, sizeof f->P[node]);
        f->rows[node] = l + 1;
        memcpy(f->body + 2 * node, b->body + 2 * n, 2 * sizeof *f->body);
        for (int32_t j = 0; j < 16; j++)
            f->P[node][j][l] = b->scale[n] * P[j];
    }
}

/* 1. P of the equations, 2. factors of K: with a larger ridge where rounding made a pivot negative.
 * A ridge beyond the number of rows is enough unless K left the range of doubles. */
perp_status perp__joint_block_set_up(perp__joint_block *b, perp_context *context,
                                     const perp__rigid_problem *problem)
{
    double ridge = PERP__RIDGE;
    int32_t rows = 0, keeps;
    size_t size;
    perp_status status;

    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        rows += problem->rows[k].dim;
    keeps = b->keeps && b->factored && rows == b->rows && problem->bodies == b->factor.bodies;
    b->keeps = b->rows = 0;
    b->factored = keeps;
    if (rows == 0)
        return PERP_OK;
    perp__raise_room(&b->most_rows, rows);
    size = (size_t)b->most_rows;
    status = perp__arena_fit_sizes(&b->arena, context, lay_out_rows, b, &b->fitted, &size, 1);
    if (status != PERP_OK)
        return status;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++) {
        const perp__rigid_rows *g = &problem->rows[k];
        for (int32_t i = 0; i < g->dim; i++, b->rows++) {
            const int32_t n = b->rows, *body = b->body + 2 * n, last = n > 0 ? b->lane[n - 1] : -1;

            b->w[n] = g->bias[i];
            b->r[n] = b->last[n] = problem->warm ? problem->warm[3 * k + i] : 0.0;
            if (keeps)
                continue;
            /* what moves by itself has the number behind the others, whose y are 0 */
            memset(b->P + 16 * n, 0, 16 * sizeof *b->P);
            for (int32_t side = 0; side < 2; side++) {
                b->body[2 * n + side] =
                    perp__rigid_moves(problem, g->body[side]) ? g->body[side] : problem->bodies;
                perp__coloured_row(problem, g, side, i, b->P + 16 * n + 8 * side, &b->w[n]);
            }
            /* the next lane of its node, or the first one of the next */
            b->lane[n] =
                n > 0 && (last + 1) % PERP__NODE != 0 && body[0] == body[-2] && body[1] == body[-1]
                    ? last + 1
                    : PERP__NODE * ((last + PERP__NODE) / PERP__NODE);
        }
    }
    if (keeps)
        return PERP_OK;
    status = perp__joint_factor_open(&b->factor, context, b->lane[rows - 1] / PERP__NODE + 1,
                                     problem->bodies);
    if (status == PERP_OK)
        form_nodes(b);
    if (status == PERP_OK && b->most_angle > 0.0)
        return perp__joint_factor_make(&b->factor, context, 0.0,
                                       (b->most_angle * rows) * (b->most_angle * rows),
                                       &b->factored);
    for (; status == PERP_OK && !b->factored && ridge < 1e6 * rows; ridge *= 100.0)
        status = perp__joint_factor_make(&b->factor, context, ridge, -1.0, &b->factored);
    return status;
}

void perp__joint_block_release(perp__joint_block *b)
{
    perp__joint_factor_release(&b->factor);
    perp__arena_release(&b->arena);
}

/* y += sign P' r: what the rows of one joint push together goes to its bodies once. */
PERP__MULTIVERSION(push, (const perp__joint_block *b, double sign, const double *r, double *y),
                   (b, sign, r, y))
{
    for (int32_t n = 0; n < b->rows;) {
        const int32_t *body = b->body + 2 * n;
        double sum[16] = {0.0}, *to[2] = {y + 8 * body[0], y + 8 * body[1]};

        for (; n < b->rows && b->body[2 * n] == body[0] && b->body[2 * n + 1] == body[1]; n++)
            for (int32_t l = 0; l < 16; l++)
                sum[l] += b->P[16 * n + l] * (sign * r[n]);
        for (int32_t l = 0; l < 16; l++)
            to[l / 8][l % 8] += sum[l];
    }
}

void perp__joint_block_add(const perp__joint_block *b, double *y)
{
    push(b, 1.0, b->r, y);
}

/* b->x := P y in the units of the rows, lane by lane. */
PERP__MULTIVERSION(multiply, (perp__joint_block * b, const double *y), (b, y))
{
    const perp__joint_factor *f = &b->factor;

    for (int32_t k = 0; k < f->nodes; k++) {
        double sum[PERP__NODE] = {0.0};

        for (int32_t side = 0; side < 2; side++)
            perp__add_columns(sum, f->rows[k], 1.0, &f->P[k][PERP__NODE * side],
                              y + 8 * f->body[2 * k + side], 6);
        memcpy(b->x + PERP__NODE * k, sum, sizeof sum);
    }
}

/* The largest of x, but for rounding beside the velocities of its node's bodies. */
static double find_lack(const perp__joint_block *b, const double *y)
{
    double largest = 0.0, least = 0.0;

    for (int32_t n = 0; n < b->rows; n++) {
        const double *v = y + 8 * b->body[2 * n], *w = y + 8 * b->body[2 * n + 1];

        if (b->lane[n] % PERP__NODE == 0)
            least = PERP__ROUNDING_LIMIT * sqrt(perp__dot(v, v, 6) + perp__dot(w, w, 6));
        if (fabs(b->x[b->lane[n]]) > (largest > least ? largest : least))
            largest = fabs(b->x[b->lane[n]]);
    }
    return largest;
}

double perp__joint_block_solve(perp__joint_block *b, double share, double momentum, double *y)
{
    double *e = b->error, lack = 0.0;

    if (!b->factored)
        return b->rows > 0 ? INFINITY : 0.0;
    multiply(b, y);
    for (int32_t n = 0; n < b->rows; n++)
        b->x[b->lane[n]] += share * b->scale[n] * b->w[n];
    if (momentum == 0.0) /* else nobody asks for it */
        lack = find_lack(b, y);
    perp__joint_factor_solve(&b->factor, b->x);
    for (int32_t n = 0; n < b->rows; n++) {
        const double now = b->r[n];

        e[n] = b->scale[n] * b->x[b->lane[n]];
        b->r[n] = now + momentum * (now - b->last[n]) - e[n];
        b->last[n] = now;
    }
    push(b, -1.0, e, y);
    return lack;
}
