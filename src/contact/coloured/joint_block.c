#include "contact/coloured/joint_block.h"

#include <math.h>
#include <string.h>

#include "base/context.h"
#include "linalg/lanes/multiversion.h"

/* Joints are out of place by less than this, as an angle. Rows that repeat others, as those of
 * hinges in a loop do, come near to them by that times the number of rows, over which it adds up:
 * the square of it is their pivot beside a unit diagonal. What they ask for beyond others would
 * take speeds of its inverse. */
#define PLACED 1e-6

static void lay_out_rows(perp__arena *arena, void *object)
{
    perp__joint_block *b = object;
    const size_t rows = (size_t)b->most_rows;

    PERP__INTEGERS(arena, rows, &b->all, &b->mark, &b->place);
    PERP__INTEGERS(arena, 2 * rows, &b->body, &b->touching);
    if (b->body)
        memset(b->body, 0, 2 * rows * sizeof *b->body);
    b->starts = perp__arena_take(arena, rows + 1, sizeof *b->starts);
    b->first = perp__arena_take(arena, (size_t)b->most_bodies + 2, sizeof *b->first);
    PERP__DOUBLES(arena, rows, &b->scale, &b->w, &b->r, &b->last, &b->error);
    b->P = perp__arena_take(arena, 16 * rows, sizeof *b->P);
    if (b->P)
        memset(b->P, 0, 16 * rows * sizeof *b->P);
}

static void lay_out_entries(perp__arena *arena, void *object)
{
    perp__joint_block *b = object;

    b->indices = perp__arena_take(arena, (size_t)b->most_entries, sizeof *b->indices);
    b->values = perp__arena_take(arena, (size_t)b->most_entries, sizeof *b->values);
}

/* Row i of the unit g as row n of the block; returns whether it had the same P before. What moves
 * by itself has the number behind the others, whose y are 0. */
static int32_t read_row(perp__joint_block *b, const perp__rigid_problem *problem,
                        const perp__rigid_rows *g, int32_t i, int32_t n)
{
    const int32_t width = problem->width;
    double P[16] = {0.0}, *old = b->P + 16 * n;
    int32_t bodies[2], same;

    b->w[n] = g->bias[i];
    for (int32_t side = 0; side < 2; side++) {
        const int32_t body = g->body[side], moves = body >= 0 && body < problem->bodies;
        const double *J = g->rows[side][i],
                     *C = problem->factors + (moves ? width * width * body : 0);

        bodies[side] = moves ? body : problem->bodies;
        for (int32_t k = 0; k < width && body >= 0; k++)
            if (!moves)
                b->w[n] += J[k] * problem->free[width * body + k];
            else if (J[k] != 0.0)
                for (int32_t j = 0; j < width; j++)
                    P[8 * side + j] += J[k] * C[width * k + j];
    }
    same = !memcmp(old, P, sizeof P) && !memcmp(b->body + 2 * n, bodies, sizeof bodies);
    memcpy(old, P, sizeof P);
    memcpy(b->body + 2 * n, bodies, sizeof bodies);
    return same;
}

/* The rows of each body, in order; returns the most entries that K can have. */
static int64_t list_rows(perp__joint_block *b, int32_t bodies)
{
    int64_t most = 0;

    memset(b->first, 0, (size_t)(bodies + 2) * sizeof *b->first);
    for (int32_t k = 0; k < 2 * b->rows; k++)
        if (b->body[k] < bodies)
            b->first[b->body[k] + 2]++;
    for (int32_t i = 0; i < bodies; i++) {
        most += (int64_t)b->first[i + 2] * b->first[i + 2];
        b->first[i + 2] += b->first[i + 1];
    }
    for (int32_t k = 0; k < 2 * b->rows; k++)
        if (b->body[k] < bodies)
            b->touching[b->first[b->body[k] + 1]++] = k;
    return most;
}

PERP__KERNEL static double dot8(const double *a, const double *b)
{
    double part[8];

    for (int32_t l = 0; l < 8; l++)
        part[l] = a[l] * b[l];
    for (int32_t l = 0; l < 4; l++)
        part[l] += part[l + 4];
    return (part[0] + part[2]) + (part[1] + part[3]);
}

/* K = P P', column by column: rows meet on the bodies that they share. */
PERP__MULTIVERSION(multiply, (perp__joint_block * b, int32_t bodies), (b, bodies))
{
    int32_t entries = 0;

    for (int32_t j = 0; j < b->rows; j++)
        b->mark[j] = -1;
    for (int32_t j = 0; j < b->rows; j++) {
        b->starts[j] = entries;
        for (int32_t side = 0; side < 2; side++) {
            const int32_t body = b->body[2 * j + side];
            const int32_t end = body < bodies ? b->first[body + 1] : 0;
            const double *P = b->P + 16 * j + 8 * side;

            for (int32_t k = body < bodies ? b->first[body] : 0; k < end; k++) {
                const int32_t i = b->touching[k] / 2;

                if (b->mark[i] != j) {
                    b->mark[i] = j;
                    b->place[i] = entries;
                    b->indices[entries] = i;
                    b->values[entries++] = 0.0;
                }
                b->values[b->place[i]] += dot8(P, b->P + 8 * b->touching[k]);
            }
        }
        b->scale[j] = b->mark[j] == j ? b->values[b->place[j]] : 0.0;
        b->scale[j] = b->scale[j] > 0.0 ? 1.0 / sqrt(b->scale[j]) : 0.0;
        b->all[j] = j;
    }
    b->starts[b->rows] = entries;
}

/* 1. P of the equations; as they were they have their factors, 2. K, 3. its factors: there are some
 * unless K left the range of doubles. */
perp_status perp__joint_block_set_up(perp__joint_block *b, perp_context *context,
                                     const perp__rigid_problem *problem)
{
    int32_t rows = 0, same = b->factored;
    int64_t entries;
    perp_status status;

    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        rows += problem->rows[k].dim;
    same = same && rows == b->rows && problem->bodies == b->bodies;
    b->rows = b->factored = 0;
    if (rows == 0)
        return PERP_OK;
    perp__raise_room(&b->most_rows, rows);
    perp__raise_room(&b->most_bodies, problem->bodies);
    status = perp__arena_fit(&b->arena, context, lay_out_rows, b);
    if (status != PERP_OK)
        return status;
    b->bodies = problem->bodies;
    for (int32_t k = problem->contacts; k < problem->contacts + problem->joints; k++)
        for (int32_t i = 0; i < problem->rows[k].dim; i++, b->rows++) {
            same &= read_row(b, problem, &problem->rows[k], i, b->rows);
            b->r[b->rows] = b->last[b->rows] = problem->warm ? problem->warm[3 * k + i] : 0.0;
        }
    b->factored = same;
    if (same)
        return PERP_OK;
    entries = list_rows(b, problem->bodies);
    if (entries > INT32_MAX)
        return perp__fail_memory(context, "the equations of joints");
    perp__raise_room(&b->most_entries, (int32_t)entries);
    status = perp__arena_fit(&b->entry_arena, context, lay_out_entries, b);
    if (status != PERP_OK)
        return status;
    multiply(b, problem->bodies);
    b->K = (perp__matrix){.rows = rows,
                          .columns = rows,
                          .row_stride = 1,
                          .column_stride = 1,
                          .column_starts = b->starts,
                          .row_indices = b->indices,
                          .values = b->values};
    status = perp__sparse_cholesky_analyse(&b->cholesky, context, &b->K, b->scale);
    b->factored =
        status == PERP_OK && perp__sparse_cholesky_factor(&b->cholesky, b->all, rows, 0.0,
                                                          (PLACED * rows) * (PLACED * rows));
    return status;
}

void perp__joint_block_invert(perp__joint_block *b, double *x)
{
    for (int32_t n = 0; n < b->rows; n++)
        x[n] *= b->scale[n];
    if (b->factored)
        perp__sparse_cholesky_solve(&b->cholesky, x);
    for (int32_t n = 0; n < b->rows; n++)
        x[n] *= b->scale[n];
}

int32_t perp__joint_block_repeats(const perp__joint_block *b, int32_t n)
{
    return b->factored && perp__sparse_cholesky_depends(&b->cholesky, n);
}

void perp__joint_block_release(perp__joint_block *b)
{
    perp__sparse_cholesky_release(&b->cholesky);
    perp__arena_release(&b->arena);
    perp__arena_release(&b->entry_arena);
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

/* b->error := P y + share w in the units of the rows. */
PERP__MULTIVERSION(find_lacks, (perp__joint_block * b, double share, const double *y),
                   (b, share, y))
{
    for (int32_t n = 0; n < b->rows; n++) {
        const double *P = b->P + 16 * n;
        const int32_t *body = b->body + 2 * n;

        b->error[n] = b->scale[n] *
                      (share * b->w[n] + (dot8(P, y + 8 * body[0]) + dot8(P + 8, y + 8 * body[1])));
    }
}

/* b->error := K^-1 (P y + share w), and y less what that pushes. Returns the largest that a row
 * lacked before. */
static double meet(perp__joint_block *b, double share, double *y)
{
    double *e = b->error, largest = 0.0;

    if (!b->factored) {
        memset(e, 0, (size_t)b->rows * sizeof *e);
        return INFINITY;
    }
    find_lacks(b, share, y);
    for (int32_t n = 0; n < b->rows; n++)
        largest = fabs(e[n]) > largest ? fabs(e[n]) : largest;
    perp__sparse_cholesky_solve(&b->cholesky, e);
    for (int32_t n = 0; n < b->rows; n++)
        e[n] *= b->scale[n];
    push(b, -1.0, e, y);
    return largest;
}

double perp__joint_block_solve(perp__joint_block *b, double momentum, double *y)
{
    const double lack = b->rows > 0 ? meet(b, 1.0, y) : 0.0;

    for (int32_t n = 0; n < b->rows; n++) {
        const double now = b->r[n];

        b->r[n] = now + momentum * (now - b->last[n]) - b->error[n];
        b->last[n] = now;
    }
    return lack;
}

void perp__joint_block_project(perp__joint_block *b, double *y)
{
    if (b->rows > 0)
        (void)meet(b, 0.0, y);
}
